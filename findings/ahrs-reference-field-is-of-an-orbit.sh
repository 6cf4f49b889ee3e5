#!/bin/sh
# One would expect the filter `EKF` of ahrs without a magnetic reference to refuse a magnetometer, or to take the field on the ground.
# It takes the field of Munich on the day of the run, and hands the city's height of 521 m to a model that wants kilometres: the field of an orbit.
# It hurts reproducibility, the same recording gives another attitude next year, and the heading: in Munich itself the declination is a degree off.
# Elsewhere the reference is that of another city.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet --disable-pip-version-check AHRS==0.4.0 numpy==2.4.6
cat >"$folder/field.py" <<'PY'
import numpy as np
from ahrs.common.constants import MUNICH_HEIGHT, MUNICH_LATITUDE, MUNICH_LONGITUDE
from ahrs.filters import EKF
from ahrs.utils import WMM


def direction(height_km):
    field = WMM(latitude=MUNICH_LATITUDE, longitude=MUNICH_LONGITUDE, height=height_km)
    vector = np.array([field.X, field.Y, field.Z])
    return vector / np.linalg.norm(vector)


used = EKF().m_ref
print(MUNICH_HEIGHT, np.allclose(used, direction(MUNICH_HEIGHT)), np.allclose(used, direction(MUNICH_HEIGHT / 1000)))
PY
found=$("$folder/env/bin/python" "$folder/field.py")
echo "AHRS 0.4.0: height of Munich, EKF's field is that of so many km, of so many m: $found"
[ "$found" = "521.0 True False" ] || { echo "this has changed"; exit 1; }
