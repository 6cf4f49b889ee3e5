# SPDX-License-Identifier: MIT
"""One house for every importer: three storeys of 12 m by 8 m with a hall, an office and stairs, and the one right result of all its files.

A door in the partition (x 5) of each storey, an entrance in the south of the lowest one. Files may be moved, turned, and have their lists in another
order.
"""

from __future__ import annotations

import math
import random
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from echostep.plan import Level, Plan
from echostep_app.plan.georeference import earth_of
from echostep_app.plan.importers.summary import doors_in_gaps
from echostep_app.plan.places.gaps import door_gaps

T = TypeVar("T")
Line = tuple[float, float, float, float]
Point = tuple[float, float]
LON, LAT, EAST, NORTH = 8.0, 53.0, 1 / 67_114.0, 1 / 111_315.0  # degrees a metre there
WIDE, HIGH, PARTITION, STOREYS = 12.0, 8.0, 5.0, (0, 1, 2)
INNER, ENTRANCE, STAIRS = (5.0, 3.0, 5.0, 3.9), (7.0, 0.0, 7.9, 0.0), (9.0, 5.0, 11.0, 7.5)
ROOMS = {"Office": (0.0, 0.0, 5.0, 8.0), "Hall": (5.0, 0.0, 12.0, 8.0)}
OFF_M = 0.12  # of a door's end, and of the size, beside half a wall's thickness


@dataclass(frozen=True)
class Move:
    """Turned by `turn` (rad), then moved by x, y; `seed`: of the order of lists, None for their own."""

    x: float = 0.0
    y: float = 0.0
    turn: float = 0.0
    seed: int | None = None

    def __call__(self, x: float, y: float) -> Point:
        """Where a point of the house lies."""
        c, s = math.cos(self.turn), math.sin(self.turn)
        return c * x - s * y + self.x, s * x + c * y + self.y

    def degrees(self, x: float, y: float) -> list[float]:
        """Its longitude and latitude."""
        east, north = self(x, y)
        return [LON + east * EAST, LAT + north * NORTH]

    def ordered(self, rows: list[T]) -> list[T]:
        """A list in this move's order."""
        return rows if self.seed is None else random.Random(self.seed).sample(rows, len(rows))

    def back(self, lines: Any) -> Any:
        """Points or lines turned back, as lines (n, 4) or points (n, 2)."""
        c, s = math.cos(self.turn), math.sin(self.turn)
        points = np.asarray(lines, dtype=float)
        return (points.reshape(-1, 2) @ np.array([[c, -s], [s, c]])).reshape(points.shape)


MOVES = (Move(1, 0), Move(500, 300), Move(turn=0.3), Move(0.123456, 0.98765, seed=4), Move(seed=1), Move(seed=2))
FAR = (Move(3e5, 6e6), Move(3e5, 6e6, 0.3, seed=5))


def doors_on(storey: int) -> list[Line]:
    """The doors of a storey."""
    return [INNER, ENTRANCE] if storey == 0 else [INNER]


def axes(storey: int) -> Iterator[Line]:
    """The walls of a storey as lines, with gaps at the doors."""
    for a, b, c, d in (
        (0, 0, WIDE, 0),
        (WIDE, 0, WIDE, HIGH),
        (0, HIGH, WIDE, HIGH),
        (0, 0, 0, HIGH),
        (PARTITION, 0, PARTITION, HIGH),
    ):
        doors = [door for door in doors_on(storey) if (a == c == door[0] == door[2]) or (b == d == door[1] == door[3])]
        ends = [(a, b), *(end for door in doors for end in (door[:2], door[2:])), (c, d)]
        yield from ((*one, *other) for one, other in zip(ends[::2], ends[1::2], strict=True))


def boxes(storey: int, thick: float = 0.2) -> list[Line]:
    """The walls as rectangles about their axes; those from west to east reach around the corners, the others between them."""
    h, rows = thick / 2, []
    for a, b, c, d in axes(storey):
        if b == d:
            rows.append((a - h * (a == 0), b - h, c + h * (c == WIDE), d + h))
        else:
            rows.append((a - h, b + h * (b == 0), c + h, d - h * (d == HIGH)))
    return rows


def middle(line: Line) -> Point:
    """The middle of a line."""
    return (line[0] + line[2]) / 2, (line[1] + line[3]) / 2


@dataclass(frozen=True)
class Right:
    """What a format tells: thickness of walls, names, number of levels, stairs, the place on the Earth."""

    thick: float = 0.0
    names: bool = True
    levels: int = 3
    stairs: bool = True
    earth: bool = False

    def differences(self, plan: Plan, move: Move) -> Iterator[str]:
        """What differs between a plan and the house."""
        if len(plan.levels) != self.levels:
            yield f"{len(plan.levels)} levels"
        for k, level in enumerate(plan.levels[: self.levels]):
            yield from (f"level {k}: {text}" for text in self._of_level(level, k, move))
        if self.stairs and [(c.kind, c.levels) for c in plan.connectors] != [("stairs", tuple(range(self.levels)))]:
            yield f"connectors {plan.connectors}"
        if self.earth and (transform := earth_of(plan)) is not None:
            off = transform.degrees(plan.levels[0].walls.reshape(-1, 2)) - move.degrees(0, 0)
            if (near := np.abs(off / (EAST, NORTH)).max(axis=1).min()) > self.thick + 0.5:
                yield f"{near:.1f} m beside its place on the Earth"

    def _of_level(self, level: Level, k: int, move: Move) -> Iterator[str]:
        walls, half = move.back(level.walls).reshape(-1, 2), self.thick / 2
        low, size = walls.min(axis=0) + half, np.ptp(walls, axis=0)
        if np.abs(size - (WIDE + self.thick, HIGH + self.thick)).max() > OFF_M:
            yield f"{size[0]:.2f} x {size[1]:.2f} m"
        lines = move.back(np.array([door.line for door in level.doors or door_gaps(level)]).reshape(-1, 4)) - np.tile(
            low, 2
        )
        both = np.stack((lines, np.roll(lines, 2, axis=1)))
        off = np.array([np.abs(both - door).max(axis=2).min(axis=0) for door in doors_on(k)])
        if not lines.size or max(off.min(axis=1).max(), off.min(axis=0).max()) > OFF_M + half:
            yield f"doors {np.round(lines, 2).tolist()}"
        if level.doors and not len(doors_on(k)) == len(lines) == doors_in_gaps(level):
            yield f"{len(lines)} doors, {doors_in_gaps(level)} in gaps"
        homes = {room.name: move.back(room.at_m) - low for room in level.rooms}
        inside = {
            name: (homes[name] - box[:2] > 0).all() and (homes[name] < box[2:]).all()
            for name, box in ROOMS.items()
            if name in homes
        }
        if self.names and not (len(level.rooms) == len(homes) == len(inside) == 2 and all(inside.values())):
            yield f"rooms {homes}"
