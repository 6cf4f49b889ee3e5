# SPDX-License-Identifier: MIT
"""The direction of gravity in a sensor's axes while its wearer walks upright, and the tilt against it.

In: tenths of strides. Out: tilts. Owns the learnt direction. Over a stride the specific force of a trunk, a thigh or a standing foot averages to
gravity, so no mounting has to be known. Only long strides are used: a wearer on the knees makes none. Limits: a sensor that slips is followed within
about 20 strides; before the first upright strides there is no direction, hence no tilt.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from echostep.arrays import Floats
from echostep.foot.ins import GRAVITY_M_S2

Vector = tuple[float, float, float]

AROUND_GRAVITY_M_S2 = 2.0  # of a stride's mean force from gravity's size: more is a damaged or saturated sensor
LEAST_STRIDES = 3  # before a direction is known
MEMORY = 0.95  # weight of the earlier strides, per stride: a mean over 20


class StandingDirection:
    """Call `add_stride` with the mean forces of a stride; `tilt_rad` is the angle of another force from the learnt direction."""

    def __init__(self) -> None:
        self._sum = np.zeros(3)
        self._turns = np.zeros((3, 3))  # second moment of the rates
        self._strides = 0
        self._up: Vector = (math.nan, math.nan, math.nan)
        self._across: Vector = self._up

    def add_stride(self, forces: Sequence[Vector], rates: Sequence[Vector]) -> None:
        """Mean specific forces (k, 3) of tenths of a stride, and mean rates (m, 3) of the tenths that show how the sensor turns."""
        force = np.mean(np.array(forces), axis=0) if forces else np.full(3, math.nan)
        if not abs(float(np.linalg.norm(force)) - GRAVITY_M_S2) < AROUND_GRAVITY_M_S2:
            return
        turns = np.array(rates).reshape(-1, 3)
        self._sum = MEMORY * self._sum + force
        self._turns = MEMORY * self._turns + turns.T @ turns
        self._strides += 1
        if self._strides >= LEAST_STRIDES:
            self._up = _unit(self._sum)
            self._across = _unit(np.linalg.eigh(self._turns)[1][:, 2])

    @property
    def is_known(self) -> bool:
        """Whether a direction has been learnt."""
        return not math.isnan(self._up[0])

    def tilt_rad(self, force: Vector) -> float:
        """Angle from the standing direction to a force (3,); NaN while it is not known, or for a force that was not measured."""
        size = math.hypot(*force)
        cosine = _dot(self._up, force) / size if size > 0.0 else math.nan
        return math.acos(max(-1.0, min(cosine, 1.0))) if not math.isnan(cosine) else math.nan

    def sideways(self, force: Vector) -> float:
        """Share of a force along the axis about which the sensor turns most in walking: of a foot, from its right to its left."""
        size = math.hypot(*force)
        return abs(_dot(self._across, force)) / size if size > 0.0 else math.nan


def _unit(vector: Floats) -> Vector:
    x, y, z = (vector / np.linalg.norm(vector)).tolist()
    return x, y, z


def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
