#!/bin/sh
# One would expect a compiled function that a loop calls with an integer variable to be compiled once, for integers.
# numba types `k = 0` as the constant 0 in its first round of inference: it compiles the callee for Literal[int](0), then again for int64,
# and keeps both, though the first is never run. Every callee below it is compiled twice as well.
# It hurts programs with deep trees of kernels: a first start compiles the same code twice, and their caches hold both.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet --disable-pip-version-check numba==0.68.1 numpy==2.4.6
cat >"$folder/twice.py" <<'PY'
import numba

@numba.njit
def add(total, k):
    return total + k

@numba.njit
def count(n):
    total = 0
    for k in range(n):
        total = add(total, k)
    return total

count(3)
print(*(signature[0] for signature in add.signatures), sep=", ")
PY
found=$("$folder/env/bin/python" "$folder/twice.py")
echo "numba 0.68.1: versions of the callee, by its first argument: $found"
[ "$found" = "Literal[int](0), int64" ] || { echo "this has changed"; exit 1; }
