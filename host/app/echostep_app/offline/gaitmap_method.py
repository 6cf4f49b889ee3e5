# SPDX-License-Identifier: MIT
"""The foot's navigation as a trajectory method of gaitmap (pip install gaitmap), beside its `RtsKalman`.

In: a sensor's samples as gaitmap has them: columns acc_x to gyr_z in m/s2 and deg/s, at one rate, any mounting. Out: positions, velocities and
orientations as its users expect them: before the first sample and after each, z up. Owns nothing. It looks at no sample before its time.
"""

from __future__ import annotations

from typing import Any, Self

import numpy as np
from gaitmap.base import BaseTrajectoryMethod  # type: ignore[import-not-found]
from pandas import DataFrame, Index
from scipy.spatial.transform import Rotation

from echostep.arrays import Floats
from echostep.foot import Foot
from echostep.offline.imu_checks import NEEDED, check_samples

UNLEVELLED = (1.0, 0.0, 0.0, 0.0)  # the attitude before the first rest


class FootNavigation(BaseTrajectoryMethod):  # type: ignore[misc]
    """`initial_orientation` (sensor to world, a quaternion x, y, z, w or a Rotation) gives the first heading; tilts are of the rests."""

    def __init__(self, initial_orientation: Any = None) -> None:
        self.initial_orientation = initial_orientation

    def estimate(self, data: DataFrame, *, sampling_rate_hz: float, **_strides: Any) -> Self:
        """Compute position_ (m), velocity_ (m/s) and orientation_ from n samples, n + 1 rows each. Raises ValueError without a rest, EchostepError
        for other units.
        """
        self.data, self.sampling_rate_hz = data, sampling_rate_hz
        t_s = np.arange(len(data)) / sampling_rate_hz
        accel, degrees = (data[[f"{name}_{axis}" for axis in "xyz"]].to_numpy() for name in ("acc", "gyr"))
        check_samples(t_s, accel, np.radians(degrees))
        rows = _navigated(t_s, accel, np.radians(degrees))
        turned = Rotation.from_quat(rows[:, 6:], scalar_first=True)
        about_z = self._first_turn(turned[0])
        self.orientation_object_ = about_z * turned
        for k, name in enumerate(("position", "velocity")):
            columns = [f"{name[:3]}_{axis}" for axis in "xyz"]
            values = about_z.apply(rows[:, 3 * k : 3 * k + 3])
            setattr(self, f"{name}_", DataFrame(values, Index(range(len(rows)), name="sample"), columns))
        return self

    def _first_turn(self, levelled: Rotation) -> Rotation:
        """The turn about the vertical that brings the first heading to the given one."""
        if (given := self.initial_orientation) is None:
            return Rotation.identity()
        given = given if isinstance(given, Rotation) else Rotation.from_quat(given)
        m = (given * levelled.inv()).as_matrix()
        return Rotation.from_euler("z", np.arctan2(m[1, 0] - m[0, 1], m[0, 0] + m[1, 1]))


def _navigated(t_s: Floats, accel: Floats, gyro: Floats) -> Floats:
    """Position, velocity, attitude w, x, y, z (n + 1, 10) in the walk frame; those before the first rest are as at it."""
    foot, rows = Foot(), np.zeros((len(t_s) + 1, 10))
    rows[0, 6:] = UNLEVELLED
    for k in range(len(t_s)):
        foot.feed(t_s[k : k + 1], accel[k : k + 1], gyro[k : k + 1])
        rows[k + 1] = *foot.nav.position, *foot.nav.velocity, *foot.nav.attitude
    known = np.flatnonzero((rows[:, 6:] != UNLEVELLED).any(axis=1))
    if not len(known):
        raise ValueError(f"the foot was never still in these samples: {NEEDED}")
    rows[: known[0]] = rows[known[0]]
    return rows
