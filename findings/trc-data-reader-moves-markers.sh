#!/bin/sh
# One would expect a marker that is blank in one frame of a TRC file, as when no camera saw it, to be missing there, and the others to be themselves.
# trc-data-reader 0.4.1 splits its lines at any white space: each marker behind the gap gets the name of the one before it, the last is missing.
# It does so with files that it wrote itself, and raises nothing; 0.3.7, of the line before, reads them right.
# It hurts gait analysis: the heel jumps to the toe for a few frames, and clearance, events and joint angles are computed from it.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
cat >"$folder/gap.py" <<'PY'
import sys
from trc import TRCData

path, nothing = sys.argv[1], [float("nan")] * 3
made = TRCData(PathFileType=4, DataFormat="(X/Y/Z)", FileName="walk.trc", DataRate=100.0, CameraRate=100.0, NumFrames=1, NumMarkers=3, Units="mm")
made.update({"OrigDataRate": 100.0, "OrigDataStartFrame": 1, "OrigNumFrames": 1, "Markers": ["HEEL", "TOE", "KNEE"], "Frame#": [1]})
made[1] = (0.0, [nothing, [2.0, 2.0, 2.0], [3.0, 3.0, 3.0]])
made.save(path)
read = TRCData()
read.load(path)
print(*(f"{name} {read[name][0][0]}" for name in read["Markers"]), sep=", ")
PY
seen() {
	"$folder/env/bin/pip" install --quiet --disable-pip-version-check "trc-data-reader==$1" c3d==0.6.0 numpy==2.4.6
	"$folder/env/bin/python" "$folder/gap.py" "$folder/walk.trc"
}
older=$(seen 0.3.7)
newer=$(seen 0.4.1)
echo "HEEL is missing, TOE is at x = 2, KNEE at 3; trc-data-reader 0.3.7 reads $older; 0.4.1: $newer"
[ "$older; $newer" = "HEEL nan, TOE 2.0, KNEE 3.0; HEEL 2.0, TOE 3.0, KNEE nan" ] || { echo "this has changed"; exit 1; }
