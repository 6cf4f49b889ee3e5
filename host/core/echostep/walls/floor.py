# SPDX-License-Identifier: MIT
"""The walkable floor of a plan, on its sheet of levels: where an unknown start may be.

In: walls (n, 4) on the sheet. Out: `Floor`: cells not too near to any wall, inside the building; `Indoors`. Owns nothing.

A place is inside if walls are in sight in at least half of all directions: a yard that is open on one side is, a lawn before a facade is not.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from echostep.arrays import Bools, Floats, Octets
from echostep.jit import inline_part, kernel

# Assumed, not measured.
CELL_M = 0.25  # side of a cell
BODY_M = 0.25  # half a person's width
DIRECTIONS = 32  # in which walls are looked for
INSIDE = 0.5  # least share of the directions that meet a wall, for a cell of the floor
ENCLOSED = 0.75  # the same for a cell that is certainly indoors: a doorway to the outside has half
SIGHT_M = 40.0  # how far walls are looked for
EDGE_M = 2.0  # of the grid around the walls
HALL_M = 3.0  # distance from a wall up to which floor counts where no wall encloses any
MOST_CELLS = 40_000_000
WALL_CELLS = 2  # cells about an indoor one that count as indoors: those under the walls, half a metre


@dataclass(frozen=True, slots=True)
class Floor:
    """Free cells inside the building: their centres `x_m`, `y_m` (n,) on the sheet; empty for a plan without walls.

    `enclosed` (n,): walls are in sight in nearly all directions; a cell before the front of the building has them in half of the directions.
    """

    x_m: Floats
    y_m: Floats
    enclosed: Bools

    @property
    def area_m2(self) -> float:
        """Area of all cells."""
        return len(self.x_m) * CELL_M**2

    def draw(self, count: int, rng: np.random.Generator) -> tuple[Floats, Floats]:
        """Places (count,), evenly over the floor; one in each cell before any cell has two."""
        order = rng.permutation(len(self.x_m))
        cell = order[np.arange(count) % len(order)]
        within = CELL_M * (rng.random((2, count)) - 0.5)
        return self.x_m[cell] + within[0], self.y_m[cell] + within[1]


NO_FLOOR = Floor(np.zeros(0), np.zeros(0), np.zeros(0, np.bool_))


def walkable_floor(walls: Floats) -> Floor:
    """The floor inside these walls (n, 4); if they enclose none, the floor within HALL_M of them."""
    ends = walls.reshape(-1, 2)
    if not len(ends):
        return NO_FLOOR
    low = ends.min(0) - EDGE_M
    columns, rows = (int(n) for n in np.ceil((ends.max(0) + EDGE_M - low) / CELL_M))
    if columns * rows > MOST_CELLS:
        return NO_FLOOR
    cells = (walls - np.tile(low, 2)) / CELL_M
    blocked = np.zeros((rows, columns), np.bool_)
    mark_near_walls(cells, BODY_M / CELL_M, blocked)
    in_sight = _walls_in_sight(blocked.view(np.uint8), int(SIGHT_M / CELL_M))
    inside = in_sight >= INSIDE * DIRECTIONS
    if not inside.any():
        mark_near_walls(cells, HALL_M / CELL_M, inside)
        inside &= ~blocked
    places = (low[k] + (np.arange(count) + 0.5) * CELL_M for k, count in enumerate((columns, rows)))
    x_m, y_m = (v[inside] for v in np.meshgrid(*places, copy=False))
    return Floor(x_m, y_m, in_sight[inside] >= ENCLOSED * DIRECTIONS)


@kernel
def _walls_in_sight(blocked: Octets, sight: int) -> Octets:
    """For each cell, in how many directions a blocked cell is met within `sight` cells; 0 for blocked cells.

    A whole row looks one step further at a time, for bytes beside one another are worked on at once.
    """
    rows, columns = blocked.shape
    in_sight = np.zeros((rows, columns), np.uint8)
    has_walls = np.array([blocked[r].any() for r in range(rows)])
    for k in range(DIRECTIONS):
        dx, dy = math.cos(2.0 * math.pi * k / DIRECTIONS), math.sin(2.0 * math.pi * k / DIRECTIONS)
        for r in range(rows):
            met = np.zeros(columns, np.uint8)
            for step in range(1, sight):
                y, aside = int(r + 0.5 + step * dy), math.floor(0.5 + step * dx)
                if not (0 <= y < rows and abs(aside) < columns):
                    break
                if has_walls[y]:
                    _meet(met[max(-aside, 0) :], blocked[y, max(aside, 0) :])
            for c in range(columns):
                in_sight[r, c] += met[c]
    # Columns to the nearest one with a wall: others are between two levels of the sheet
    near = np.zeros(columns, np.uint8)
    for c in range(columns):
        if blocked[:, c].any():
            near[max(c - sight // 4 + 1, 0) : c + sight // 4] = 1
    for r in range(rows):
        for c in range(columns):
            in_sight[r, c] *= near[c] * (1 - blocked[r, c])
    return in_sight


@inline_part
def _meet(met: Octets, seen: Octets) -> None:
    """Mark what is blocked in `seen`, as far as both reach."""
    for c in range(min(len(met), len(seen))):
        met[c] |= seen[c]


@kernel
def mark_near_walls(walls: Floats, reach: float, blocked: Bools) -> None:
    """Mark the cells whose centre is nearer than `reach` to a wall (n, 4); all lengths in cells."""
    rows, columns = blocked.shape
    for k in range(len(walls)):
        ax, ay, bx, by = walls[k]
        dx, dy = bx - ax, by - ay
        square = dx * dx + dy * dy
        for r in range(max(int(min(ay, by) - reach - 1), 0), min(int(max(ay, by) + reach + 2), rows)):
            for c in range(max(int(min(ax, bx) - reach - 1), 0), min(int(max(ax, bx) + reach + 2), columns)):
                px, py = c + 0.5 - ax, r + 0.5 - ay
                s = min(max((px * dx + py * dy) / square, 0.0), 1.0) if square > 0.0 else 0.0
                if (px - s * dx) ** 2 + (py - s * dy) ** 2 < reach * reach:
                    blocked[r, c] = True


@dataclass(frozen=True, slots=True)
class Indoors:
    """A grid of cells from (`west_m`, `south_m`) on, with a margin of cells that are outside: `inside` (rows, columns)."""

    west_m: float
    south_m: float
    inside: Bools

    def holds(self, x_m: Floats, y_m: Floats) -> Bools:
        """Whether places (n,) are indoors."""
        rows, columns = self.inside.shape
        column = np.clip(np.floor((x_m - self.west_m) / CELL_M), 0, columns - 1).astype(np.int64)
        row = np.clip(np.floor((y_m - self.south_m) / CELL_M), 0, rows - 1).astype(np.int64)
        held: Bools = self.inside[row, column]
        return held


def indoors(floor: Floor) -> Indoors | None:
    """The cells of a floor that walls enclose, and those under adjacent walls; None if walls enclose none."""
    return inside_grid(floor.x_m, floor.y_m, floor.enclosed) if floor.enclosed.any() else None


def inside_grid(x_m: Floats, y_m: Floats, are_inside: Bools | bool = True) -> Indoors:
    """The grid of the cells with these centres (n,), n > 0: which of them are inside, all by default, and the cells under adjacent walls."""
    margin = WALL_CELLS + 1
    west_m, south_m = (float(v.min()) - (margin + 0.5) * CELL_M for v in (x_m, y_m))
    column, row = (((v - low) / CELL_M).astype(np.int64) for v, low in ((x_m, west_m), (y_m, south_m)))
    inside = np.zeros((int(row.max()) + margin + 1, int(column.max()) + margin + 1), np.bool_)
    inside[row, column] = are_inside
    for axis in WALL_CELLS * (0, 1):  # the margin holds what goes round
        inside = inside | np.roll(inside, 1, axis) | np.roll(inside, -1, axis)
    return Indoors(west_m, south_m, inside)
