# SPDX-License-Identifier: MIT
"""The levels of a walk: flat stretches of path, separated by the climb of the foot between them.

In: measured segments, nodes. Out: `WalkLevels`. Owns the limits. From one stretch to the next the foot's rise is exact to centimetres; a level that
is entered again gets its earlier height, so its errors do not add up over a walk. Pressure counts only where no foot is worn.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median

import numpy as np

from echostep.arrays import Floats, Ints, spans
from echostep.path import MeasuredSegment
from echostep_app.mapping.graph.nodes import Nodes

# Assumed, not measured.
WINDOW_M = 2.5  # of path to either side of a node: longer than the landing between two flights
FLAT_M = 0.5  # of rise in both windows, from which the ground is not flat: steeper than a wheelchair's ramp (8 %)
STRETCH_M = 4.0  # of flat path that is a level; a shorter one is a landing
APART_M = 1.5  # between two levels, at least: half the usual height of a floor
SILL_M = 0.25  # of rise from the last flat place, up to which a node still belongs to it: one step
PRESSURE_S = 10.0  # over which heights by pressure are averaged by their median, where no foot is worn
BETWEEN = -1  # level of a node on stairs


@dataclass(frozen=True, slots=True)
class WalkLevels:
    """`of` (n,): level of each node, BETWEEN on stairs; `height_m` (s,) of each above the first node's, ascending."""

    of: Ints
    height_m: Floats

    @property
    def stairs(self) -> list[tuple[int, int]]:
        """The last node on a level and the first one on another, of each way between them."""
        flat = np.flatnonzero(self.of != BETWEEN)
        changed = np.flatnonzero(np.diff(self.of[flat]))
        return [(int(flat[k]), int(flat[k + 1])) for k in changed]

    @property
    def with_flights(self) -> Ints:
        """The level of each node (n,); each way over stairs is one of its own, numbered after the levels."""
        level = self.of.copy()
        for k, (first, end) in enumerate(spans(self.of == BETWEEN).tolist(), len(self.height_m)):
            level[first:end] = k
        return level


def find_levels(segments: Sequence[MeasuredSegment], nodes: Nodes) -> WalkLevels | None:
    """The levels of a walk; None where it has only one."""
    climb, way = np.interp(nodes.t_s, *_climb(segments)), nodes.way_m
    after, before = (np.interp(way + side * WINDOW_M, way, climb) for side in (1.0, -1.0))
    stretches = [
        (first, end)
        for first, end in spans(np.abs(after - before) < FLAT_M).tolist()
        if way[end - 1] - way[first] > STRETCH_M
    ]
    heights: list[float] = []
    which: list[int] = []
    for k, (first, end) in enumerate(stretches):
        here = _height_m(climb, way, first, end, from_end=False)
        last = stretches[k - 1] if k else None
        height = heights[which[-1]] + here - _height_m(climb, way, *last, from_end=True) if last else here
        known = [j for j, other in enumerate(heights) if abs(other - height) < APART_M]
        if not known:
            heights.append(height)
        which.append(min(known, key=lambda j: abs(heights[j] - height)) if known else len(heights) - 1)
    if len(heights) < 2:
        return None
    order = np.argsort(heights)
    rank = np.argsort(order)
    of = np.full(len(way), BETWEEN)
    for (first, end), level in zip(stretches, which, strict=True):
        low, high = _widened(climb, first, end)
        of[low:high] = rank[level]
    return WalkLevels(_filled(of), np.array(heights)[order])


def _height_m(climb: Floats, way: Floats, first: int, end: int, *, from_end: bool) -> float:
    """Height of the STRETCH_M at the beginning or the end of a stretch of nodes [first, end)."""
    near = way[end - 1] - way[first:end] < STRETCH_M if from_end else way[first:end] - way[first] < STRETCH_M
    return float(np.median(climb[first:end][near]))


def _widened(climb: Floats, first: int, end: int) -> tuple[int, int]:
    """The stretch [first, end) with the nodes before and after it up to the first step of the stairs."""
    low, high = first, end
    while low > 0 and abs(climb[low - 1] - climb[first]) < SILL_M:
        low -= 1
    while high < len(climb) and abs(climb[high] - climb[end - 1]) < SILL_M:
        high += 1
    return low, high


def _filled(of: Ints) -> Ints:
    """Nodes between two stretches of one level, as over a few steps up and down, belong to it."""
    flat = np.flatnonzero(of != BETWEEN)
    for a, b in zip(flat[:-1], flat[1:], strict=True):
        if of[a] == of[b]:
            of[a:b] = of[a]
    return of


def _climb(segments: Sequence[MeasuredSegment]) -> tuple[Floats, Floats]:
    """Times (m,) and heights (m,) above the start: by the foot where one is worn, else by pressure."""
    t_s = np.array([segments[0].segment.t0_s, *(m.segment.t1_s for m in segments)])
    if any(math.isfinite(m.segment.rise_sd_m) for m in segments):
        rise = [m.segment.rise_m if math.isfinite(m.segment.rise_sd_m) else 0.0 for m in segments]
        return t_s, np.concatenate([[0.0], np.cumsum(rise)])
    measured = [(m.segment.t1_s, median(m.height_m.tolist())) for m in segments if len(m.height_m)]
    if not measured:
        return t_s, np.zeros(len(t_s))
    times, heights = np.array(measured).T
    low, high = (np.searchsorted(times, times + side * 0.5 * PRESSURE_S) for side in (-1.0, 1.0))
    smooth = np.array([np.median(heights[a:b]) for a, b in zip(low, np.maximum(high, low + 1), strict=True)])
    return times, smooth - smooth[0]
