# SPDX-License-Identifier: MIT
"""A barometer whose first readings are its reset value: live, storeys are found by the readings after them."""

from __future__ import annotations

import numpy as np
import pytest

from board_runs import quiet_rows
from echostep.board.calibration import PRESSURE_PA
from echostep.height.height_filter import RelativeHeight
from echostep.height.levels import HeightChange
from echostep.localization import Start
from echostep.odometry.barometer_start import BarometerStart
from echostep.odometry.synchronizer import BAROMETER, MEASUREMENT, _measured
from echostep.path import PathSegment
from echostep.plan import Pose
from echostep.ports.chunks import BOARD, Chunk, portion_of
from echostep.tracker import Tracker
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.world.tower import LIFT_AT, STOREY_M
from localization.test_last_place import filter_of, standing
from walks import PLAN

RESET_M = 3_150.0  # the height of 68500 Pa


def starts(heights_m: list[float], restarts: list[int] | None = None) -> list[int]:
    """Of readings ten times a second, in two portions."""
    start, half = BarometerStart(), len(heights_m) // 2
    t_s, counted = np.asarray(0.1 * np.arange(len(heights_m)), np.float64), np.array(restarts or [0] * len(heights_m))
    parts = (slice(0, half), slice(half, None))
    return [k for part in parts for k in start.starts(t_s[part], np.array(heights_m)[part], counted[part]).tolist()]


@pytest.mark.parametrize("wrong", [1, 2, 5])
def test_heights_begin_anew_behind_a_reset_value(wrong: int) -> None:
    heights_m = [RESET_M] * wrong + [3.0 + 0.2 * (-1) ** k for k in range(20)]
    assert starts(heights_m) == [0] * wrong + [1] * 20


def test_noise_a_lift_and_a_slammed_door_later_are_no_beginning() -> None:
    rng = np.random.default_rng(1)
    assert not any(starts(rng.normal(0.0, 0.3, 100).tolist()))
    assert not any(starts([1.0 * k for k in range(30)]))  # 10 m/s from the first reading on
    assert not any(starts([0.0] * 12 + [-5.0] * 3 + [0.0] * 12))


def test_each_restart_of_the_board_may_bring_a_reset_value() -> None:
    heights_m = [0.0] * 10 + [RESET_M] + [0.0] * 10
    assert starts(heights_m, [0] * 10 + [1] * 11) == [0] * 10 + [1] + [2] * 10


def test_the_front_end_counts_it_and_says_so() -> None:
    board, tracker = PythonBoard(), Tracker(PLAN)
    rows = quiet_rows(3000)
    rows["pressure"][:300] = round(68_500.0 / PRESSURE_PA)
    chunks = [Chunk(BOARD, t_ns, sent) for t_ns, sent in board.advance(rows)]
    tracker.take(portion_of(chunks))
    assert tracker.front_end.counts.barometer_jumps == 1


def test_a_segment_has_the_heights_since_the_newest_beginning() -> None:
    readings = np.zeros(4, MEASUREMENT)
    readings["source"], readings["value_m"], readings["barometer_starts"] = (
        BAROMETER,
        [RESET_M, RESET_M, 3.0, 3.1],
        [0, 0, 1, 1],
    )
    segment = PathSegment(0.0, 0.5, 0.0, 0.0, 0.0, 0.0, 0.001, 0.0, 0)
    measured = _measured(segment, readings, 0.0)
    assert (measured.height_m.tolist(), measured.barometer_starts) == ([3.0, 3.1], 1)


def test_a_ride_is_seen_although_the_first_readings_were_wrong() -> None:
    """Two storeys up; the readings of the first half second were the reset value."""
    tracked = filter_of(Start(Pose(*LIFT_AT, 0.0, 0), 0.05))
    ride_m = np.linspace(0.0, 2.0 * STOREY_M, 14).tolist()
    for k, height_m in enumerate(
        [RESET_M, *[100.0] * 12, *(100.0 + np.array(ride_m)).tolist(), *[100.0 + 2.0 * STOREY_M] * 12]
    ):
        found = tracked.update(standing(0.5 * k, height_m, int(k > 0))).levels
    assert found[2] > 0.99


def test_the_height_above_the_start_without_a_plan() -> None:
    def climbed(begins_anew: bool) -> float:
        height = RelativeHeight(0.02)
        for k, measured_m in enumerate([RESET_M, *[0.0] * 20, *np.linspace(0.0, 3.5, 20).tolist(), *[3.5] * 20]):
            if begins_anew and k == 1:
                height.forget_lag()
            height.update(HeightChange(0.0, np.inf, measured_m, 0.15, measured_m, 0.5))
        return height.height_m

    assert climbed(True) == pytest.approx(3.5, abs=0.3)
    assert abs(climbed(False) - 3.5) > 100.0  # what a reset value did before
