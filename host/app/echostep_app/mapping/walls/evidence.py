# SPDX-License-Identifier: MIT
"""The extent of a wall along its line: cells that echoes came from, and cells through which a ranger detected something farther.

In: lines, pings at their corrected places. Out: counts by line and cell. Owns the sensor's inverse model: a smooth wall answers from the foot of the
perpendicular, so one ping is evidence about one cell of each line within its cone.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product
from typing import NamedTuple

import numpy as np

from echostep.arrays import Bools, Floats, Ints
from echostep.elementary import wrap
from echostep.jit import kernel
from echostep_app.mapping.graph.graph import Graph
from echostep_app.mapping.graph.nodes import Pings
from echostep_app.mapping.walls.lines import Lines

CELL_M = 0.05
SMOOTH = 2  # cells to either side that a ping speaks for: 8.5 cm between two pings of a ranger at 1.2 m/s
MARGIN_M = 2.0  # of cells beyond the extent of a line's fragments
FITS_M = 0.1  # of a range from the distance of the line
HALF_CONE_RAD = math.radians(27.5)
# A range longer by more than this passed through the cell; also beyond the extent of its fragments, within which a line explains pings
BEYOND_M = 0.5
HALF_TRUNK_M, CROSSED = 0.25, 100.0  # the path leads through an opening at least this wide; its weight against pings
CORNER_M = 0.15  # of a range from the distance of a corner
TURNING_RAD = math.radians(15.0)  # turn of a stride
SIGHT_M = 1.0  # behind a line: more than the thickness of walls, and than the error of its place; assumed
DOOR_M = 0.9  # clear width of a door that wheelchairs pass [DIN 18040-1]; assumed for a door that was only seen
SURE_RAD, SURE_M = math.radians(15.0), 3.0  # within which a wall is hardly ever missed


class Cells(NamedTuple):
    """`heard`, `passed` (l, c): pings by line and cell; `first_m` (l,): place of the first cell along the line; `size` (l,): number of its cells.

    `of` (k,): line that explains each ping, -1: none.
    """

    heard: Floats
    passed: Floats
    first_m: Floats
    size: Ints
    of: Ints


def ping_poses(graph: Graph, pings: Pings) -> Floats:
    """Corrected place and axis (k, 3) of each ping: the node's pose, moved on by the share of the way to the next."""
    a = graph.pose[pings.node]
    b = graph.pose[np.minimum(pings.node + 1, len(graph.pose) - 1)]
    at = a[:, :2] + pings.share[:, None] * (b[:, :2] - a[:, :2])
    turn = wrap(b[:, 2] - a[:, 2])
    return np.column_stack([at, a[:, 2] + pings.share * turn + pings.off_heading_rad])


def is_straight(graph: Graph, pings: Pings) -> Bools:
    """Pings (k,) on a stride that turns little: in between two nodes the heading is interpolated."""
    after = np.minimum(pings.node + 1, len(graph.pose) - 1)
    turn = wrap(graph.pose[after, 2] - graph.pose[pings.node, 2])
    straight: Bools = np.abs(turn) < TURNING_RAD
    return straight


def cell_counts(lines: Lines, poses: Floats, range_m: Floats, free: Bools, straight: Bools) -> Cells:
    """Pings that each cell of each line explains, and pings that passed it.

    `free` (k,): pings that nothing else explains already; `straight` (k,): pings with a well-known axis, which alone show that a wall is missing.
    """
    first = lines.low_m - MARGIN_M
    count = np.ceil((lines.high_m - lines.low_m + 2.0 * MARGIN_M) / CELL_M).astype(np.int64)
    answered, passed = np.zeros((2, len(count), int(count.max(initial=1))))
    of = np.full(len(range_m), -1, np.int64)
    _count(lines, poses, range_m, free, straight, Cells(answered, passed, first, count, of))
    return Cells(answered, passed, first, count, of)


def add_crossings(lines: Lines, paths_m: Sequence[Floats], cells: Cells) -> None:
    """Cells of lines through which a path (n, 2) leads are open, half a trunk to either side."""
    for path_m, line in product(paths_m, range(len(cells.size))):
        c, s = math.cos(lines.normal_rad[line]), math.sin(lines.normal_rad[line])
        off, along = c * path_m[:, 0] + s * path_m[:, 1] - lines.rho_m[line], c * path_m[:, 1] - s * path_m[:, 0]
        k = np.flatnonzero(off[1:] * off[:-1] < 0.0)
        at = along[k] + (along[k + 1] - along[k]) * off[k] / (off[k] - off[k + 1])
        for place in at:
            low, high = (int((place + side * HALF_TRUNK_M - cells.first_m[line]) / CELL_M) for side in (-1.0, 1.0))
            low, high = max(low, 0), min(high, int(cells.size[line]))
            if low < high:
                cells.passed[line, low:high] += CROSSED
                cells.heard[line, low:high] = 0.0


def add_sights(lines: Lines, poses: Floats, range_m: Floats, straight: Bools, cells: Cells) -> None:
    """Cells of lines through which a ranger has seen are open, a door's width about the middle of the view.

    At a door the edges of its jambs answer within FITS_M of the wall's distance: only few pings through its middle differ from a wall's.
    """
    half = round(0.5 * DOOR_M / CELL_M)
    for line in range(len(cells.size)):
        seen = _seen_through(lines, line, poses, range_m, straight)
        for group in np.split(seen, np.flatnonzero(np.diff(seen) > 0.5 * DOOR_M) + 1) if len(seen) else ():
            middle = int((group.mean() - cells.first_m[line]) / CELL_M)
            low, high = middle - half, middle + half
            within = 2 * half <= low and high + 2 * half <= cells.size[line]
            if not within or group[-1] - group[0] > DOOR_M or (cells.passed[line, low:high] >= CROSSED).any():
                continue  # wider than a door: no wall; or walked through
            if cells.heard[line, low - half : low].any() and cells.heard[line, high : high + half].any():
                cells.passed[line, low + SMOOTH : high - SMOOTH] += CROSSED
                cells.heard[line, low:high] = 0.0


def _seen_through(lines: Lines, line: int, poses: Floats, range_m: Floats, straight: Bools) -> Floats:
    """Places along a line, ascending, at which a ranger looked at it squarely and detected something SIGHT_M behind it, or more."""
    c, s = math.cos(lines.normal_rad[line]), math.sin(lines.normal_rad[line])
    distance = lines.rho_m[line] - c * poses[:, 0] - s * poses[:, 1]
    off_axis = wrap(lines.normal_rad[line] + np.where(distance < 0.0, math.pi, 0.0) - poses[:, 2])
    through = (np.abs(distance) < SURE_M) & (range_m > np.abs(distance) + SIGHT_M)
    places: Floats = np.sort((c * poses[:, 1] - s * poses[:, 0])[through & straight & (np.abs(off_axis) < SURE_RAD)])
    return places


@kernel
def _count(lines: Lines, poses: Floats, range_m: Floats, free: Bools, straight: Bools, cells: Cells) -> None:
    cosine, sine = np.cos(lines.normal_rad), np.sin(lines.normal_rad)
    for k in range(len(range_m)):
        for line in range(len(cells.size)):
            c, s = cosine[line], sine[line]
            distance, normal = lines.rho_m[line] - c * poses[k, 0] - s * poses[k, 1], lines.normal_rad[line]
            if distance < 0.0:
                distance, normal = -distance, normal + math.pi
            fits = abs(range_m[k] - distance) < FITS_M
            if not fits and (distance >= SURE_M or range_m[k] < distance + BEYOND_M):
                continue  # most lines, before any computation
            off_axis = abs((normal - poses[k, 2] + math.pi) % (2.0 * math.pi) - math.pi)
            if off_axis > HALF_CONE_RAD:
                continue
            along = c * poses[k, 1] - s * poses[k, 0]
            cell = math.floor((along - cells.first_m[line]) / CELL_M)
            if cell < 0 or cell >= cells.size[line]:
                continue
            if fits:
                near = lines.low_m[line] - BEYOND_M < along < lines.high_m[line] + BEYOND_M
                if free[k] and cells.of[k] < 0 and near:
                    cells.heard[line, cell] += 1.0
                    cells.of[k] = line
            elif straight[k] and off_axis < SURE_RAD:
                cells.passed[line, cell] += 1.0


def explained_by_ends(segments: Floats, poses: Floats, range_m: Floats) -> Bools:
    """Which pings (k,) the ends of segments (n, 4) explain: corners and edges."""
    ends = np.unique(np.round(segments.reshape(-1, 2), 2), axis=0)
    explained = np.zeros(len(range_m), np.bool_)
    for x, y in ends:
        dx, dy = x - poses[:, 0], y - poses[:, 1]
        fits = np.flatnonzero(np.abs(np.hypot(dx, dy) - range_m) < CORNER_M)
        off_axis = np.abs((np.arctan2(dy[fits], dx[fits]) - poses[fits, 2] + math.pi) % (2.0 * math.pi) - math.pi)
        explained[fits] |= off_axis < HALF_CONE_RAD + 0.1
    return explained
