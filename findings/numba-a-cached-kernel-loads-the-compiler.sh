#!/bin/sh
# One would expect a kernel that numba finds in its cache (`cache=True`) to be loaded without what only a compiler needs.
# The first one loaded imports the implementations of all functions that numba knows, and reads the kernel's bitcode besides its machine code.
# It hurts programs that start to run a few cached kernels: a tenth of a second and tens of megabytes before the first one returns.
# No option leaves it out.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet --disable-pip-version-check numba==0.68.1 numpy==2.4.6
cat >"$folder/cached.py" <<'PY'
import sys

from numba import njit


@njit(cache=True)
def twice(x):
    return 2.0 * x


before = set(sys.modules)
twice(1.0)
more = {name for name in set(sys.modules) - before if name.startswith("numba.")}
print(sum(twice.stats.cache_hits.values()), "numba.np.npyfuncs" in more, "numba.cpython.setobj" in more)
PY
"$folder/env/bin/python" "$folder/cached.py" >"$folder/first"
found=$("$folder/env/bin/python" "$folder/cached.py")
echo "numba 0.68.1: cache hits, implementations of numpy's functions and of sets imported by them: $found"
[ "$found" = "1 True True" ] || { echo "this has changed"; exit 1; }
