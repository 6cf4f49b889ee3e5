#!/bin/sh
# One would expect the world magnetic model of ahrs to know the field at every place on earth.
# On the meridian of Greenwich and on the equator, where a coordinate is 0, its components stay None, without an error; a nanodegree beside, they are there.
# The class asks whether latitude and longitude are given by asking whether they are true.
# It hurts whoever computes a declination for a plan whose origin is a round number: compass north is left out, or fails far from the cause.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet --disable-pip-version-check AHRS==0.4.0 numpy==2.4.6
cat >"$folder/field.py" <<'PY'
from ahrs.utils import WMM

places = [(51.48, 0.0), (51.48, 1e-9), (0.0, 9.45), (1e-9, 9.45)]
print([WMM(latitude=latitude, longitude=longitude).D is None for latitude, longitude in places])
PY
found=$("$folder/env/bin/python" "$folder/field.py")
echo "AHRS 0.4.0: no declination at Greenwich, beside it, on the equator, beside it: $found"
[ "$found" = "[True, False, True, False]" ] || { echo "this has changed"; exit 1; }
