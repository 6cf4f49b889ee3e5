# SPDX-License-Identifier: MIT
"""Poses drawn from a start, and the grid of an unknown one."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echostep.echoes.likelihood import EchoSettings, echo_model
from echostep.echoes.unplanned import RangeMemory
from echostep.localization import Building, FilterSettings, Start
from echostep.localization.grid.search import MOST_STATES, Search
from echostep.localization.grid.start import NEAR_SHARE, grid_of
from echostep.localization.map_filter import NEAR_SD_M
from echostep.localization.particles.start import STATED, WIDE_SHARE
from echostep.localization.settings import UNPLANNED_DOOR
from echostep.particles.arrays import Move, PingBatch
from echostep.plan import ANY_LEVEL, Pose
from echostep.walls.echo_sources import Walls
from echostep.walls.level_sheet import lay_out_levels, level_of
from echostep_simulation.world.tower import LIFT_AT, tower

STOREYS = 3
CORRIDOR = np.array([(0.0, 0.0, 20.0, 0.0), (20.0, 0.0, 20.0, 2.0), (20.0, 2.0, 0.0, 2.0), (0.0, 2.0, 0.0, 0.0)])
TOWER = lay_out_levels(tower(STOREYS))


def grid_in(building: Building, start: Start) -> Search:
    """The grid of a start in a building; the walk frame's heading is 0.5 rad there."""
    model = echo_model(EchoSettings())
    unplanned = RangeMemory(building.background(model), EchoSettings())
    return grid_of(
        start,
        0.5,
        building.cells(model),
        unplanned,
        building.floor,
        building.sheet,
        FilterSettings(),
        np.random.default_rng(1),
    )


def test_near_a_place_of_unknown_level_is_above_and_below_it_too() -> None:
    """Most of the weight is there, as much on each level, and faces anywhere."""
    near = Pose(*LIFT_AT, 0.0, ANY_LEVEL)
    poses = grid_in(Building(TOWER.walls, TOWER.sheet), Start(near=near, sd_m=NEAR_SD_M, heading_sd_rad=math.pi)).states
    weight = poses.weight
    level = level_of(poses.x_m, TOWER.sheet)
    is_near = np.hypot(poses.x_m - level * TOWER.sheet.pitch_m - near.x_m, poses.y_m - near.y_m) < 3.0 * NEAR_SD_M
    assert np.bincount(level[is_near], weight[is_near]) == pytest.approx(NEAR_SHARE / STOREYS, rel=0.2)
    assert abs((weight * np.exp(1j * poses.turn_rad))[is_near].sum()) < 0.05


def test_a_wide_start_leaves_no_state_of_the_floor_without_weight() -> None:
    """Nearly all of it by its normal distributions, the rest even: what is stated is never all that is possible."""
    pose, sd_m, sd_rad = Pose(10.0, 1.0, 1.2), 4.0, 0.6
    grid = grid_in(Building(Walls(CORRIDOR)), Start(pose, sd_m, sd_rad))
    poses, weight = grid.states, grid.states.weight
    assert weight.min() >= 0.9 * (1.0 - STATED) / len(weight)
    along, turn = weight @ poses.x_m, math.atan2(weight @ np.sin(poses.turn_rad), weight @ np.cos(poses.turn_rad))
    assert along == pytest.approx(pose.x_m, abs=0.1)
    assert turn == pytest.approx(pose.heading_rad - 0.5, abs=0.1)
    assert math.sqrt(weight @ (poses.x_m - along) ** 2) == pytest.approx(sd_m, rel=0.1)
    far = grid_in(Building(Walls(CORRIDOR)), Start(Pose(1e6, 0.0, 0.0), sd_m)).states.log_weight
    assert np.ptp(far) == 0.0  # far from the floor: anywhere on it


def test_in_a_large_building_too_a_wide_start_is_not_all_that_is_possible() -> None:
    """It has more states than a search keeps; only one was left of them."""
    walls = Walls(np.array([(0, 0, 40, 0), (40, 0, 40, 40), (40, 40, 0, 40), (0, 40, 0, 0)], float))
    grid = grid_in(Building(walls), Start(Pose(10.0, 1.0, 1.2), 4.0, 0.6))
    assert len(grid) > MOST_STATES
    none = np.zeros(0)
    no_pings = PingBatch(none, none, none, none, none.astype(np.int64), none, none, none, none, none)
    grid.advance(Move(0.1, 0.0, 0.0, 0.0), no_pings, echo_model(EchoSettings()))
    assert len(grid) > 0.9 * MOST_STATES


def test_a_start_behind_a_wall_weighs_as_a_way_through_it() -> None:
    walls = Walls(CORRIDOR)
    floor = Building(walls).floor
    pose = Pose(10.0, 1.5, 0.0)
    _, y, _, log_weight = Start(pose).draw(20_000, floor, None, np.random.default_rng(1), walls.index)
    is_behind = y > 2.0
    assert 50 < is_behind.sum() < 20_000 * WIDE_SHARE
    assert log_weight[is_behind].max() < log_weight[~is_behind].max() + UNPLANNED_DOOR + 1e-9
    assert np.exp(log_weight).mean() == pytest.approx(1.0, abs=0.02)
