# SPDX-License-Identifier: MIT
"""Strides of simulated people by measured joint curves."""

from __future__ import annotations

import numpy as np
import pytest

from echostep.legs.kinematics import LegLengths
from echostep.legs.stride import Flag
from echostep_studies.simulation.joint_gait import FAST, NATURAL, SLOW, WalkingPace, draw_person, simulate_gait
from legs.leg_walks import strides_of, total_m


@pytest.mark.slow
@pytest.mark.parametrize(
    ("manner", "seconds", "mean", "flag"),
    [(SLOW, 6.0, 0.04, Flag.SLOW), (NATURAL, 4.0, 0.04, Flag.NONE), (FAST, 3.0, 0.04, Flag.FAST)],
)
def test_people_by_their_joint_curves(manner: WalkingPace, seconds: float, mean: float, flag: Flag) -> None:
    errors, flags = [], []
    for seed in range(16):
        rng = np.random.default_rng(seed)
        person = draw_person(rng)
        gait = simulate_gait(person, manner, seconds, rng)
        strides = strides_of(
            gait.t_s, gait.thigh_rad_s, -gait.shank_rad_s, LegLengths(person.leg.thigh_m, person.leg.shank_m)
        )
        errors.append(total_m(strides) / float(gait.way_m[-1]) - 1.0)
        flags += [s.flags for s in strides if s.length_m > 0.5 and Flag.EDGE not in s.flags]
    assert np.abs(errors).mean() < mean
    assert sum(flag in f if flag else not f for f in flags) > 0.5 * len(flags)
