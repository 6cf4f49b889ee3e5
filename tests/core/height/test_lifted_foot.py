# SPDX-License-Identifier: MIT
"""A foot that is held above the floor rises without the belt; in a lift that the plan lacks the pressure leaves the level."""

from __future__ import annotations

import math
from collections.abc import Callable
from statistics import median

import numpy as np
import pytest

from echostep.height.height_filter import OFF_SD_M, Rises
from echostep.height.levels import HeightChange

STRIDE_S, NOISE_M, NONE, STAIRS, LADDER = 1.0, 0.15, [0.0] * 30, [0.34] * 30, [0.6] * 30


def evidence(felt_m: list[float], belt_m: list[float], sd_m: float = NOISE_M) -> list[float]:
    """The greatest in each of 20 draws of a walk whose strides rise by so much, by the foot and in truth."""
    found = []
    for rng in map(np.random.default_rng, range(20)):
        foot, most, heights = Rises(), 0.0, np.cumsum(belt_m) + NOISE_M * rng.standard_normal(len(belt_m))
        for felt, height in zip(felt_m, heights.tolist(), strict=True):
            foot.update(HeightChange(felt, 0.01, height, sd_m, height, STRIDE_S), 1.0, 0, 0.0)
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


def off_m(height_m: Callable[[float], float], way_m: float = 0.0, seconds: float = 200.0) -> float:
    """How far the pressure is off the level after heights (m, at a time), standing or with steps of this length."""
    rises, rng, span_s = Rises(), np.random.default_rng(8), STRIDE_S if way_m else 0.5
    for t_s in np.arange(0.0, seconds, span_s).tolist():
        height = height_m(t_s) + NOISE_M * rng.standard_normal()
        rises.update(HeightChange(0.0, 0.01, height, NOISE_M, height, span_s), way_m, 0, 0.0)
    return rises.off_m


@pytest.mark.parametrize(("storey_m", "speed_m_s"), [(3.5, 0.2), (2.6, 1.0), (-3.5, 1.0), (14.0, 1.6)])
def test_in_a_lift_that_the_plan_lacks_the_pressure_leaves_the_level(storey_m: float, speed_m_s: float) -> None:
    way_s = [0.0, 5.0, 5.0 + abs(storey_m) / speed_m_s]
    assert off_m(lambda t: float(np.interp(t, way_s, [0.0, 0.0, storey_m]))) == pytest.approx(storey_m, abs=0.7)
    way_s += [100.0 + t for t in way_s[1:]]
    assert abs(off_m(lambda t: float(np.interp(t, way_s, [0.0, 0.0, storey_m, storey_m, 0.0])))) < 2.0 * OFF_SD_M


@pytest.mark.parametrize("way_m", [0.0, 1.2])
@pytest.mark.parametrize("pa", [-50.0, -35.0, -20.0, 5.0, 12.0])  # doors of a stairwell under pressure; a chair; a gust
def test_doors_chairs_gusts_and_weather_leave_no_level(pa: float, way_m: float) -> None:
    assert abs(off_m(lambda t: -pa / 12.0 * (20.0 < t < 60.0), way_m, 50.0)) < 3.0 * OFF_SD_M
    assert abs(off_m(lambda t: 1e-3 * t, way_m, 3600.0)) < OFF_SD_M
