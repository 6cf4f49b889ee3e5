#!/bin/sh
# One would expect numpy.loadtxt to raise what open and numpy.load raise for a file that is not there: errno ENOENT, its words in strerror, its name.
# numpy 2.4.6 raises a FileNotFoundError of a text alone: errno, strerror and filename are None, in genfromtxt too.
# It hurts programs that print strerror ("cannot read a.csv: None"), or ask for errno.ENOENT before they take a default or wait for the file.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet --disable-pip-version-check numpy==2.4.6
found=$("$folder/env/bin/python" - <<'PY'
import numpy as np
for read in (open, np.load, np.loadtxt, np.genfromtxt):
    try:
        read("none.csv")
    except FileNotFoundError as error:
        print(read.__name__, error.errno, error.strerror, error.filename, end="; ")
PY
)
echo "numpy 2.4.6: reader, errno, strerror, filename of a missing file: $found"
words="2 No such file or directory none.csv"
[ "$found" = "open $words; load $words; loadtxt None None None; genfromtxt None None None; " ] || { echo "this has changed"; exit 1; }
