# SPDX-License-Identifier: MIT
"""Ranges of two simulated rangers at the pose of a laser scan: the nearest return within half a cone at either side that is loud enough.

In: scans. Out: ranges of the left and the right ranger at each scan. Owns nothing. The losses are those of the simulated SRF02 (`acoustics`); scans
end at 90 degrees, so the rear half of each cone is missing: the rangers look AHEAD_RAD ahead of abeam; the filter's settings state this.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Floats, Ints
from echostep_app.simulation.world.acoustics import SRF02, Acoustics, wall_db
from echostep_app.simulation.world.echoes import ranger_bias_m
from echostep_studies.bench.laser.carmen_log import CarmenLog

HALF_CONE_RAD = math.radians(27.5)  # half of the 55 degree cone [Robot Electronics, sonar FAQ]
AHEAD_RAD = 0.5 * HALF_CONE_RAD  # middle of the half before abeam


def hear(log: CarmenLog, scans: Ints, rng: np.random.Generator, acoustics: Acoustics = SRF02) -> Floats:
    """Ranges (k, 2) of the left and the right ranger at these scans, NaN where no echo is received."""
    bias_m = ranger_bias_m(rng, acoustics)
    ranges_m = np.full((len(scans), 2), np.nan)
    for row, scan in enumerate(scans.tolist()):
        for ranger, side in enumerate((1.0, -1.0)):
            off_axis = np.abs(side * log.angles_rad - 0.5 * math.pi)
            inside = off_axis <= HALF_CONE_RAD
            threshold_db = acoustics.threshold_db + acoustics.threshold_sd_db * rng.standard_normal()
            nearest = nearest_return(log.range_m[scan, inside], off_axis[inside], threshold_db, acoustics)
            noisy = nearest + bias_m[ranger] + acoustics.noise_m * rng.standard_normal()
            ranges_m[row, ranger] = max(noisy, acoustics.minimum_m)
    return ranges_m


def nearest_return(range_m: Floats, off_axis_rad: Floats, threshold_db: float, acoustics: Acoustics) -> float:
    """The nearest of the returns (n,) that is louder than the threshold; NaN: none."""
    for k in np.argsort(range_m).tolist():
        if range_m[k] > acoustics.maximum_m:
            break
        if range_m[k] > 0.0 and wall_db(range_m[k], off_axis_rad[k], acoustics) >= threshold_db:
            return float(range_m[k])
    return math.nan
