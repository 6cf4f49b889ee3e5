#!/bin/sh
# One would expect ezdxf's recover mode, which its manual recommends for files of unknown origin, to read at least what the strict mode reads.
# A binary DXF that the same package has written is read by `ezdxf.readfile`, and refused by `recover.read` with "Invalid group code".
# It hurts importers that call the tolerant reader alone: drawings that CAD programs save as binary DXF seem to be damaged.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet --disable-pip-version-check ezdxf==1.4.5
cat >"$folder/read.py" <<'PY'
import io, sys
import ezdxf
from ezdxf import recover

path = sys.argv[1]
drawing = ezdxf.new("R2010")
drawing.modelspace().add_line((0, 0), (1, 0))
drawing.saveas(path, fmt="bin")
strict = len(ezdxf.readfile(path).modelspace())
try:
    tolerant = len(recover.read(io.BytesIO(open(path, "rb").read()))[0].modelspace())
except ezdxf.DXFStructureError as error:
    tolerant = str(error).split('"')[0].strip()
print(f"readfile: {strict} line; recover.read: {tolerant}")
PY
seen=$("$folder/env/bin/python" "$folder/read.py" "$folder/a.dxf")
echo "ezdxf 1.4.5, a binary DXF: $seen"
[ "$seen" = "readfile: 1 line; recover.read: Invalid group code" ] || { echo "this has changed"; exit 1; }
