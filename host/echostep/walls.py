"""Walls near a point: crossing a wall, and the reflectors that a ranger can hear from a place.

In: wall segments (n, 4) in map metres. Out: `WallIndex` (built once) and kernels on plain arrays. Owns nothing.
The plane is cut into square tiles; each tile lists the walls within reach, so that a kernel looks at those alone.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from echostep.errors import EchostepError

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

TILE_M = 1.0
CROSS_REACH_M = 0.6  # a move is checked in pieces of at most this length
EAR_REACH_M = 6.3  # a little more than the rangers' 6 m
MAX_TILES = 40_000_000
CONE_RAD = math.radians(
    35.0
)  # beyond it nothing is heard: half the 55 degree cone and its soft rim [Girard 2011, Figure 2]
FAR_M = 1e9  # "no reflector"
WALL, EDGE = 0.0, 1.0
MOST_SOURCES = 8


class WallIndex(NamedTuple):
    """Per tile, the walls within reach of a move and within earshot, and the wall ends within earshot.

    Tile k has rows start[k]:start[k + 1] of `cross` (n, 4), `ear` (n, 4) and `ends` (n, 2): copies, so that a kernel reads them in one sweep.
    """

    x0_m: float
    y0_m: float
    columns: int
    rows: int
    cross_start: Ints
    cross: Floats
    ear_start: Ints
    ear: Floats
    ends_start: Ints
    ends: Floats


def build_index(walls: Floats) -> WallIndex:
    """Index of walls (n, 4); raises EchostepError for a plan too wide for its tiles."""
    walls = np.ascontiguousarray(walls, dtype=np.float64).reshape(-1, 4)
    if not len(walls):
        none = np.zeros(1, np.int32)
        return WallIndex(0.0, 0.0, 0, 0, none, walls, none, walls, none, walls.reshape(-1, 2))
    ends = walls.reshape(-1, 2)
    low, high = ends.min(0) - EAR_REACH_M, ends.max(0) + EAR_REACH_M
    columns, rows = (np.ceil((high - low) / TILE_M).astype(int) + 1).tolist()
    if columns * rows > MAX_TILES:
        raise EchostepError(f"the plan spans {high[0] - low[0]:.0f} x {high[1] - low[1]:.0f} m: are its units metres?")
    grid = (float(low[0]), float(low[1]), columns, rows)
    cross_start, cross_ids = _tile_lists(walls, *grid, CROSS_REACH_M)
    ear_start, ear_ids = _tile_lists(walls, *grid, EAR_REACH_M)
    corners = np.unique(ends, axis=0)
    ends_start, ends_ids = _tile_lists(np.hstack([corners, corners]), *grid, EAR_REACH_M)
    return WallIndex(*grid, cross_start, walls[cross_ids], ear_start, walls[ear_ids], ends_start, corners[ends_ids])


@njit(cache=True, error_model="numpy")
def _tile_lists(walls: Floats, x0: float, y0: float, columns: int, rows: int, reach: float) -> tuple[Ints, Ints]:
    """CSR lists of the walls within `reach` of any point of each tile."""
    limit = reach + TILE_M * math.sqrt(0.5)
    start = np.zeros(columns * rows + 1, np.int32)
    ids = np.zeros(0, np.int32)
    for count_only in (True, False):
        if not count_only:
            start[1:] = np.cumsum(start[1:]).astype(np.int32)
            ids = np.zeros(start[-1], np.int32)
            filled = start[:-1].copy()
        for w in range(len(walls)):
            ax, ay, bx, by = walls[w]
            c0 = max(int((min(ax, bx) - limit - x0) / TILE_M), 0)
            c1 = min(int((max(ax, bx) + limit - x0) / TILE_M) + 1, columns)
            r0 = max(int((min(ay, by) - limit - y0) / TILE_M), 0)
            r1 = min(int((max(ay, by) + limit - y0) / TILE_M) + 1, rows)
            for r in range(r0, r1):
                for c in range(c0, c1):
                    px, py = x0 + (c + 0.5) * TILE_M, y0 + (r + 0.5) * TILE_M
                    if _distance2(px, py, ax, ay, bx, by) > limit * limit:
                        continue
                    if count_only:
                        start[r * columns + c + 1] += 1
                    else:
                        ids[filled[r * columns + c]] = w
                        filled[r * columns + c] += 1
    return start, ids


@njit(cache=True, error_model="numpy", inline="always")
def _distance2(px: float, py: float, ax: float, ay: float, bx: float, by: float) -> float:
    """Squared distance of a point from a segment."""
    ux, uy = bx - ax, by - ay
    length2 = ux * ux + uy * uy
    s = min(max(((px - ax) * ux + (py - ay) * uy) / length2, 0.0), 1.0) if length2 > 0.0 else 0.0
    dx, dy = ax + s * ux - px, ay + s * uy - py
    return dx * dx + dy * dy


@njit(cache=True, error_model="numpy", inline="always")
def _tile(x: float, y: float, index: WallIndex) -> int:
    """Number of the tile that holds a point; -1 outside, and for a point that is not finite."""
    if not (index.x0_m <= x < index.x0_m + index.columns * TILE_M):
        return -1
    if not (index.y0_m <= y < index.y0_m + index.rows * TILE_M):
        return -1
    return int((y - index.y0_m) / TILE_M) * index.columns + int((x - index.x0_m) / TILE_M)


@njit(cache=True, error_model="numpy")
def segments_cross(ax: float, ay: float, bx: float, by: float, walls: Floats, j: int) -> bool:
    """Whether the segment a-b meets wall j; touching counts."""
    cx, cy, dx, dy = walls[j, 0], walls[j, 1], walls[j, 2], walls[j, 3]
    d1 = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    d2 = (bx - ax) * (dy - ay) - (by - ay) * (dx - ax)
    d3 = (dx - cx) * (ay - cy) - (dy - cy) * (ax - cx)
    d4 = (dx - cx) * (by - cy) - (dy - cy) * (bx - cx)
    return d1 * d2 <= 0.0 and d3 * d4 <= 0.0 and (d1 != 0.0 or d2 != 0.0)


@njit(cache=True, error_model="numpy")
def crosses_wall(ax: float, ay: float, bx: float, by: float, index: WallIndex) -> bool:
    """Whether a move from a to b goes through any wall."""
    length = math.hypot(bx - ax, by - ay)
    pieces = max(1, math.ceil(length / CROSS_REACH_M))
    for k in range(pieces):
        px, py = ax + (bx - ax) * k / pieces, ay + (by - ay) * k / pieces
        qx, qy = ax + (bx - ax) * (k + 1) / pieces, ay + (by - ay) * (k + 1) / pieces
        tile = _tile(px, py, index)
        if tile < 0:
            continue
        for j in range(index.cross_start[tile], index.cross_start[tile + 1]):
            if segments_cross(px, py, qx, qy, index.cross, j):
                return True
    return False


@njit(cache=True, error_model="numpy")
def reflectors(px: float, py: float, axis_rad: float, index: WallIndex) -> tuple[float, float, float]:
    """Distance and off-axis angle of the nearest wall that faces the ranger, and distance of the nearest visible wall end.

    A wall faces the ranger when the foot of the perpendicular lies on it, inside the cone, with nothing before it
    [Girard 2011, eq. 3 with ever finer rays]. Returns (distance_m, off_axis_rad, edge_m); FAR_M where there is none.
    """
    tile = _tile(px, py, index)
    if tile < 0:
        return FAR_M, 0.0, FAR_M
    walls = index.ear[index.ear_start[tile] : index.ear_start[tile + 1]]
    ends = index.ends[index.ends_start[tile] : index.ends_start[tile + 1]]
    ax, ay = math.cos(axis_rad), math.sin(axis_rad)
    cone = math.cos(CONE_RAD)
    wall_m, off_cos = _nearest_facing(px, py, ax, ay, cone, walls)
    edge_m = _nearest_edge(px, py, ax, ay, cone, min(wall_m, EAR_REACH_M), walls, ends)
    return wall_m, math.acos(min(off_cos, 1.0)), edge_m


@njit(cache=True, error_model="numpy")
def _nearest_facing(px: float, py: float, ax: float, ay: float, cone: float, walls: Floats) -> tuple[float, float]:
    """Distance and cosine off the axis of the nearest unhidden perpendicular: nearest first, so that few are looked for."""
    beyond2 = 0.0
    while True:
        best2, best_ahead, fx, fy = EAR_REACH_M * EAR_REACH_M, -1.0, 0.0, 0.0
        for j in range(len(walls)):
            wx, wy = walls[j, 0], walls[j, 1]
            ux, uy = walls[j, 2] - wx, walls[j, 3] - wy
            length2 = ux * ux + uy * uy
            along = (px - wx) * ux + (py - wy) * uy
            if not 0.0 <= along <= length2:
                continue
            s = along / length2
            dx, dy = wx + s * ux - px, wy + s * uy - py
            d2 = dx * dx + dy * dy
            ahead = dx * ax + dy * ay
            if beyond2 < d2 < best2 and ahead > 0.0 and ahead * ahead >= cone * cone * d2:
                best2, best_ahead, fx, fy = d2, ahead, dx, dy
        if best_ahead < 0.0:
            return FAR_M, 1.0
        if not _hidden(px, py, px + fx, py + fy, walls):
            d = math.sqrt(best2)
            return d, best_ahead / d
        beyond2 = best2


@njit(cache=True, error_model="numpy")
def _nearest_edge(
    px: float, py: float, ax: float, ay: float, cone: float, limit: float, walls: Floats, ends: Floats
) -> float:
    """Distance of the nearest unhidden wall end in the cone, nearer than `limit`."""
    beyond2 = 0.0
    while True:
        best2, ex, ey = limit * limit, 0.0, 0.0
        for j in range(len(ends)):
            dx, dy = ends[j, 0] - px, ends[j, 1] - py
            d2 = dx * dx + dy * dy
            ahead = dx * ax + dy * ay
            if beyond2 < d2 < best2 and ahead > 0.0 and ahead * ahead >= cone * cone * d2:
                best2, ex, ey = d2, dx, dy
        if ex == 0.0 and ey == 0.0:
            return FAR_M
        if not _hidden(px, py, px + ex, py + ey, walls):
            return math.sqrt(best2)
        beyond2 = best2


@njit(cache=True, error_model="numpy")
def _hidden(px: float, py: float, qx: float, qy: float, walls: Floats) -> bool:
    """Whether a wall stands between p and a point q; the last millimetre does not count, q lies on a wall itself."""
    d = math.hypot(qx - px, qy - py)
    shrink = max(0.0, 1.0 - 1e-3 / d)
    ex, ey = px + (qx - px) * shrink, py + (qy - py) * shrink
    for j in range(len(walls)):  # noqa: SIM110 (numba)
        if segments_cross(px, py, ex, ey, walls, j):
            return True
    return False


@njit(cache=True, error_model="numpy")
def echo_sources(
    px: float, py: float, axis_rad: float, index: WallIndex, distance_m: Floats, off_axis_rad: Floats, kind: Floats
) -> int:
    """temporary"""
    tile = _tile(px, py, index)
    if tile < 0:
        return 0
    walls = index.ear[index.ear_start[tile] : index.ear_start[tile + 1]]
    ends = index.ends[index.ends_start[tile] : index.ends_start[tile + 1]]
    ax, ay = math.cos(axis_rad), math.sin(axis_rad)
    cone = math.cos(CONE_RAD)
    n = 0
    for j in range(len(walls)):
        wx, wy = walls[j, 0], walls[j, 1]
        ux, uy = walls[j, 2] - wx, walls[j, 3] - wy
        length2 = ux * ux + uy * uy
        along = (px - wx) * ux + (py - wy) * uy
        if not 0.0 <= along <= length2:
            continue
        s = along / length2
        dx, dy = wx + s * ux - px, wy + s * uy - py
        d = math.sqrt(dx * dx + dy * dy)
        if d > EAR_REACH_M or d < 1e-6 or dx * ax + dy * ay < cone * d or n >= len(kind):
            continue
        if not _hidden(px, py, px + dx, py + dy, walls):
            n = _insert(n, d, math.acos(min((dx * ax + dy * ay) / d, 1.0)), 0.0, distance_m, off_axis_rad, kind)
    for j in range(len(ends)):
        dx, dy = ends[j, 0] - px, ends[j, 1] - py
        d = math.sqrt(dx * dx + dy * dy)
        if d > EAR_REACH_M or d < 1e-6 or dx * ax + dy * ay < cone * d or n >= len(kind):
            continue
        if not _hidden(px, py, px + dx, py + dy, walls):
            n = _insert(n, d, math.acos(min((dx * ax + dy * ay) / d, 1.0)), 1.0, distance_m, off_axis_rad, kind)
    return n


@njit(cache=True, error_model="numpy")
def _insert(n: int, d: float, off: float, k: float, distance_m: Floats, off_axis_rad: Floats, kind: Floats) -> int:
    i = n
    while i > 0 and distance_m[i - 1] > d:
        distance_m[i], off_axis_rad[i], kind[i] = distance_m[i - 1], off_axis_rad[i - 1], kind[i - 1]
        i -= 1
    distance_m[i], off_axis_rad[i], kind[i] = d, off, k
    return n + 1


@njit(cache=True, error_model="numpy", inline="always")
def walls_near(px: float, py: float, index: WallIndex) -> Floats:
    """The walls (n, 4) within earshot of a point."""
    tile = _tile(px, py, index)
    if tile < 0:
        return index.ear[:0]
    return index.ear[index.ear_start[tile] : index.ear_start[tile + 1]]
