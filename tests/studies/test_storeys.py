# SPDX-License-Identifier: MIT
"""Floors of simulated walks through buildings of several storeys; floors by pressure alone, the weather, the board's barometer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from echostep.localization import Estimate, TrackStatus
from echostep.plan import load_plan
from echostep_simulation.devices.board_sensors import Scp1000Model
from echostep_simulation.world.tower import tower
from echostep_studies.floors.storeys import judge, through
from echostep_studies.floors.study import longest_s, one_run
from echostep_studies.frame.recordings import DATA
from echostep_studies.simulation.air_pressure import Weather, pressures
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


@pytest.mark.slow
def test_the_floors_of_a_simulated_run_are_right() -> None:
    """Twenty minutes in each scene; that the start of this walk is resolved, too."""
    rows = {row.name: row for row in one_run(900)}
    assert min(row.floor_right for row in rows.values()) > 0.96
    assert rows["floors/both"].floor_right > 0.99
    assert rows["floors/both"].longest_wrong_s < 10.0


def test_the_judge_counts() -> None:
    t = np.arange(6.0)
    assert longest_s(t, np.array([False, True, True, False, True, False])) == 2.0
    assert longest_s(t, np.zeros(6, bool)) == 0.0
    assert longest_s(t, np.array([False, False, False, False, True, True])) == 1.0


def test_the_boards_barometer_is_carried_up() -> None:
    rng = np.random.default_rng(3)
    height = np.linspace(0.0, 10.0, 4000)
    counts, _ = Scp1000Model(rng, "high-resolution").counts(height, 20.0, 4000)
    assert (counts[:500].mean() - counts[-500:].mean()) / 4.0 == pytest.approx(8.75 * 12.0, rel=0.02)
    told, _ = Scp1000Model(rng, "high-resolution").counts(height, 20.0, 4000, np.full(4000, 99_000.0))
    assert told.mean() / 4.0 == pytest.approx(99_000.0, abs=0.2)
    assert told.std() / 4.0 == pytest.approx(1.5, rel=0.1)


def test_weather_does_what_it_says() -> None:
    rng = np.random.default_rng(4)
    t = np.arange(0.0, 3600.0, 0.1)
    calm = Weather(wander_pa=0.0, doors_s=np.inf, fan_s=np.inf)
    air = pressures(t, np.zeros(len(t)), np.zeros(len(t), bool), calm, rng)
    assert air[-1] - air[0] == pytest.approx(100.0, abs=0.1)
    doors = pressures(t, np.zeros(len(t)), np.zeros(len(t), bool), Weather(0.0, 0.0, 60.0, fan_s=np.inf), rng)
    away = np.abs(doors - np.median(doors))
    assert 20.0 < away.max() < 120.0
    assert np.median(away) < 0.5
    still = replace(calm, trend_pa_h=0.0)
    column = pressures(np.array([0.0, 400.0]), np.array([0.0, 100.0]), np.zeros(2, bool), still, rng)
    assert np.log(column[0] / column[1]) * 287.053 * (21.0 + 273.15) / 9.80665 == pytest.approx(100.0, abs=0.01)
