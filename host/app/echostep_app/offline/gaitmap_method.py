# SPDX-License-Identifier: MIT
"""The foot's navigation as a trajectory method of gaitmap (pip install gaitmap), beside its `RtsKalman`.

In: a sensor's samples as gaitmap has them: columns acc_x to gyr_z in m/s2 and deg/s, at one rate, any mounting. Out: positions, velocities and
orientations as its users expect them: before the first sample and after each, z up. Owns nothing. It looks at no sample before its time.
"""

from __future__ import annotations

from typing import Any, Self

import numpy as np
from gaitmap.base import BaseTrajectoryMethod
from pandas import DataFrame, Index
from scipy.spatial.transform import Rotation

from echostep.arrays import Floats
from echostep.foot import Foot
from echostep.offline.imu_checks import NEEDED
from echostep.ports.imu_samples import check_samples

UNLEVELLED = (1.0, 0.0, 0.0, 0.0)  # the attitude before the first rest


class FootNavigation(BaseTrajectoryMethod):  # type: ignore[misc]
    """`initial_orientation` (sensor to world, a quaternion x, y, z, w or a Rotation) gives the first heading; tilts are of the rests."""

    def __init__(self, initial_orientation: Any = None) -> None:
        self.initial_orientation = initial_orientation

    def estimate(self, data: DataFrame, *, sampling_rate_hz: float, **_strides: Any) -> Self:
        """Compute position_ (m), velocity_ (m/s), orientation_, n + 1 rows each. Raises ValueError without a rest, EchostepError for other units."""
        self.data, self.sampling_rate_hz = data, sampling_rate_hz
        t_s, accel = np.arange(len(data)) / sampling_rate_hz, data[["acc_x", "acc_y", "acc_z"]].to_numpy()
        gyro = np.radians(data[["gyr_x", "gyr_y", "gyr_z"]].to_numpy())
        check_samples(t_s, accel, gyro)
        rows = _navigated(t_s, accel, gyro)
        turned = Rotation.from_quat(rows[:, 6:], scalar_first=True)
        about_z = self._first_turn(turned[0])
        self.orientation_object_ = about_z * turned
        index, position, velocity = Index(range(len(rows)), name="sample"), rows[:, :3], rows[:, 3:6]
        self.position_ = DataFrame(about_z.apply(position), index, ["pos_x", "pos_y", "pos_z"])
        self.velocity_ = DataFrame(about_z.apply(velocity), index, ["vel_x", "vel_y", "vel_z"])
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
