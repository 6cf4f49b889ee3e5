"""Ways through a building: the shortest that a person can walk, through doors, stairs and lifts.

In: a plan, and where from and where to. Out: a `Route`, a line a level. Owns the grids of a plan's levels. Doors are gaps in the walls. The way is
found on a grid [Dijkstra 1959] and then drawn tight, so that it bends at corners only.
"""

from __future__ import annotations

import heapq
import math
from dataclasses import dataclass

import numpy as np

from echostep.arrays import Bools, Floats, Ints
from echostep.errors import EchostepError
from echostep.jit import kernel
from echostep.plan.model import Plan
from echostep.plan.polyline import way_m

CELL_M = 0.15
BODY_M = 0.25  # half a person's width: nearer to a wall nobody walks
MARGIN_M = 1.5
ASIDE_M = 2.0  # a place that is too near to a wall counts as the nearest free one within this
MOST_CELLS = 60_000_000
CLIMB = 3.0  # a metre of stairs costs as much as so many on the level
LIFT_M = 20.0  # waiting for a lift costs as much as this way


@dataclass(frozen=True, slots=True)
class RoutePlace:
    """A place in the map on a level (an index into the plan's)."""

    x_m: float
    y_m: float
    level: int = 0


@dataclass(frozen=True, slots=True)
class Stretch:
    """The part of a way on one level: `line_m` (k, 2); at its end `by` (name or kind of stairs, lift or ramp) goes on to the next stretch."""

    level: int
    line_m: Floats
    by: str = ""


@dataclass(frozen=True, slots=True)
class Route:
    """A way from place to place."""

    stretches: tuple[Stretch, ...]

    @property
    def length_m(self) -> float:
        """Way on all levels, without climbing."""
        return sum(way_m(stretch.line_m) for stretch in self.stretches)


class Routes:
    """Ways through one plan."""

    def __init__(self, plan: Plan) -> None:
        """Raises EchostepError for a plan too large for its grid."""
        ends = np.concatenate([level.solid.reshape(-1, 2) for level in plan.levels])
        low = ends.min(0) if len(ends) else np.zeros(2)
        high = ends.max(0) if len(ends) else np.zeros(2)
        self._low = low - MARGIN_M
        columns, rows = (int(n) for n in np.ceil((high + MARGIN_M - self._low) / CELL_M))
        if columns * rows * len(plan.levels) > MOST_CELLS:
            raise EchostepError(
                f"plan {plan.name}: too large to find ways in: {columns} x {rows} cells on {len(plan.levels)} levels"
            )
        self._plan = plan
        self._blocked = np.zeros((len(plan.levels), rows, columns), np.bool_)
        for k, level in enumerate(plan.levels):
            _block(
                (np.asarray(level.solid, np.float64) - np.tile(self._low, 2)) / CELL_M,
                BODY_M / CELL_M,
                self._blocked[k],
            )
        self._connector = np.full(self._blocked.shape, -1, np.int64)
        self._serves = np.zeros((len(plan.connectors), len(plan.levels)), np.bool_)
        for c, connector in enumerate(plan.connectors):
            cells = self._inside(connector.outline_m)
            for storey in connector.levels:
                self._serves[c, storey] = True
                self._connector[storey][cells] = c
                self._blocked[storey][cells] = False
        self._height = np.array([level.height_m for level in plan.levels])
        self._lift = np.array([c.kind == "lift" for c in plan.connectors], np.bool_)

    def way(self, start: RoutePlace, end: RoutePlace) -> Route:
        """The shortest way; raises EchostepError when a place is outside the plan or no way leads there."""
        a, b = self._cell(start, "the start"), self._cell(end, "the destination")
        trail = _search(self._blocked, self._connector, self._serves, self._height, self._lift, a, b)
        if not len(trail):
            raise EchostepError(
                f"no way leads from ({start.x_m:.1f}, {start.y_m:.1f}) to ({end.x_m:.1f}, {end.y_m:.1f}): is a door missing in the plan?"
            )
        return Route(tuple(self._stretches(trail, start, end)))

    def _stretches(self, trail: Ints, start: RoutePlace, end: RoutePlace) -> list[Stretch]:
        found = []
        cuts = [0, *(np.flatnonzero(np.diff(trail[:, 0])) + 1).tolist(), len(trail)]
        for first, beyond in zip(cuts[:-1], cuts[1:], strict=True):
            part, level = trail[first:beyond], int(trail[first, 0])
            if len(part) == 1 and first > 0 and beyond < len(trail):
                continue  # a level that the stairs only pass
            kept = _tight(self._blocked[level], part[:, 1:])
            line = self._low + (part[kept][:, [2, 1]] + 0.5) * CELL_M
            by = ""
            if beyond < len(trail):
                connector = self._plan.connectors[int(self._connector[level, part[-1, 1], part[-1, 2]])]
                by = connector.name or connector.kind
            found.append(Stretch(level, line, by))
        found[0].line_m[0] = start.x_m, start.y_m
        found[-1].line_m[-1] = end.x_m, end.y_m
        return found

    def _cell(self, place: RoutePlace, what: str) -> tuple[int, int, int]:
        """The free cell nearest to a place."""
        levels, rows, columns = self._blocked.shape
        if not (0 <= place.level < levels and math.isfinite(place.x_m) and math.isfinite(place.y_m)):
            raise EchostepError(f"{what} is on level {place.level}, the plan has {levels}, counted from 0")
        c, r = (np.array([place.x_m, place.y_m]) - self._low) / CELL_M
        reach = int(ASIDE_M / CELL_M)
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
        best = near[((near + 0.5 - [r, c]) ** 2).sum(1).argmin()]
        return place.level, int(best[0]), int(best[1])

    def _inside(self, outline: Floats) -> Bools:
        """Cells whose middle lies in an outline (n, 2)."""
        import shapely

        _, rows, columns = self._blocked.shape
        x = self._low[0] + (np.arange(columns) + 0.5) * CELL_M
        y = self._low[1] + (np.arange(rows) + 0.5) * CELL_M
        return np.asarray(shapely.contains_xy(shapely.Polygon(outline), *np.meshgrid(x, y)))


@kernel
def _block(walls: Floats, reach: float, blocked: Bools) -> None:
    """Mark the cells whose middle is nearer than `reach` to a wall; all in cells."""
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


@kernel
def _search(
    blocked: Bools, connector: Ints, serves: Bools, height: Floats, lift: Bools,
    start: tuple[int, int, int], end: tuple[int, int, int],
) -> Ints:  # fmt: skip
    """The cheapest trail of cells (k, 3): level, row, column; (0, 3) when there is none."""
    levels, rows, columns = blocked.shape
    size = rows * columns
    cost = np.full(levels * size, np.inf)
    before = np.full(levels * size, -1, np.int64)
    first = start[0] * size + start[1] * columns + start[2]
    last = end[0] * size + end[1] * columns + end[2]
    cost[first] = 0.0
    heap = [(0.0, first)]
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
                there, total = level * size + y * columns + x, spent + CELL_M * math.hypot(y - r, x - c)
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


@kernel
def _trace(before: Ints, first: int, last: int, rows: int, columns: int) -> Ints:
    """The trail to `last`, from what came before each cell; (0, 3) when it was not reached."""
    count, at = 1, last
    while at != first and at >= 0:
        at, count = before[at], count + 1
    trail = np.empty((count if at == first else 0, 3), np.int64)
    at = last
    for i in range(len(trail) - 1, -1, -1):
        trail[i] = at // (rows * columns), at % (rows * columns) // columns, at % columns
        at = before[at]
    return trail


@kernel
def _tight(blocked: Bools, trail: Ints) -> Ints:
    """Indices of the cells (k, 2) at which a trail must bend: from each, the furthest one that is in sight."""
    kept = np.empty(len(trail), np.int64)
    kept[0] = 0
    n, here = 1, 0
    while here < len(trail) - 1:
        there = here + 1
        for k in range(len(trail) - 1, here, -1):
            if _sees(blocked, trail[here], trail[k]):
                there = k
                break
        kept[n] = there
        n, here = n + 1, there
    if n == 1:
        kept = np.append(kept[:1], len(trail) - 1)
        n = 2
    return kept[:n]


@kernel
def _sees(blocked: Bools, a: Ints, b: Ints) -> bool:
    """Whether the straight line between the middles of two cells stays on free ones."""
    steps = 2 * max(abs(b[0] - a[0]), abs(b[1] - a[1])) + 1
    for k in range(steps + 1):
        s = k / steps
        if blocked[int(a[0] + 0.5 + s * (b[0] - a[0])), int(a[1] + 0.5 + s * (b[1] - a[1]))]:
            return False
    return True
