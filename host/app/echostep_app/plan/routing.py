# SPDX-License-Identifier: MIT
"""Routes through a building: the shortest walk through doors, stairs and lifts; the way out takes no lift.

In: a plan, start and destination. Out: a `Route`: one polyline per level. Owns the grids of a plan's levels. Doors are gaps in the walls.
The route is found on a grid [Dijkstra 1959] and then straightened, so that it bends only at corners.
"""

from __future__ import annotations

import contextlib
import heapq
import math
import threading
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from echostep.arrays import Bools, Floats, Ints
from echostep.errors import EchostepError
from echostep.jit import kernel, part
from echostep.plan import Plan
from echostep.walls.floor import mark_near_walls
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
Cell = tuple[int, int, int]  # level, row, column
Before = NDArray[np.int32]  # index of a cell's predecessor (levels, rows, columns)


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
        self._is_laid = False
        self._exits: dict[Cell, RoutePlace] = {}
        self._first: threading.Thread | None = None  # searches for `exit_m`
        self._outwards: Before | None = None  # from each cell the next one to the nearest exit

    def _lay(self) -> None:
        """Lay the grids; raises EchostepError for a plan that needs more than `MOST_CELLS`."""
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
        self._is_laid = True

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
            if not self._is_laid:
                self._lay()
            a = self._cell(start, "the start")
            if isinstance(end, RoutePlace):
                b, to = self._cell(end, "the destination"), f"({end.x_m:.1f}, {end.y_m:.1f})"
                trail = _trace(self._search([a], b, self._serves), b)[::-1]
            else:
                trail, to = self._trail_out(a), "an exit"
            if not len(trail):
                raise EchostepError(
                    f"there is no route from ({start.x_m:.1f}, {start.y_m:.1f}) to {to}: is a door missing in the plan?"
                )
            level, row, column = trail[-1].tolist()
            place = end if isinstance(end, RoutePlace) else self._exits[level, row, column]
            return Route(tuple(self._stretches(trail, start, place)))

    def _trail_out(self, start: Cell) -> Ints:
        """The trail to the nearest exit, without lifts; one search from all exits serves every start."""
        if self._outwards is None:
            for pose in exits_of(self._plan):
                place = RoutePlace(pose.x_m, pose.y_m, pose.level)
                with contextlib.suppress(EchostepError):  # one that is drawn into a wall
                    self._exits[self._cell(place, "an exit")] = place
            if not self._exits:
                raise EchostepError("the plan shows no exit")
            self._outwards = self._search(list(self._exits), (-1, -1, -1), self._serves & ~self._lift[:, None])
        return _trace(self._outwards, start)

    def _search(self, starts: list[Cell], end: Cell, serves: Bools) -> Before:
        return _search(
            self._blocked, self._tight, self._connector, serves, self._height, self._lift, np.array(starts), end
        )

    def exit_m(self, place: RoutePlace) -> float | None:
        """Length of the way out; None where there is none, and until the first search, in a thread of its own, is over."""
        if self._first is None:
            self._first = threading.Thread(target=self.exit_m, args=(place,), daemon=True)
            self._first.start()
        if self._outwards is None and threading.current_thread() is not self._first:
            return None
        try:
            return self.way(place, EXIT).length_m
        except EchostepError:
            return None

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
    starts: Ints, end: tuple[int, int, int],
) -> Before:  # fmt: skip
    """From each cell the next one on the cheapest trail to one of the starts (n, 3); itself in a start, -1 where no trail was found [Dijkstra 1959].

    `blocked`, `tight` and `connector` (index, -1 for none) are (levels, rows, columns), as the result. `serves` (connectors, levels).
    The search ends at the cell `end` (level, row, column); at (-1, -1, -1) never.
    """
    levels, rows, columns = blocked.shape
    size = rows * columns
    cost = np.full(levels * size, np.inf)
    before = np.full(levels * size, -1, np.int32)
    last = end[0] * size + end[1] * columns + end[2]
    heap = [(0.0, np.int64(0)) for _ in range(0)]
    for i in range(len(starts)):
        first = starts[i, 0] * size + starts[i, 1] * columns + starts[i, 2]
        cost[first], before[first] = 0.0, first
        heapq.heappush(heap, (0.0, first))
    while heap:
        spent, here = heapq.heappop(heap)
        if here == last:
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
    return before.reshape(blocked.shape)


@kernel
def _trace(before: Before, cell: tuple[int, int, int]) -> Ints:
    """The trail of cells (k, 3) from a cell through each cell's predecessor: level, row, column; (0, 3) where there is none."""
    _, rows, columns = before.shape
    begin = (cell[0] * rows + cell[1]) * columns + cell[2]
    flat, here, count = before.ravel(), begin, 1
    while flat[here] >= 0 and flat[here] != here:
        here, count = flat[here], count + 1
    trail = np.empty((count if flat[here] == here else 0, 3), np.int64)
    here = begin
    for i in range(len(trail)):
        trail[i] = here // (rows * columns), here % (rows * columns) // columns, here % columns
        here = flat[here]
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
