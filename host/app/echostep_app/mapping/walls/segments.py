# SPDX-License-Identifier: MIT
"""Walls as segments: runs of cells that answered, joined over gaps without echoes, extended to the walls that they meet.

In: lines and counts by cell. Out: segments. Owns the limits.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats, spans
from echostep_app.mapping.graph.spots import SPOT_HALF_M
from echostep_app.mapping.walls.evidence import CELL_M, CROSSED, SMOOTH, Cells
from echostep_app.mapping.walls.lines import Lines

HEARD_ODDS, PASSED_ODDS = 1.0, 0.6  # weight of a ping from a cell, and of a ping that passed it
BRIDGE_M, SILENT_BRIDGE_M = 0.3, 1.5  # longest gap that is closed: at any evidence, and where no ping passed
# Greatest distance to the wall that an end is extended to, where no ping passed: a corridor and the corner that was cut
EXTEND_M = 2.6
SURE_M = 0.5  # an end is extended by this much even if pings passed: they may have passed the end itself
MEETS_M, LONG_M = 0.5, 2.0  # a short piece this near to a wall longer than this meets it
SNAP_M = 0.4  # an end that stands out beyond a crossing by less is cut there


class Least(NamedTuple):
    """Limits of a run: its pings, and its length; whether it is at least as wide as the reflecting spot."""

    pings: int
    length_m: float
    widened: bool = False


# For a line with a direction of the building; for any line where the building has none; for a line askew to them, as corners and edges seem to be
ACROSS, ANY, ASKEW = Least(8, 2.0 * SPOT_HALF_M, widened=True), Least(8, 0.6), Least(12, 0.8)


class Run(NamedTuple):
    """A piece of a line from `low_m` to `high_m` along it, with the pings that it explains."""

    line: int
    low_m: float
    high_m: float
    pings: float


def find_runs(cells: Cells, least: Least) -> list[Run]:
    """Runs of all lines within these limits."""
    runs = []
    kernel = np.ones(2 * SMOOTH + 1)
    for line, first in enumerate(cells.first_m.tolist()):
        h, p = cells.heard[line, : cells.size[line]], cells.passed[line, : cells.size[line]]
        near, near_passed = np.convolve(h, kernel, "same"), np.convolve(p, kernel, "same")
        there = (near > 0.0) & (HEARD_ODDS * near > PASSED_ODDS * near_passed)
        for low, high in _bridged(spans(there).tolist(), near_passed):
            at = np.flatnonzero(h[low:high]) + low
            if not len(at):
                continue
            low_m, high_m = first + at[0] * CELL_M, first + (at[-1] + 1) * CELL_M
            pings = float(h[low:high].sum())
            if least.widened:
                middle_m = 0.5 * (low_m + high_m)
                low_m, high_m = min(low_m, middle_m - SPOT_HALF_M), max(high_m, middle_m + SPOT_HALF_M)
            if pings >= least.pings and high_m - low_m >= least.length_m:
                runs.append(Run(line, low_m, high_m, pings))
    return runs


def _bridged(pieces: list[tuple[int, int]], passed: Floats) -> list[tuple[int, int]]:
    """Spans joined over short gaps, and over longer ones that no ping passed."""
    joined: list[tuple[int, int]] = []
    for low, high in pieces:
        if joined:
            gap = (low - joined[-1][1]) * CELL_M
            silent = not passed[joined[-1][1] : low].any()
            if gap < BRIDGE_M or (silent and gap < SILENT_BRIDGE_M):
                joined[-1] = (joined[-1][0], high)
                continue
        joined.append((low, high))
    return joined


def segments_of(lines: Lines, runs: list[Run], cells: Cells) -> Floats:
    """Segments (n, 4) with their ends where they meet other walls."""
    ends = np.array([(run.low_m, run.high_m) for run in runs]).reshape(-1, 2)
    met = ends.copy()
    for i, run in enumerate(runs):
        crossings = [c for j in range(len(runs)) if (c := _crossing(lines, runs, i, j)) is not None]
        for side in (0, 1):
            met[i, side] = _end(
                ends[i, side], 1.0 if side else -1.0, crossings, cells.passed[run.line], cells.first_m[run.line]
            )
    rows = [_segment(lines, run.line, *met[i]) for i, run in enumerate(runs)]
    return np.array(rows).reshape(-1, 4)


def meets(lines: Lines, runs: list[Run], i: int) -> bool:
    """Whether run i reaches another wall unextended: a corner or a junction."""
    low, high = runs[i].low_m - MEETS_M, runs[i].high_m + MEETS_M
    crossings = (_crossing(lines, runs, i, j) for j in range(len(runs)) if runs[j].high_m - runs[j].low_m > LONG_M)
    return any(c is not None and c[1] and low < c[0] < high for c in crossings)


def _crossing(lines: Lines, runs: list[Run], i: int, j: int) -> tuple[float, bool] | None:
    """Where along line i run j crosses it, and whether as it stands; None if it does not, even when its ends were extended."""
    a, b = lines.normal_rad[runs[i].line], lines.normal_rad[runs[j].line]
    sine = math.sin(b - a)
    if abs(sine) < 0.3:
        return None
    rho_a, rho_b = lines.rho_m[runs[i].line], lines.rho_m[runs[j].line]
    x = (rho_a * math.sin(b) - rho_b * math.sin(a)) / sine
    y = (rho_b * math.cos(a) - rho_a * math.cos(b)) / sine
    there = math.cos(b) * y - math.sin(b) * x
    if not runs[j].low_m - EXTEND_M <= there <= runs[j].high_m + EXTEND_M:
        return None
    stands = runs[j].low_m - SNAP_M <= there <= runs[j].high_m + SNAP_M
    return math.cos(a) * y - math.sin(a) * x, stands


def _end(end_m: float, way: float, crossings: list[tuple[float, bool]], passed: Floats, first_m: float) -> float:
    """The end moved outward to the nearest crossing within reach that no ping passed on the way, or inward to one that it hardly exceeds.

    A wall that reaches there is preferred to one that would have to be extended, when both cross nearly there: two walls on nearly one line.
    """
    best, best_m = end_m, math.inf
    for c, stands in crossings:
        beyond = (c - end_m) * way
        away = abs(beyond) + (0.0 if stands else SNAP_M)
        if (-SNAP_M if stands else 0.0) < beyond < EXTEND_M and away < best_m:
            low, high = sorted((int((end_m - first_m) / CELL_M), int((c - first_m) / CELL_M)))
            between = passed[max(low, 0) : max(high, 0)].sum()
            if between >= CROSSED or (beyond > SURE_M and between > 1.0):
                continue
            best, best_m = c, away
    return best


def _segment(lines: Lines, line: int, low: float, high: float) -> tuple[float, float, float, float]:
    c, s, rho = math.cos(lines.normal_rad[line]), math.sin(lines.normal_rad[line]), lines.rho_m[line]
    return c * rho - s * low, s * rho + c * low, c * rho - s * high, s * rho + c * high
