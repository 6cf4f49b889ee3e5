# SPDX-License-Identifier: MIT
"""The steps of the grid filter on plain arrays: shift and weigh, spread, halve the sectors, change levels.

In: `GridCells`, states, a piece of a move, the likelihoods of a ping by entry of the table. Out: states. Owns nothing.

A state is a cell and a sector of the rotation walk -> map; the states of one sector are one layer. All places of a layer are off the middles of their
cells by the same remainder, so a move shifts a layer by whole cells and smears nothing.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats, Int32s, Ints
from echostep.echoes.range_table import OUTSIDE_ENTRY, SECTORS, UNKNOWN
from echostep.jit import inline_part, kernel, lean_kernel, lean_part
from echostep.localization.grid.cells import CLOSED, EAST_WALL, NORTH_WALL, GridCells
from echostep.walls.floor import CELL_M

Weights = np.ndarray[tuple[int], np.dtype[np.float32]]


class GridStates(NamedTuple):
    """n states in layers: layer h holds the states first[h] to first[h + 1]; its rotation is the middle of sector h of `layers`.

    `cell` (n,), `weight` (n,), `offset_m` (layers, 2): of each place of the layer from the middle of its cell.
    """

    cell: Int32s
    weight: Weights
    first: Ints
    offset_m: Floats


class LevelFactors(NamedTuple):
    """Of a change of height, by connector + 1 (row 0: outside of all) and level: factor of the weight, and cells to the east on the sheet.

    The greatest factor is 1, and was `log_top` as a logarithm.
    """

    weight: np.ndarray[tuple[int, int], np.dtype[np.float32]]
    east: np.ndarray[tuple[int, int], np.dtype[np.int32]]
    log_top: float


@inline_part
def rotation_of(layer: int, layers: int) -> float:
    """Rotation walk -> map in the middle of a layer."""
    return 2.0 * math.pi * (layer + 0.5) / layers


@lean_kernel
def shift_and_weigh(
    states: GridStates, dx: float, dy: float, factor: Weights, axis_rad: float, least: float, wall: float, cells: GridCells
) -> tuple[int, float, float, float]:  # fmt: skip
    """Move all states by (dx, dy) of the walk frame, and multiply each by the factor of its entry for a ping along `axis_rad`.

    `factor` (OUTSIDE_ENTRY + 1,): by entry. A state that goes through a wall keeps `wall` of its weight; one that had less than `least` is dropped.
    Returns the number of states, their greatest weight, and the sums of weights before and after the factors.
    """
    cell, weight, first, offset = states
    layers, kept, top, before, after = len(offset), 0, 0.0, 0.0, 0.0
    for h in range(layers):
        turn = rotation_of(h, layers)
        east, north = _shift(turn, dx, dy, offset[h])
        heard = cells.expected[_sector(turn + axis_rad)]
        begin = first[h]
        first[h] = kept
        for k in range(begin, first[h + 1]):
            at, w = cell[k], weight[k]
            if w < least:
                continue
            if east != 0 or north != 0:
                at, crossed = _moved(at, east, north, cells)
                if at < 0:
                    continue
                if crossed:
                    w *= wall
            row = cells.row[at]
            before += w
            w *= factor[OUTSIDE_ENTRY if row == UNKNOWN else int(heard[row])]
            cell[kept], weight[kept] = at, w
            kept += 1
            after += w
            top = max(top, w)
    first[layers] = kept
    return kept, top, before, after


@inline_part
def _sector(angle_rad: float) -> int:
    turns = angle_rad * (0.5 / math.pi)
    return min(int((turns - math.floor(turns)) * SECTORS), SECTORS - 1)


@lean_part
def _shift(turn: float, dx: float, dy: float, offset: Floats) -> tuple[int, int]:
    """Whole cells (east, north) by which a layer moves; the rest goes to its offset (2,)."""
    c, s = math.cos(turn), math.sin(turn)
    x, y = offset[0] + c * dx - s * dy, offset[1] + s * dx + c * dy
    east, north = math.floor(x / CELL_M + 0.5), math.floor(y / CELL_M + 0.5)
    offset[0], offset[1] = x - east * CELL_M, y - north * CELL_M
    return int(east), int(north)


@lean_part
def _moved(cell: int, east: int, north: int, cells: GridCells) -> tuple[int, bool]:
    """The cell `east` and `north` cells away, -1 where no trunk can be, and whether a wall is on the way: by turns to the east and to the north."""
    crossed = False
    while east != 0 or north != 0:
        if abs(east) >= abs(north):
            step = 1 if east > 0 else -1
            blocked = cells.barrier[cell if step > 0 else cell - 1] & EAST_WALL
            cell, east = cell + step, east - step
        else:
            step = 1 if north > 0 else -1
            blocked = cells.barrier[cell if step > 0 else cell - cells.columns] & NORTH_WALL
            cell, north = cell + step * cells.columns, north - step
        crossed = crossed or blocked != 0
        if cells.barrier[cell] & CLOSED:
            return -1, crossed
    return cell, crossed


@kernel
def spread(
    states: GridStates, beside: float, turned: float, least: float, scratch: Weights, cells: GridCells
) -> GridStates:
    """Diffuse: each of the four neighbours of a state gets the share `beside` where no wall is between, each neighbouring layer `turned`.

    `scratch` (cells,): zeros, and zeros afterwards.
    """
    layers, count = len(states.offset_m), 0
    room = 2 * len(states.cell) + 64
    new_cell, new_weight = np.empty(room, np.int32), np.empty(room, np.float32)
    new_first = np.zeros(layers + 1, np.int64)
    touched = np.empty(len(scratch), np.int32)
    for h in range(layers):
        found = _spread_into(h, states, beside, turned, scratch, touched, cells)
        if count + found > len(new_cell):
            new_cell = np.concatenate((new_cell, np.empty(len(new_cell) + found, np.int32)))
            new_weight = np.concatenate((new_weight, np.empty(len(new_weight) + found, np.float32)))
        count = _collect(found, least, scratch, touched, new_cell, new_weight, count)
        new_first[h + 1] = count
    return GridStates(new_cell[:count].copy(), new_weight[:count].copy(), new_first, states.offset_m)


@lean_part
def _spread_into(
    h: int, states: GridStates, beside: float, turned: float, scratch: Weights, touched: Int32s, cells: GridCells
) -> int:
    """Write to `scratch` the weights that layer h gets, and to `touched` their cells; returns the number of cells."""
    cell, weight, first, offset = states
    layers, found = len(offset), 0
    for away in (-1, 0, 1):
        g = (h + away) % layers
        share = turned if away != 0 else 1.0 - 2.0 * turned
        if share == 0.0:
            continue
        east = math.floor((offset[g, 0] - offset[h, 0]) / CELL_M + 0.5)
        north = math.floor((offset[g, 1] - offset[h, 1]) / CELL_M + 0.5)
        for k in range(first[g], first[g + 1]):
            at = cell[k]
            if east != 0 or north != 0:
                there, crossed = _moved(at, east, north, cells)
                at = at if crossed or there < 0 else there
            found = _deposit(at, share * weight[k], beside, scratch, touched, found, cells)
    return found


@lean_part
def _collect(
    found: int, least: float, scratch: Weights, touched: Int32s, cell: Int32s, weight: Weights, count: int
) -> int:
    """Append the touched cells with at least this weight, and clear them; returns the new count."""
    for i in range(found):
        w = scratch[touched[i]]
        scratch[touched[i]] = 0.0
        if w >= least:
            cell[count], weight[count] = touched[i], w
            count += 1
    return count


@lean_part
def _deposit(at: int, w: float, beside: float, scratch: Weights, touched: Int32s, found: int, cells: GridCells) -> int:
    """Add a weight to a cell and its open neighbours; returns the number of touched cells."""
    rest = w
    if beside > 0.0:
        columns, barrier = cells.columns, cells.barrier
        for way in range(4):
            step = (1, -1, columns, -columns)[way]
            wall = barrier[at if step > 0 else at + step] & (EAST_WALL if way < 2 else NORTH_WALL)
            if wall == 0 and barrier[at + step] & CLOSED == 0:
                found = _add(at + step, beside * w, scratch, touched, found)
                rest -= beside * w
    return _add(at, rest, scratch, touched, found)


@inline_part
def _add(at: int, w: float, scratch: Weights, touched: Int32s, found: int) -> int:
    if scratch[at] == 0.0:
        touched[found] = at
        found += 1
    scratch[at] += w
    return found


@lean_kernel
def weigh_levels(states: GridStates, factor: LevelFactors, cells: GridCells) -> tuple[float, float]:
    """Multiply each state by the factor of its level and connector, and move it to the level it has reached.

    Returns the greatest weight, and the mean factor of the weights.
    """
    cell, weight = states.cell, states.weight
    top, before, after = 0.0, 0.0, 0.0
    for k in range(len(cell)):
        at = cell[k]
        before += weight[k]
        level, connector = cells.level[at % cells.columns], cells.connector[at]
        weight[k] *= factor.weight[connector + 1, level]
        cell[k] = at + factor.east[connector + 1, level]
        after += weight[k]
        top = max(top, weight[k])
    return top, after / before


@kernel
def halved(states: GridStates) -> GridStates:
    """Twice as many layers: each state becomes two with its weight, a quarter of a sector to either side."""
    cell, weight, first, offset = states
    layers, n = len(offset), len(cell)
    new_cell, new_weight = np.empty(2 * n, np.int32), np.empty(2 * n, np.float32)
    new_first, new_offset = np.zeros(2 * layers + 1, np.int64), np.empty((2 * layers, 2))
    count = 0
    for h in range(layers):
        for half in range(2):
            new_offset[2 * h + half] = offset[h]
            for k in range(first[h], first[h + 1]):
                new_cell[count], new_weight[count] = cell[k], weight[k]
                count += 1
            new_first[2 * h + half + 1] = count
    return GridStates(new_cell, new_weight, new_first, new_offset)
