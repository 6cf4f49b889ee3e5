"""The world that the rangers hear: which echoes of a plan come back, and when.

In: walls, where the trunk is, a seeded generator. Out: times of flight a millisecond, for each ranger's own ping and for the other's. Owns nothing.

Sound at 40 kHz meets walls as light meets mirrors [Kuc and Siegel 1987]: a wall answers from the foot of the perpendicular, the image of
one's own image gives the way by two walls (corners, and from one ranger to the other between two walls), and an edge answers weakly.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from echostep.arrays import Floats, Ints
from echostep.jit import kernel
from echostep.simulation.world.acoustics import FIRST_NULL, SRF02, Acoustics, path_db, rod_db, wall_db
from echostep.simulation.world.image_sources import (
    blocked,
    crossing,
    distance,
    foot,
    in_double_cone,
    inside_corner,
    mirror,
    wall_edges,
)

Counts = NDArray[np.uint16]

PIECE = 64  # poses that share one list of near walls
OWN, CROSS = 0, 1


@dataclass(frozen=True, slots=True)
class Echoes:
    """`own_us`, `cross_us` (n, 2): left, right; 0 where nothing is heard (see host/DESIGN.md, the bench)."""

    own_us: Counts
    cross_us: Counts


def ranger_bias_m(rng: np.random.Generator, acoustics: Acoustics = SRF02) -> Floats:
    """Constant range error of the two rangers, (2,)."""
    return acoustics.bias_m * rng.standard_normal(2)


def echoes(
    trunk_m: Floats,
    heading_rad: Floats,
    walls: Floats,
    bias_m: Floats,
    rng: np.random.Generator,
    acoustics: Acoustics = SRF02,
) -> Echoes:
    """Echoes for trunk positions (n, 2) and headings (n,); left looks to +90 degrees of the heading, right to -90."""
    n = len(heading_rad)
    noise = rng.standard_normal((n, 2, 4))
    range_m = np.zeros((n, 2, 2))
    for start in range(0, n, PIECE):
        at = slice(start, start + PIECE)
        near = _near_walls(trunk_m[at], walls, acoustics.maximum_m)
        _hear(trunk_m[at], heading_rad[at], near, wall_edges(near), noise[at], acoustics, range_m[at])
    own = range_m[..., OWN]
    range_m[..., OWN] = np.where(own > 0.0, np.maximum(own + bias_m, acoustics.minimum_m), 0.0)
    us = np.rint(range_m * (2e6 / acoustics.speed_m_s)).astype(np.uint16)
    return Echoes(us[..., OWN], us[..., CROSS])


def _near_walls(points: Floats, walls: Floats, reach_m: float) -> Floats:
    """The walls whose bounding boxes come within reach of the points'."""
    low, high = points.min(0) - reach_m, points.max(0) + reach_m
    ends = walls.reshape(-1, 2, 2)
    keep = ((ends.max(1) >= low) & (ends.min(1) <= high)).all(1)
    return np.ascontiguousarray(walls[keep])


@kernel
def _hear(
    trunk: Floats, heading: Floats, walls: Floats, edges: Floats, noise: Floats, a: Acoustics, range_m: Floats
) -> None:
    """Fill `range_m` (n, 2 rangers, own or cross): half the way of the nearest echo heard, with noise; 0 for none."""
    best, heard_db = np.zeros((2, 2)), np.zeros((2, 2))
    lit = np.zeros(len(walls), np.int64)
    for k in range(len(heading)):
        px, py = trunk[k, 0], trunk[k, 1]
        ax, ay = -math.sin(heading[k]), math.cos(heading[k])  # the left ranger's axis; the right one's is opposite
        best[:] = a.maximum_m + 1e-9
        heard_db[:, OWN] = a.threshold_db + a.threshold_sd_db * noise[k, :, 0]
        heard_db[:, CROSS] = a.threshold_db + a.threshold_sd_db * noise[k, :, 2]
        some = lit[: _lit(px, py, ax, ay, walls, a, lit)]
        _one_wall(px, py, ax, ay, walls, some, heard_db, a, best)
        _one_edge(px, py, ax, ay, walls, edges, heard_db, a, best)
        _two_walls(px, py, ax, ay, walls, some, heard_db, a, best)
        for side in range(2):
            for kind in (OWN, CROSS):
                if best[side, kind] <= a.maximum_m:
                    noisy = best[side, kind] + a.noise_m * noise[k, side, 1 + 2 * kind]
                    range_m[k, side, kind] = max(noisy, a.minimum_m)


@kernel
def _lit(px: float, py: float, ax: float, ay: float, walls: Floats, a: Acoustics, lit: Ints) -> int:
    """Fill `lit` with the numbers of the walls that reach into a ranger's cone; returns how many."""
    cosine = math.sqrt(1.0 - min(FIRST_NULL / a.size, 1.0) ** 2)
    count = 0
    for w in range(len(walls)):
        if in_double_cone(px, py, ax, ay, cosine, walls[w]):
            lit[count] = w
            count += 1
    return count


@kernel
def _one_wall(
    px: float, py: float, ax: float, ay: float, walls: Floats, lit: Ints, heard_db: Floats, a: Acoustics, best: Floats
) -> None:
    """Straight back from the foot of the perpendicular on each wall."""
    for w in lit:
        s = foot(px, py, walls[w])
        if s < 0.0 or s > 1.0:
            continue
        x, y = walls[w, 0] + s * (walls[w, 2] - walls[w, 0]), walls[w, 1] + s * (walls[w, 3] - walls[w, 1])
        side, away, off = _seen(px, py, ax, ay, x, y)
        if away < a.minimum_m or away >= best[side, OWN] or wall_db(away, off, a) < heard_db[side, OWN]:
            continue
        if not blocked(px, py, x, y, walls, w, w):
            best[side, OWN] = away


@kernel
def _one_edge(
    px: float, py: float, ax: float, ay: float, walls: Floats, edges: Floats, heard_db: Floats, a: Acoustics,
    best: Floats,
) -> None:  # fmt: skip
    """Straight back from the ends of walls; not from the inside of a corner."""
    for e in range(len(edges)):
        x, y = edges[e, 0], edges[e, 1]
        side, away, off = _seen(px, py, ax, ay, x, y)
        if away < a.minimum_m or away >= best[side, OWN]:
            continue
        if rod_db(away, off, a.frame_radius_m, a) < heard_db[side, OWN] or inside_corner(px - x, py - y, edges[e]):
            continue
        if not blocked(px, py, x, y, walls, -1, -1):
            best[side, OWN] = away


@kernel
def _two_walls(
    px: float, py: float, ax: float, ay: float, walls: Floats, lit: Ints, heard_db: Floats, a: Acoustics, best: Floats
) -> None:
    """Out to one wall, on to another, and back: to the same ranger (a corner) or to the other [Girard 2011, Figure 3b].

    The way is as long as the straight line to the mirror image, in the first wall, of one's own image in the last wall.
    """
    reach2 = 4.0 * a.maximum_m * a.maximum_m
    for last in lit:
        ix, iy = mirror(px, py, walls[last])
        if (ix - px) ** 2 + (iy - py) ** 2 > reach2:
            continue
        for first in lit:
            jx, jy = mirror(ix, iy, walls[first])
            way2 = (jx - px) ** 2 + (jy - py) ** 2
            if first == last or way2 > reach2:
                continue
            s = crossing(px, py, jx, jy, walls[first])
            bx, by = px + s * (jx - px), py + s * (jy - py)
            t = crossing(bx, by, ix, iy, walls[last]) if s >= 0.0 else -1.0
            if t >= 0.0:
                cx, cy = bx + t * (ix - bx), by + t * (iy - by)
                way = math.sqrt(way2)
                _offer(px, py, ax, ay, bx, by, cx, cy, 0.5 * way, walls, first, last, heard_db, a, best)


@kernel
def _offer(
    px: float, py: float, ax: float, ay: float, bx: float, by: float, cx: float, cy: float, range_m: float,
    walls: Floats, first: int, last: int, heard_db: Floats, a: Acoustics, best: Floats,
) -> None:  # fmt: skip
    """Take the way p-b-c-p as the best echo if it is shorter, loud enough and free."""
    sender, _, off_out = _seen(px, py, ax, ay, bx, by)
    side, _, off_back = _seen(px, py, ax, ay, cx, cy)
    kind = OWN if sender == side else CROSS
    if range_m < a.minimum_m or range_m >= best[side, kind]:
        return
    level = path_db(range_m, off_out, off_back, 2, a)
    if distance(px, py, bx, by, cx, cy) < a.body_m:
        level += a.body_db
    if level < heard_db[side, kind] or blocked(px, py, bx, by, walls, first, first):
        return
    if not blocked(cx, cy, px, py, walls, last, last) and not blocked(bx, by, cx, cy, walls, first, last):
        best[side, kind] = range_m


@kernel
def _seen(px: float, py: float, ax: float, ay: float, x: float, y: float) -> tuple[int, float, float]:
    """On which side of p a point lies (0 left, 1 right), how far away, and its angle off that ranger's axis."""
    away = max(math.hypot(x - px, y - py), 1e-9)
    along = ((x - px) * ax + (y - py) * ay) / away
    return (0 if along > 0.0 else 1), away, math.acos(min(abs(along), 1.0))
