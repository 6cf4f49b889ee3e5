# SPDX-License-Identifier: MIT
"""Rates of the legs of simulated people whose feet are placed, and their strides."""

from __future__ import annotations

import numpy as np

from echostep.arrays import Floats
from echostep.legs.kinematics import LegLengths
from echostep.legs.stride import Stride, StrideSettings
from echostep.legs.strides import StrideEstimator
from echostep_simulation.people.walker import Person, Waypoint, walk

STANDARD = LegLengths(0.43, 0.43)


def strides_of(t_s: Floats, thigh: Floats, shank: Floats, segments: LegLengths = STANDARD) -> list[Stride]:
    legs = StrideEstimator(StrideSettings(segments))
    return [*legs.feed(t_s, thigh, shank), *legs.finish()]


def walked(waypoints: list[Waypoint], seed: int = 1, hz: int = 100) -> tuple[Floats, Floats, Floats]:
    """Time, thigh, shank with bias and noise."""
    rng = np.random.default_rng([seed, 1])
    w = walk(waypoints, Person(), np.random.default_rng(seed))
    at = slice(None, None, 1000 // hz)
    bias = 0.02 * rng.standard_normal(2)
    noise = 0.01 * rng.standard_normal((2, len(w.t_s[at])))
    return w.t_s[at], w.thigh_rad_s[at] + bias[0] + noise[0], w.calf_rad_s[at] + bias[1] + noise[1]


def total_m(strides: list[Stride]) -> float:
    return sum(s.length_m for s in strides)
