#!/bin/sh
# One would expect kinematic_kf(dim=2, order=1, dim_z=2) of filterpy to be a filter of positions in two dimensions, as it was for eight years.
# In 2.0.0 each row of its measurement matrix has a 1 for every dimension: both measurements are taken for x + y, and nothing is raised.
# It hurts programs written for 1.4.5: their track collapses onto the line x = y. The default, dim_z=1, measures the sum as well,
# but there a position of two numbers is refused.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet --disable-pip-version-check numpy==2.4.6 scipy==1.17.1
cat >"$folder/walk.py" <<'PY'
from filterpy.common import kinematic_kf

walker = kinematic_kf(dim=2, order=1, dt=1.0, dim_z=2)
walker.P *= 100.0
for t in range(50):
    walker.predict()
    walker.update([3.0 + t, 100.0 - 2.0 * t])
print(*walker.H.astype(int).ravel(), "at", *walker.x[::2, 0].round(1))
PY
seen() {
	"$folder/env/bin/pip" install --quiet --disable-pip-version-check --no-deps "filterpy==$1"
	"$folder/env/bin/python" "$folder/walk.py"
}
older=$(seen 1.4.5)
newer=$(seen 2.0.0)
echo "measured without noise up to (52, 2); measurement matrix and estimate of filterpy 1.4.5: $older; of 2.0.0: $newer"
[ "$older; $newer" = "1 0 0 0 0 0 1 0 at 52.0 2.0; 1 0 1 0 1 0 1 0 at 13.5 13.5" ] || { echo "this has changed"; exit 1; }
