# SPDX-License-Identifier: MIT
"""Routes through a building: the shortest walk through doors, stairs and lifts; the way out takes no lift.

In: a plan, start and destination. Out: a `Route`: one polyline per level. Owns the grids of a plan's levels. Doors are gaps in the walls.
The route is found on a grid [Dijkstra 1959] and then straightened, so that it bends only at corners.
"""

from __future__ import annotations

import heapq
import math
import threading
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from echostep.arrays import Bools, Floats, Ints
from echostep.errors import EchostepError
from echostep.jit import kernel, part
from echostep.plan import Plan
from echostep.walls.near_walls import mark_near_walls
from echostep_app.plan.cropping import extent, is_clear
from echostep_app.plan.places.exits import exits_of
from echostep_app.plan.polyline import way_m

# All assumed:
CELL_M = 0.15  # side of a grid cell
BODY_M = 0.25  # half a person's width: shortest distance of a route from a wall
MARGIN_M = 1.5  # of the grid around the walls
MOVED_M = 2.0  # start and destination are moved at most this far to the nearest free cell
MOST_TRIED = 60  # nearest free cells that are tried to find one without a wall in between
MOST_CELLS = 60_000_000  # on all levels together
CLIMB = 3.0  # cost of a metre of height by stairs, in metres of level walk
LIFT_M = 20.0  # cost of waiting for a lift, in metres of level walk
TIGHT = 20.0  # cost of a metre of a connector within BODY_M of a wall, in metres of level walk: the way goes round a wall between two flights
EXIT: Literal["exit"] = "exit"  # the destination that is the nearest exit


@dataclass(frozen=True, slots=True)
class RoutePlace:
    """A position in the map on a level (an index into the plan's levels)."""

    x_m: float
    y_m: float
    level: int = 0


Goal = RoutePlace | Literal["exit"]


@dataclass(frozen=True, slots=True)
class Stretch:
    """The part of a route on one level: `line_m` (k, 2). `by`: name or kind of the connector to the next stretch, empty at the destination."""

    level: int
    line_m: Floats
    by: str = ""


@dataclass(frozen=True, slots=True)
class Route:
    """A route from start to destination."""

    stretches: tuple[Stretch, ...]

    @property
    def length_m(self) -> float:
        """Length on all levels, without the heights of stairs and lifts."""
        return sum(way_m(stretch.line_m) for stretch in self.stretches)


class Routes:
    """Finds routes through one plan, one at a time, in any thread; the grids are laid for the first one."""

    def __init__(self, plan: Plan) -> None:
        self._plan = plan
        self._lock = threading.Lock()
        self._exits: tuple[RoutePlace, ...] | None = None  # None: no grids yet

    def _lay(self) -> tuple[RoutePlace, ...]:
        """Lay the grids; returns the exits; raises EchostepError for a plan that needs more than `MOST_CELLS`."""
        plan = self._plan
        x0, y0, x1, y1 = extent(np.concatenate([level.solid for level in plan.levels]))
        self._low = np.array([x0, y0]) - MARGIN_M
        columns, rows = (int(n) for n in np.ceil((np.array([x1, y1]) + MARGIN_M - self._low) / CELL_M))
        if columns * rows * len(plan.levels) > MOST_CELLS:
            raise EchostepError(
                f"plan {plan.name}: too large to find routes in: {columns} x {rows} cells on {len(plan.levels)} levels"
            )
        self._blocked = np.zeros((len(plan.levels), rows, columns), np.bool_)
        self._tight = np.zeros_like(self._blocked)
        for k, level in enumerate(plan.levels):
            walls_cells = (np.asarray(level.solid, np.float64) - np.tile(self._low, 2)) / CELL_M
            mark_near_walls(walls_cells, BODY_M / CELL_M, self._blocked[k])
            for corners in level.obstacles:
                self._blocked[k][self._inside(corners)] = True
        self._lay_connectors(plan)
        self._height = np.array([level.height_m for level in plan.levels])
        self._lift = np.array([c.kind == "lift" for c in plan.connectors], np.bool_)
        return tuple(RoutePlace(pose.x_m, pose.y_m, pose.level) for pose in exits_of(plan))

    def _lay_connectors(self, plan: Plan) -> None:
        """The connector of each cell (-1: none), and which connector serves which level; cells of connectors are free, or tight where a wall is near.

        Some stairs are drawn so narrow that no cell of them is clear of walls.
        """
        self._connector = np.full(self._blocked.shape, -1, np.int64)
        self._serves = np.zeros((len(plan.connectors), len(plan.levels)), np.bool_)
        for c, connector in enumerate(plan.connectors):
            cells = self._inside(connector.outline_m)
            for level_index in connector.levels:
                self._serves[c, level_index] = True
                self._connector[level_index][cells] = c
                self._tight[level_index][cells] |= self._blocked[level_index][cells]
                self._blocked[level_index][cells] = False

    def way(self, start: RoutePlace, end: Goal) -> Route:
        """The cheapest route; raises EchostepError when a position is outside the plan, or without a route."""
        with self._lock:
            if self._exits is None:
                self._exits = self._lay()
            return self._way(start, (end,) if isinstance(end, RoutePlace) else self._exits, is_out=end == EXIT)

    def _way(self, start: RoutePlace, ends: Sequence[RoutePlace], *, is_out: bool) -> Route:
        """The cheapest route to one of some places; on the way out without lifts."""
        if not ends:
            raise EchostepError("the plan shows no exit")
        a = self._cell(start, "the start")
        cells = {self._cell(end, "the destination"): end for end in ends}
        serves = self._serves & ~(is_out & self._lift[:, None])
        trail = _search(
            self._blocked, self._tight, self._connector, serves, self._height, self._lift, a, np.array(list(cells))
        )
        if not len(trail):
            to = "an exit" if is_out else f"({ends[0].x_m:.1f}, {ends[0].y_m:.1f})"
            raise EchostepError(
                f"there is no route from ({start.x_m:.1f}, {start.y_m:.1f}) to {to}: is a door missing in the plan?"
            )
        level, row, column = trail[-1].tolist()
        return Route(tuple(self._stretches(trail, start, cells[level, row, column])))

    def _stretches(self, trail: Ints, start: RoutePlace, end: RoutePlace) -> list[Stretch]:
        """Cut a trail of cells (k, 3) into one polyline per level, straightened; its ends are start and end unless a wall is in between."""
        stretches = []
        cuts = [0, *(np.flatnonzero(np.diff(trail[:, 0])) + 1).tolist(), len(trail)]
        for first, beyond in zip(cuts[:-1], cuts[1:], strict=True):
            part, level = trail[first:beyond], int(trail[first, 0])
            if len(part) == 1 and first > 0 and beyond < len(trail):
                continue  # a level that the connector only passes
            corners = _straighten(self._blocked[level] | self._tight[level], part[:, 1:])
            line = self._low + (part[corners][:, [2, 1]] + 0.5) * CELL_M
            by = ""
            if beyond < len(trail):
                connector = self._plan.connectors[int(self._connector[level, part[-1, 1], part[-1, 2]])]
                by = connector.name or connector.kind
            stretches.append(Stretch(level, line, by))
        stretches[0] = replace(stretches[0], line_m=self._from_place(start, stretches[0].line_m))
        stretches[-1] = replace(stretches[-1], line_m=self._from_place(end, stretches[-1].line_m[::-1])[::-1])
        return stretches

    def _from_place(self, place: RoutePlace, line_m: Floats) -> Floats:
        """A line that begins at a place instead of at its cell, where no wall is between them."""
        at = np.array([[place.x_m, place.y_m]])
        if len(line_m) > 1 and self._is_clear(place, line_m[1]):
            return np.concatenate((at, line_m[1:]))
        return np.concatenate((at, line_m)) if self._is_clear(place, line_m[0]) else line_m

    def _is_clear(self, place: RoutePlace, to_m: Floats) -> bool:
        """Whether no wall is between a place and a point (2,) on its level."""
        return is_clear(self._plan.levels[place.level].solid, (place.x_m, place.y_m), to_m)

    def _cell(self, place: RoutePlace, what: str) -> tuple[int, int, int]:
        """Level, row and column of the free cell nearest to a position, if possible with no wall between. `what`: its name in errors."""
        levels, rows, columns = self._blocked.shape
        if not (0 <= place.level < levels and math.isfinite(place.x_m) and math.isfinite(place.y_m)):
            raise EchostepError(f"{what} is on level {place.level}, the plan has {levels}, counted from 0")
        c, r = (np.array([place.x_m, place.y_m]) - self._low) / CELL_M
        reach = int(MOVED_M / CELL_M)
        near = np.argwhere(
            ~self._blocked[
                place.level,
                max(int(r) - reach, 0) : max(int(r) + reach + 1, 0),
                max(int(c) - reach, 0) : max(int(c) + reach + 1, 0),
            ]
        )
        if not (0 <= r < rows and 0 <= c < columns) or not len(near):
            raise EchostepError(f"{what} ({place.x_m:.1f}, {place.y_m:.1f}) is outside the plan or inside a wall")
        near += [max(int(r) - reach, 0), max(int(c) - reach, 0)]
        order = near[((near + 0.5 - [r, c]) ** 2).sum(1).argsort(kind="stable")]
        centres = self._low + (order[:MOST_TRIED, ::-1] + 0.5) * CELL_M
        best = order[next((k for k, centre in enumerate(centres) if self._is_clear(place, centre)), 0)]
        return place.level, int(best[0]), int(best[1])

    def _inside(self, outline: Floats) -> Bools:
        """Mask (rows, columns) of the cells whose centre lies in an outline (n, 2)."""
        import shapely

        _, rows, columns = self._blocked.shape
        x = self._low[0] + (np.arange(columns) + 0.5) * CELL_M
        y = self._low[1] + (np.arange(rows) + 0.5) * CELL_M
        return np.asarray(shapely.contains_xy(shapely.Polygon(outline), *np.meshgrid(x, y)))


@kernel
def _search(
    blocked: Bools, tight: Bools, connector: Ints, serves: Bools, height: Floats, lift: Bools,
    start: tuple[int, int, int], ends: Ints,
) -> Ints:  # fmt: skip
    """The cheapest trail of cells (k, 3) to one of the ends (n, 3): level, row, column; (0, 3) without a route [Dijkstra 1959].

    `blocked`, `tight` and `connector` (index, -1 for none) are (levels, rows, columns). `serves` (connectors, levels).
    """
    levels, rows, columns = blocked.shape
    size = rows * columns
    cost = np.full(levels * size, np.inf)
    before = np.full(levels * size, -1, np.int64)
    first = start[0] * size + start[1] * columns + start[2]
    is_end = np.zeros(levels * size, np.bool_)
    for k in range(len(ends)):
        is_end[ends[k, 0] * size + ends[k, 1] * columns + ends[k, 2]] = True
    cost[first], last = 0.0, -1
    heap = [(0.0, first)]
    while heap:
        spent, here = heapq.heappop(heap)
        if is_end[here]:
            last = here
            break
        if spent > cost[here]:
            continue
        level, r, c = here // size, here % size // columns, here % columns
        for k in range(9):
            y, x = r + k // 3 - 1, c + k % 3 - 1
            if (
                0 <= y < rows
                and 0 <= x < columns
                and not (blocked[level, y, x] or blocked[level, r, x] or blocked[level, y, c])
            ):
                way = CELL_M * math.hypot(y - r, x - c) * (TIGHT if tight[level, y, x] else 1.0)
                there, total = level * size + y * columns + x, spent + way
                if total < cost[there]:
                    cost[there], before[there] = total, here
                    heapq.heappush(heap, (total, there))
        k = connector[level, r, c]
        for other in range(levels):
            if k >= 0 and other != level and serves[k, other] and connector[other, r, c] == k:
                rise = abs(height[other] - height[level])
                there, total = other * size + r * columns + c, spent + (LIFT_M + rise if lift[k] else CLIMB * rise)
                if total < cost[there]:
                    cost[there], before[there] = total, here
                    heapq.heappush(heap, (total, there))
    return _trace(before, first, last, rows, columns)


@part
def _trace(before: Ints, first: int, last: int, rows: int, columns: int) -> Ints:
    """The trail to cell `last`, followed back through each cell's predecessor; (0, 3) when it is -1: none was reached."""
    count, cell = 1, last
    while cell != first and cell >= 0:
        cell, count = before[cell], count + 1
    trail = np.empty((count if cell == first else 0, 3), np.int64)
    cell = last
    for i in range(len(trail) - 1, -1, -1):
        trail[i] = cell // (rows * columns), cell % (rows * columns) // columns, cell % columns
        cell = before[cell]
    return trail


@kernel
def _straighten(blocked: Bools, trail: Ints) -> Ints:
    """Indices of the cells (k, 2) at which the straightened trail bends: after each, the furthest visible cell."""
    corners = np.empty(len(trail), np.int64)
    corners[0] = 0
    n, here = 1, 0
    while here < len(trail) - 1:
        there = here + 1
        for k in range(len(trail) - 1, here, -1):
            if _sees(blocked, trail[here], trail[k]):
                there = k
                break
        corners[n] = there
        n, here = n + 1, there
    if n == 1:
        corners = np.append(corners[:1], len(trail) - 1)
        n = 2
    return corners[:n]


@part
def _sees(blocked: Bools, a: Ints, b: Ints) -> bool:
    """Whether the straight line between the centres of two cells crosses free cells only."""
    steps = 2 * max(abs(b[0] - a[0]), abs(b[1] - a[1])) + 1
    for k in range(steps + 1):
        s = k / steps
        if blocked[int(a[0] + 0.5 + s * (b[0] - a[0])), int(a[1] + 0.5 + s * (b[1] - a[1]))]:
            return False
    return True
