# SPDX-License-Identifier: MIT
"""Openings that a ranger saw through while it was carried past; ends of drawn walls where they meet others."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echostep.arrays import Floats
from echostep_app.mapping.walls.evidence import CELL_M, CROSSED, DOOR_M, Cells, add_sights, cell_counts
from echostep_app.mapping.walls.lines import Lines
from echostep_app.mapping.walls.segments import ANY, Run, find_runs, segments_of

WALL = Lines(np.array([math.pi / 2]), np.array([1.0]), np.zeros(1), np.zeros(1), np.full(1, 8.0), np.ones(1, np.bool_))
AWAY_M, ROOM_M = 1.0, 4.5  # of the wall from the path; of what stands behind it


def walls_beside(
    seen_at: list[float], beyond_m: float = ROOM_M - AWAY_M, off_axis_deg: float = 0.0
) -> list[tuple[float, float]]:
    """Where a wall of 8 m stands (low, high) by a ranger that passed it a metre away, and at some places detected something behind it."""
    along = np.arange(0.0, 8.0, 0.08)
    ranges: Floats = np.full(len(along), AWAY_M)
    for place in seen_at:
        ranges[np.abs(along - place).argmin()] += beyond_m
    # along of a line is counted against x here: (-sin, cos) of its normal
    poses = np.column_stack(
        [-along, np.zeros(len(along)), np.full(len(along), math.pi / 2 + math.radians(off_axis_deg))]
    )
    all_of = np.ones(len(along), np.bool_)
    cells = cell_counts(WALL, poses, ranges, all_of, all_of)
    add_sights(WALL, poses, ranges, all_of, cells)
    return [(run.low_m, run.high_m) for run in find_runs(cells, ANY)]


def test_an_opening_that_was_seen_is_a_doors_width_about_the_sight() -> None:
    (low, a), (b, high) = walls_beside([4.0])
    assert [low, high] == pytest.approx([0.0, 8.0], abs=0.1)
    assert b - a == pytest.approx(DOOR_M, abs=0.15)
    assert 0.5 * (a + b) == pytest.approx(4.0, abs=0.1)


def test_two_sights_of_one_door_are_one_and_two_doors_are_two() -> None:
    assert len(walls_beside([3.96, 4.04])) == 2
    assert len(walls_beside([2.0, 6.0])) == 3


@pytest.mark.parametrize(
    ("seen", "beyond_m", "off_axis_deg"),
    [
        pytest.param([4.0], 0.5, 0.0, id="the other face of a thick wall"),
        pytest.param([4.0], 3.5, 20.0, id="aside of the axis"),
        pytest.param([0.2], 3.5, 0.0, id="beyond the end of the wall"),
        pytest.param([], 0.0, 0.0, id="nothing"),
    ],
)
def test_what_is_no_sight_leaves_the_wall_whole(seen: list[float], beyond_m: float, off_axis_deg: float) -> None:
    ((low, high),) = walls_beside(seen, beyond_m, off_axis_deg)
    assert high - low > 7.6


def test_cells_that_a_path_crossed_are_left_alone() -> None:
    """The opening that was walked through has its own width."""
    poses = np.array([[-4.0, 0.0, math.pi / 2]])
    one = np.ones(1, np.bool_)
    cells = cell_counts(WALL, poses, np.array([ROOM_M]), one, one)
    cells.heard[0] = 1.0
    middle = int((4.0 - cells.first_m[0]) / 0.05)
    cells.passed[0, middle] = CROSSED
    before = cells.heard.copy()
    add_sights(WALL, poses, np.array([ROOM_M]), one, cells)
    assert np.array_equal(cells.heard, before)


CELLS = 500


def _segments(lines: list[tuple[float, float]], runs: list[Run]) -> list[list[float]]:
    """Ends (n, 4) of runs on lines (normal in radians, distance in metres) that no ping passed."""
    normal, rho = np.array(lines).T
    none, count = np.zeros(len(lines)), len(lines)
    cells = Cells(
        np.zeros((count, CELLS)),
        np.zeros((count, CELLS)),
        none - CELLS * CELL_M / 2.0,
        np.full(count, CELLS),
        np.zeros(0, np.intp),
    )
    found = segments_of(Lines(normal, rho, none, none, none, none == 0.0), runs, cells)
    ends: list[list[float]] = found.tolist()
    return ends


@pytest.mark.parametrize("apart_m", [-0.03, 0.03])
def test_a_wall_ends_at_the_one_that_stands_there(apart_m: float) -> None:
    """Not at another on nearly the same line, that begins 1.5 m farther along it, on either side."""
    across, along = math.pi / 2.0, 0.0
    runs = [Run(0, 1.0, 4.0, 50.0), Run(1, -2.0, 5.0, 50.0), Run(2, -9.0, -1.5, 50.0)]
    (wall, *_) = _segments([(along, 0.0), (across, 0.9), (across, 0.9 + apart_m)], runs)
    assert min(wall[1], wall[3]) == pytest.approx(0.9)


def test_a_wall_alone_is_extended_to_the_line_of_the_next() -> None:
    """A corner that neither wall was heard up to."""
    runs = [Run(0, 1.0, 4.0, 50.0), Run(1, -6.0, -1.0, 50.0)]
    (wall, other) = _segments([(0.0, 0.0), (math.pi / 2.0, 0.2)], runs)
    assert min(wall[1], wall[3]) == pytest.approx(0.2)
    assert min(abs(other[0]), abs(other[2])) == pytest.approx(0.0, abs=1e-9)
