# SPDX-License-Identifier: MIT
"""Floors of simulated walks through buildings of several storeys."""

from __future__ import annotations

import numpy as np
import pytest

from echostep.localization import Estimate, TrackStatus
from echostep.plan import load_plan
from echostep_simulation.world.tower import tower
from echostep_studies.floors.storeys import judge, through
from echostep_studies.frame.recordings import DATA
from needs_data import needs_data
from walls.test_level_sheet import tracked


@pytest.mark.long
@needs_data("maps/westport-house.json")
def test_all_seven_floors_of_a_real_plan_are_walked() -> None:
    """By stairs and lift; the walk is simulated."""
    plan = load_plan(DATA / "maps" / "westport-house.json")
    assert len(plan.levels) == 7
    way = through(plan, 3)
    scenario, estimates = tracked(plan, way, 3)
    found = judge(plan, scenario.truth, estimates, "", 1)
    assert found.floors == 7
    assert found.floor_right == 1.0
    assert found.mean_m < 0.5


def test_floors_are_judged_by_what_is_nearest() -> None:
    plan = tower(3)
    truth = np.array([[0.0, 5.0, 1.5, 0.0, 0.0], [10.0, 5.0, 1.5, 0.0, 0.0], [20.0, 5.0, 1.5, 0.0, 7.0]])

    def at(t_s: float, level: int) -> Estimate:
        return Estimate(t_s, 5.0, 1.5, 0.01, 0.0, 0.01, 0.0, 0.1, 1, TrackStatus.TRACKING, level)

    found = judge(plan, truth, [at(1.0, 0), at(2.0, 1), at(3.0, 1), at(5.0, 0), at(12.6, 0), at(20.0, 2)], "", 1)
    assert found.floor_right == pytest.approx(4 / 6), "at 12.6 s he is 1.82 m high: both floors are as good"
    assert found.strict_right == pytest.approx(3 / 6)
    assert found.longest_wrong_s == pytest.approx(1.0)
    assert found.floors == 3
