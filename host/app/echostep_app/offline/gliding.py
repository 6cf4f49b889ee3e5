# SPDX-License-Identifier: MIT
"""Whether a sensor that made no step moved nevertheless: on wheels, on skates, in a car.

In: samples, and the track computed from them. Out: an EchostepError. Owns nothing. A smooth ride looks like rest: its path would be a point.
"""

from __future__ import annotations

import numpy as np

from echostep.errors import EchostepError
from echostep.foot.steps import Track
from echostep.offline.imu_checks import NEEDED
from echostep.offline.imu_csv import Imu

WITHIN_S, MOVED_M_S = 3.0, 0.4  # change of velocity within a time, which an offset of 0.1 m/s2 does not give; assumed


def refuse_glide(imu: Imu, track: Track, name: str) -> None:
    """Raises EchostepError for a track without a step of samples (n,) whose velocity changed."""
    if track.steps:
        return
    steps_s = np.diff(imu.t_s, prepend=imu.t_s[0])
    velocity = np.cumsum((imu.accel - np.median(imu.accel, axis=0)) * steps_s[:, None], axis=0)
    before = np.searchsorted(imu.t_s, imu.t_s - WITHIN_S)
    if float(np.abs(velocity - velocity[before]).max()) > MOVED_M_S:
        raise EchostepError(
            f"{name}: no step in {imu.t_s[-1] - imu.t_s[0]:.0f} s, yet the sensor moved, as on wheels, skates or in a car: {NEEDED}"
        )
