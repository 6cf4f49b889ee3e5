# SPDX-License-Identifier: MIT
"""A foot that is held above the floor rises without the belt."""

from __future__ import annotations

import math
from statistics import median

import numpy as np
import pytest

from echostep.height.height_filter import LiftedFoot
from echostep.height.levels import HeightChange

STRIDE_S, NOISE_M, NONE, STAIRS, LADDER = 1.0, 0.15, [0.0] * 30, [0.34] * 30, [0.6] * 30


def evidence(felt_m: list[float], belt_m: list[float], sd_m: float = NOISE_M) -> list[float]:
    """The greatest in each of 20 draws of a walk whose strides rise by so much, by the foot and in truth."""
    found = []
    for rng in map(np.random.default_rng, range(20)):
        foot, most, heights = LiftedFoot(), 0.0, np.cumsum(belt_m) + NOISE_M * rng.standard_normal(len(belt_m))
        for felt, height in zip(felt_m, heights.tolist(), strict=True):
            foot.update(HeightChange(felt, 0.01, height, sd_m, height, STRIDE_S), 0)
            most = max(most, foot.evidence)
        found.append(most)
    return found


@pytest.mark.parametrize("rises", [STAIRS, LADDER, [*NONE, 0.5, *NONE]], ids=["stairs", "ladder", "chair"])
def test_who_climbs_rises_with_his_foot(rises: list[float]) -> None:
    assert max(evidence(rises, rises)) < 3.0
    assert max(evidence([-m for m in rises], [-m for m in rises])) < 3.0


@pytest.mark.parametrize("storeys", [-12.0, 12.0])
def test_a_lift_and_a_door_in_a_stairwell_under_pressure_lift_no_foot(storeys: float) -> None:
    assert max(evidence([0.0] * 60, [*NONE, storeys, *NONE[1:]])) == 0.0


def test_a_runner_whose_steps_drift_downwards_is_on_the_floor() -> None:
    assert max(evidence([-0.1] * 30, NONE)) == 0.0


def test_a_foot_that_others_hold_is_lifted_where_pressure_is_measured() -> None:
    held = [0.0, 0.7, 0.1, 0.2, *NONE]
    assert median(evidence(held, [0.0] * len(held))) > 4.0
    assert max(evidence(held, [0.0] * len(held), math.inf)) == 0.0
