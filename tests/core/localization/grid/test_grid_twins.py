# SPDX-License-Identifier: MIT
"""The kernels of the grid against a dictionary of states, and what a move must keep."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echostep.echoes.likelihood import EchoSettings, echo_model
from echostep.echoes.range_table import OUTSIDE_ENTRY, SECTORS, UNKNOWN
from echostep.localization import Building
from echostep.localization.grid.cells import EAST_WALL, NORTH_WALL
from echostep.localization.grid.kernels import GridStates, halved, shift_and_weigh, spread
from echostep.walls.echo_sources import Walls
from echostep.walls.floor import CELL_M
from naive.grid import NaiveGrid, State

WALLS = np.array([[0, 0, 6, 0], [6, 0, 6, 5], [6, 5, 0, 5], [0, 5, 0, 0], [3, 0, 3, 3.3], [4, 3.6, 6, 3.6]], float)
ROOM = Building(Walls(WALLS), None)
CELLS = ROOM.cells(echo_model(EchoSettings()))
LAYERS, THROUGH = 8, 0.01
EVEN = np.ones(OUTSIDE_ENTRY + 1, np.float32)


def some_states(seed: int, count: int = 60) -> GridStates:
    """Distinct states on the floor, in order of their layers, with offsets."""
    rng = np.random.default_rng(seed)
    cells = CELLS.cell_of(ROOM.floor.x_m, ROOM.floor.y_m)
    chosen = np.sort(rng.choice(LAYERS * len(cells), count, replace=False))
    layer, cell = chosen // len(cells), cells[chosen % len(cells)]
    first = np.searchsorted(layer, np.arange(LAYERS + 1))
    weight = rng.uniform(0.1, 1.0, count).astype(np.float32)
    offset = CELL_M * (rng.random((LAYERS, 2)) - 0.5)
    return GridStates(cell.astype(np.int32), weight, first.astype(np.int64), offset)


def weights(states: GridStates) -> dict[State, float]:
    """The weight of each state by layer, line and column; that of equal states added up."""
    found: dict[State, float] = {}
    for layer in range(len(states.offset_m)):
        for k in range(states.first[layer], states.first[layer + 1]):
            line, column = divmod(int(states.cell[k]), CELLS.columns)
            found[layer, line, column] = found.get((layer, line, column), 0.0) + float(states.weight[k])
    return found


def twin_of(states: GridStates) -> NaiveGrid:
    offset = {layer: (float(x), float(y)) for layer, (x, y) in enumerate(states.offset_m)}
    return NaiveGrid(CELLS.x0_m, CELLS.y0_m, CELL_M, WALLS, len(offset), weights(states), offset)


def empty_scratch() -> np.ndarray[tuple[int], np.dtype[np.float32]]:
    return np.zeros(len(CELLS.row), np.float32)


@pytest.mark.parametrize("seed", range(6))
def test_moves_are_those_of_the_dictionary(seed: int) -> None:
    states, rng = some_states(seed), np.random.default_rng([seed, 1])
    twin = twin_of(states)
    for dx, dy in rng.uniform(-0.6, 0.6, (4, 2)).tolist():
        kept, top, before, after = shift_and_weigh(states, dx, dy, EVEN, 0.0, 0.0, THROUGH, CELLS)
        twin.move(dx, dy, THROUGH)
        assert before == pytest.approx(sum(twin.weight.values()))
        assert after == pytest.approx(before)
        assert kept == len(states.cell)
        assert top == pytest.approx(max(twin.weight.values()))
        assert weights(states) == pytest.approx(twin.weight)


def test_moves_to_and_fro_end_where_they_began() -> None:
    """Whatever the way, no place is smeared."""
    states = some_states(1)
    before, offset = weights(states), states.offset_m.copy()
    way = np.random.default_rng(2).uniform(-0.05, 0.05, (40, 2))
    for dx, dy in [*way.tolist(), *(-way).tolist()]:
        shift_and_weigh(states, dx, dy, EVEN, 0.0, 0.0, 1.0, CELLS)
    assert weights(states).keys() == before.keys()
    assert states.offset_m == pytest.approx(offset)


@pytest.mark.parametrize("axis_deg", [0.0, 100.0, 271.0])
def test_a_ping_weighs_each_state_by_the_entry_of_its_cell_and_axis(axis_deg: float) -> None:
    states = some_states(3)
    factor = np.random.default_rng(4).uniform(0.1, 1.0, OUTSIDE_ENTRY + 1).astype(np.float32)
    expected = {}
    for (layer, line, column), weight in weights(states).items():
        turn_deg = 360.0 * (layer + 0.5) / LAYERS
        sector = int((turn_deg + axis_deg) % 360.0 / (360.0 / SECTORS))
        row = CELLS.row[line * CELLS.columns + column]
        assert row != UNKNOWN
        expected[layer, line, column] = weight * factor[CELLS.expected[sector, row]]
    before_all = sum(weights(states).values())
    _, _, before, after = shift_and_weigh(states, 0.0, 0.0, factor, math.radians(axis_deg), 0.0, THROUGH, CELLS)
    assert weights(states) == pytest.approx(expected, rel=1e-5)
    assert [before, after] == pytest.approx([before_all, sum(expected.values())], rel=1e-5)


def test_what_is_improbable_is_dropped() -> None:
    states = some_states(5)
    heavy = {state: weight for state, weight in weights(states).items() if weight >= 0.5}
    kept, *_ = shift_and_weigh(states, 0.0, 0.0, EVEN, 0.0, 0.5, THROUGH, CELLS)
    assert weights(states._replace(cell=states.cell[:kept], weight=states.weight[:kept])) == pytest.approx(heavy)


@pytest.mark.parametrize("seed", range(4))
def test_spreading_beside_is_that_of_the_dictionary(seed: int) -> None:
    states = some_states(seed)
    twin, scratch = twin_of(states), empty_scratch()
    twin.spread_beside(0.1)
    assert weights(spread(states, 0.1, 0.0, 0.0, scratch, CELLS)) == pytest.approx(twin.weight, rel=1e-4)
    assert not scratch.any()


@pytest.mark.parametrize("seed", range(4))
def test_spreading_over_rotations_is_that_of_the_dictionary(seed: int) -> None:
    states = some_states(seed)
    twin = twin_of(states)
    twin.spread_turned(0.2)
    assert weights(spread(states, 0.0, 0.2, 0.0, empty_scratch(), CELLS)) == pytest.approx(twin.weight, rel=1e-4)


def test_spreading_keeps_all_weight_on_its_side_of_a_wall() -> None:
    """Of the room west of the wall at x = 3, whose door is beyond y = 3.3; the mass in the doorway may pass."""
    states = some_states(6)
    for _ in range(20):
        states = spread(states, 0.15, 0.2, 0.0, empty_scratch(), CELLS)
    assert float(states.weight.sum()) == pytest.approx(float(some_states(6).weight.sum()), rel=1e-4)
    line, column = np.divmod(states.cell, CELLS.columns)
    x, y = CELLS.x0_m + (column + 0.5) * CELL_M, CELLS.y0_m + (line + 0.5) * CELL_M
    assert (x > 0.0).all()
    assert (x < 6.0).all()
    assert (y > 0.0).all()
    assert (y < 5.0).all()


def test_halved_layers_hold_each_state_twice() -> None:
    states = some_states(7)
    finer = halved(states)
    assert len(finer.offset_m) == 2 * LAYERS
    for side in range(2):
        assert {
            (layer // 2, *place): w for (layer, *place), w in weights(finer).items() if layer % 2 == side
        } == weights(states)


def test_barriers_are_the_walls_between_middles() -> None:
    grid = twin_of(some_states(0))
    for cell in np.random.default_rng(8).choice(len(CELLS.row), 200):
        line, column = divmod(int(cell), CELLS.columns)
        if not (0 < line < len(CELLS.row) // CELLS.columns - 1 and 0 < column < CELLS.columns - 1):
            continue
        assert bool(CELLS.barrier[cell] & EAST_WALL) != grid.is_open(line, column, line, column + 1)
        assert bool(CELLS.barrier[cell] & NORTH_WALL) != grid.is_open(line, column, line + 1, column)
