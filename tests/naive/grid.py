# SPDX-License-Identifier: MIT
"""A grid filter as a dictionary of states: slow, obviously right."""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import dataclass, field

from echostep.arrays import Floats
from naive import walls as naive_walls

State = tuple[int, int, int]  # layer, line, column


@dataclass
class NaiveGrid:
    """`weight` of each state; `offset` of each layer (m). `walls` (n, 4); cells of `cell_m` from (`x0_m`, `y0_m`) on."""

    x0_m: float
    y0_m: float
    cell_m: float
    walls: Floats
    layers: int
    weight: dict[State, float]
    offset: dict[int, tuple[float, float]] = field(default_factory=dict)

    def middle(self, line: int, column: int) -> tuple[float, float]:
        """Place of the middle of a cell."""
        return self.x0_m + (column + 0.5) * self.cell_m, self.y0_m + (line + 0.5) * self.cell_m

    def is_open(self, line: int, column: int, line_to: int, column_to: int) -> bool:
        """Whether no wall stands between the middles of two cells."""
        return not naive_walls.crosses(*self.middle(line, column), *self.middle(line_to, column_to), self.walls)

    def move(self, dx_m: float, dy_m: float, through_wall: float) -> None:
        """Move every state by its layer's rotation, cell by cell, first along the axis on which more is left."""
        moved: dict[State, float] = {}
        for layer in range(self.layers):
            turn = 2.0 * math.pi * (layer + 0.5) / self.layers
            was_x, was_y = self.offset.get(layer, (0.0, 0.0))
            x = was_x + dx_m * math.cos(turn) - dy_m * math.sin(turn)
            y = was_y + dx_m * math.sin(turn) + dy_m * math.cos(turn)
            east, north = math.floor(x / self.cell_m + 0.5), math.floor(y / self.cell_m + 0.5)
            self.offset[layer] = x - east * self.cell_m, y - north * self.cell_m
            for (of, line, column), weight in self.weight.items():
                if of == layer:
                    to, passes = self._way(line, column, east, north)
                    moved[layer, *to] = weight * (1.0 if passes else through_wall)
        self.weight = moved

    def _way(self, line: int, column: int, east: int, north: int) -> tuple[tuple[int, int], bool]:
        passes = True
        while east or north:
            to = line, column
            if abs(east) >= abs(north):
                to = line, column + (1 if east > 0 else -1)
                east -= 1 if east > 0 else -1
            else:
                to = line + (1 if north > 0 else -1), column
                north -= 1 if north > 0 else -1
            passes = passes and self.is_open(line, column, *to)
            line, column = to
        return (line, column), passes

    def spread_beside(self, share: float) -> None:
        """Each state gives this share to each of its four neighbours, where no wall is between."""
        spread: dict[State, float] = defaultdict(float)
        for (layer, line, column), weight in self.weight.items():
            for to in ((line, column + 1), (line, column - 1), (line + 1, column), (line - 1, column)):
                gets = share * weight if self.is_open(line, column, *to) else 0.0
                spread[layer, *to] += gets
                spread[layer, line, column] -= gets
            spread[layer, line, column] += weight
        self.weight = {state: weight for state, weight in spread.items() if weight > 0.0}

    def spread_turned(self, share: float) -> None:
        """Each state gives this share to the same place in both neighbouring layers: its cell, or the nearest if no wall is between."""
        spread: dict[State, float] = defaultdict(float)
        for (layer, line, column), weight in self.weight.items():
            spread[layer, line, column] += (1.0 - 2.0 * share) * weight
            for other in ((layer + 1) % self.layers, (layer - 1) % self.layers):
                (x, y), (other_x, other_y) = self.offset.get(layer, (0.0, 0.0)), self.offset.get(other, (0.0, 0.0))
                east, north = (math.floor(d / self.cell_m + 0.5) for d in (x - other_x, y - other_y))
                to, passes = self._way(line, column, east, north)
                spread[other, *(to if passes else (line, column))] += share * weight
        self.weight = dict(spread)
