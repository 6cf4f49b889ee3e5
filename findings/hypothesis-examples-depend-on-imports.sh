#!/bin/sh
# One would expect `derandomize=True` to draw the same examples of a test in every run, until Python, Hypothesis or the test itself changes.
# Hypothesis collects constants from all local modules that are imported, and draws some of them: the same test draws others as soon as one
# more module of the project is imported, for example because another file of tests is run in the same process.
# It hurts who runs one file of a suite alone: a test that fails there passes in the whole suite, or the other way round.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet --disable-pip-version-check hypothesis==6.170.15
cat >"$folder/limits.py" <<'PY'
LIMITS = (91827, 73645, 55463, 37281)
PY
cat >"$folder/drawn.py" <<'PY'
import hashlib, sys
from hypothesis import given, settings, strategies as st
if len(sys.argv) > 1:
    import limits
seen = []

@settings(derandomize=True, database=None, max_examples=500)
@given(st.integers())
def draw(number):
    seen.append(number)

draw()
print(hashlib.sha256(repr(seen).encode()).hexdigest()[:8])
PY
cd "$folder"
alone=$(env/bin/python drawn.py)
again=$(env/bin/python drawn.py)
beside=$(env/bin/python drawn.py beside)
echo "hypothesis 6.170.15: digest of 500 drawn integers: alone $alone, again $again, with it imported $beside"
[ "$alone" = "$again" ] && [ "$alone" != "$beside" ] || { echo "this has changed"; exit 1; }
