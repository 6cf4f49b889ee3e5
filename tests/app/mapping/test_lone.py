# SPDX-License-Identifier: MIT
"""A short piece of wall in a hall, heard once: doubtful where it is across the path, nothing along it, for there echoes of people lie."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echostep.arrays import Floats, Ints
from echostep.path import MeasuredSegment, PathSegment
from echostep_app.mapping.mapper import map_walk

CORRIDOR_M, HALL_M = 40, 30
PIECE_M = 2  # of the way, along which a piece is heard in the middle of the hall
TURN_SD_RAD = math.radians(0.3)  # of each metre, as stated


def through_a_hall(course_rad: float, piece_m: float = PIECE_M, *, beside: bool = False) -> list[MeasuredSegment]:
    """A way at 1 m/s along a corridor 2 m wide, then through a hall with this course; to the left a piece of wall parallel to the corridor.

    `beside`: parallel to the way instead, as the echoes of a passer-by lie.
    """
    slope = 0.0 if beside else math.sin(course_rad)
    found: list[MeasuredSegment] = []
    for k in range(CORRIDOR_M + HALL_M):
        in_hall = k >= CORRIDOR_M
        heading = course_rad if in_hall else 0.0
        after = course_rad if k >= CORRIDOR_M - 1 else 0.0
        t_s = k + np.arange(0.0, 1.0, 0.04)
        ranger: Ints = np.arange(len(t_s)) % 2
        way_m = t_s - CORRIDOR_M - HALL_M // 2
        piece = (ranger == 0) & (way_m >= 0.0) & (way_m < piece_m)
        range_m = np.where(piece, 1.5 - way_m * slope, math.nan) if in_hall else np.ones(len(t_s))
        segment = PathSegment(k, k + 1.0, math.cos(heading), math.sin(heading), heading, after, 0.02, TURN_SD_RAD, k)
        found.append(MeasuredSegment(segment, t_s, ranger, range_m))
    return found


@pytest.mark.parametrize(("course_deg", "drawn_m"), [(25.0, PIECE_M * math.cos(math.radians(25.0))), (0.0, 0.0)])
def test_a_piece_across_the_path_is_a_wall(course_deg: float, drawn_m: float) -> None:
    """With a direction of the building and another one than the path's; along the path it may be a person."""
    assert drawn_in_hall_m(through_a_hall(math.radians(course_deg))) == pytest.approx(drawn_m, abs=0.4)


@pytest.mark.parametrize(("piece_m", "drawn_m"), [(5.0, 0.0), (8.0, 8.0)])
def test_a_piece_along_an_askew_path_is_a_wall_if_it_is_longer_than_people_go_along(
    piece_m: float, drawn_m: float
) -> None:
    """At 30 degrees to the building; people who go along do so for 6 m at most."""
    assert drawn_in_hall_m(through_a_hall(math.radians(30.0), piece_m, beside=True)) == pytest.approx(drawn_m, abs=0.5)


def drawn_in_hall_m(walk: list[MeasuredSegment]) -> float:
    """Length of what is drawn in the hall, doubtful or not."""
    return in_hall_m(map_walk(walk).drawing.all_walls)


def in_hall_m(walls: Floats) -> float:
    """Length of walls (n, 4 or more) 5 m or more from the hall's door."""
    in_hall = walls[walls[:, [0, 2]].min(1) > CORRIDOR_M + 5.0]
    return float(np.hypot(*(in_hall[:, 2:4] - in_hall[:, :2]).T).sum())


def test_what_no_second_pass_confirmed_is_doubtful() -> None:
    """A piece of 2 m across the path, which one passage heard."""
    drawing = map_walk(through_a_hall(math.radians(25.0))).drawing
    assert in_hall_m(drawing.walls) == 0.0
    assert in_hall_m(drawing.doubtful) > 1.0
