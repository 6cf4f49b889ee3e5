# SPDX-License-Identifier: MIT
"""Inside or outside: by the walls in sight."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echostep.arrays import Floats
from echostep.localization import Building, MapFilter, Start
from echostep.particles.limits import PROBABLE
from echostep.path import MeasuredSegment, PathSegment
from echostep.plan import Pose
from echostep.walls.echo_sources import Walls
from echostep.walls.floor import Indoors, indoors, walkable_floor
from walks import PLAN

# A room of 8 m by 6 m with a door of 1 m in its south wall.
ROOM = np.array([[0, 0, 3.5, 0], [4.5, 0, 8, 0], [8, 0, 8, 6], [8, 6, 0, 6], [0, 6, 0, 0]], float)
FRONT_M = 0.75  # from the outermost wall: nearer places count as indoors


def of(walls: Floats) -> Indoors:
    found = indoors(walkable_floor(walls))
    assert found is not None
    return found


def test_the_rooms_are_indoors_and_the_front_of_the_building_is_not() -> None:
    found = of(PLAN.levels[0].solid)
    rooms = np.array([room.at_m for room in PLAN.levels[0].rooms])
    assert found.holds(*rooms.T).all()
    ends = PLAN.levels[0].solid.reshape(-1, 2)
    (west, south), (east, north) = ends.min(0) - FRONT_M, ends.max(0) + FRONT_M
    along_x, along_y = np.linspace(west, east, 60), np.linspace(south, north, 60)
    for x, y in ((along_x, south), (along_x, north), (west, along_y), (east, along_y)):
        assert not found.holds(*np.broadcast_arrays(x, y)).any()
    assert not found.holds(np.array([-1e6, 1e6]), np.array([1e6, -1e6])).any()


def test_a_doorway_leads_outside() -> None:
    way = np.arange(3.0, -3.0, -0.25)
    held = of(ROOM).holds(np.full(len(way), 4.0), way)
    assert held[way > 0.5].all()
    assert not held[way < -1.0].any()


@pytest.mark.parametrize("walls", [np.zeros((0, 4)), np.array([[0.0, 0.0, 30.0, 0.0]])])
def test_without_enclosing_walls_nothing_is_outside(walls: Floats) -> None:
    assert indoors(walkable_floor(walls)) is None


def test_an_estimate_says_that_it_is_outside() -> None:
    """From the middle of that room 10 m through its door, a metre a second, without echoes."""
    tracked = MapFilter(Building(Walls(ROOM)), Start(Pose(4.0, 3.0, -0.5 * math.pi)), 0.0, np.random.default_rng(1))
    empty = np.empty(0), np.empty(0, np.int64), np.empty(0)
    moves = [PathSegment(float(k), k + 1.0, 1.0, 0.0, 0.0, 0.0, 0.02, 0.0, k) for k in range(10)]
    said = [tracked.update(MeasuredSegment(move, *empty)).outside for move in moves]
    assert max(said[:2]) < PROBABLE < min(said[5:])
