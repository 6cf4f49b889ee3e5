# SPDX-License-Identifier: MIT
"""Simulated ultrasonic echoes: times of flight from the walls of a plan.

In: walls, positions and headings of the trunk, a seeded generator. Out: times of flight of each pose, for each ranger's own ping and for
the other ranger's. Owns nothing.

Walls reflect sound of 40 kHz as mirrors reflect light [Kuc and Siegel 1987]: a wall answers from the foot of the perpendicular, the image of
an image gives the path by two walls (corners, and from one ranger to the other between two walls), and an edge answers weakly. A share of the first
echoes is missed; then a later one is reported: from an object behind, from the same wall twice, or from where the beam is scattered (`scattering`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from echostep.arrays import Floats, Ints
from echostep.jit import kernel, part
from echostep_simulation.world.acoustics import FIRST_NULL, SRF02, Acoustics, path_db, rod_db
from echostep_simulation.world.image_sources import (
    blocked,
    distance,
    foot,
    in_double_cone,
    inside_corner,
    is_before,
    mirror,
    reflection,
    wall_edges,
)
from echostep_simulation.world.scattering import chance_of, scattered_range

Counts = NDArray[np.uint16]

CHUNK_POSES = 64  # poses that share one list of near walls
PULSE_M = 0.1  # a missed echo hides the next within this range: a pulse of 16 periods at 40 kHz lasts 7 cm, there and back, and rings, assumed
OWN, CROSS = 0, 1


@dataclass(frozen=True, slots=True)
class Echoes:
    """`own_us`, `cross_us` (n, 2): left, right; 0 without a detected echo (see docs/design/bench.md)."""

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
    asked: NDArray[np.bool_] | None = None,
) -> Echoes:
    """Echoes for trunk positions (n, 2) and headings (n,); the left ranger points to +90 degrees of the heading, the right one to -90.

    `asked` (n,): poses whose echoes are wanted, all if None; the others have none. The noise of a pose is the same in any case.
    """
    n = len(heading_rad)
    noise = rng.standard_normal((n, 2, 4))
    range_m = np.zeros((n, 2, 2))
    wanted = np.arange(n) if asked is None else np.flatnonzero(asked)
    for start in range(0, len(wanted), CHUNK_POSES):
        poses = wanted[start : start + CHUNK_POSES]
        near, nearest_m = _near_walls(trunk_m[poses], walls, acoustics.maximum_m), np.zeros((len(poses), 2, 2))
        _nearest_echoes(trunk_m[poses], heading_rad[poses], near, wall_edges(near), noise[poses], acoustics, nearest_m)
        range_m[poses] = nearest_m
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


class RangerPair(NamedTuple):
    """Both rangers at one place: position, and the unit vector of the left ranger's axis; the right one's is opposite."""

    x: float
    y: float
    axis_x: float
    axis_y: float


class Search(NamedTuple):
    """The search for the nearest audible echo of one pose.

    `walls` (m, 4); `lit` (k,): indices of the walls that reach into a ranger's cone. `threshold_db`, `nearest_m` (2 rangers, own or cross):
    the lowest level that is detected, and the range of the nearest echo found so far, which the stages below update; `earliest_m` (2,): own echoes
    from nearer are not received.
    """

    walls: Floats
    lit: Ints
    threshold_db: Floats
    nearest_m: Floats
    earliest_m: Floats
    acoustics: Acoustics


@kernel
def _nearest_echoes(
    trunk: Floats, heading: Floats, walls: Floats, edges: Floats, noise: Floats, a: Acoustics, range_m: Floats
) -> None:
    """Fill `range_m` (n, 2 rangers, own or cross): range of the nearest detected echo, with noise; 0 for none."""
    nearest, threshold_db, earliest = np.zeros((2, 2)), np.zeros((2, 2)), np.zeros(2)
    lit = np.zeros(len(walls), np.int64)
    for k in range(len(heading)):
        rangers = RangerPair(trunk[k, 0], trunk[k, 1], -math.sin(heading[k]), math.cos(heading[k]))
        nearest[:], earliest[:] = a.maximum_m + 1e-9, a.minimum_m
        threshold_db[:, OWN] = a.threshold_db + a.threshold_sd_db * noise[k, :, 0]
        threshold_db[:, CROSS] = a.threshold_db + a.threshold_sd_db * noise[k, :, 2]
        search = Search(walls, lit[: _find_lit(rangers, walls, a, lit)], threshold_db, nearest, earliest, a)
        _search_all(rangers, edges, search)
        for side in range(2):
            if nearest[side, OWN] <= a.maximum_m and chance_of(noise[k, side, 0]) < a.missed:
                _search_later(rangers, side, edges, search)
            if nearest[side, OWN] > a.maximum_m and a.scatter > 0.0:
                _search_scattered(rangers, side, chance_of(noise[k, side, 1]), search)
            for kind in (OWN, CROSS):
                if nearest[side, kind] <= a.maximum_m:
                    noisy = nearest[side, kind] + a.noise_m * noise[k, side, 1 + 2 * kind]
                    range_m[k, side, kind] = max(noisy, a.minimum_m)


@part
def _search_all(rangers: RangerPair, edges: Floats, search: Search) -> None:
    """The nearest echoes that come back by mirrors and from edges."""
    _search_walls(rangers, search, 1)
    _search_edges(rangers, edges, search)
    _search_wall_pairs(rangers, search)


@part
def _search_later(rangers: RangerPair, side: int, edges: Floats, search: Search) -> None:
    """The next echo of a ranger that missed the first: of another reflector, or of a wall, the wearer and the wall once more."""
    search.earliest_m[side] = search.nearest_m[side, OWN] + PULSE_M
    search.nearest_m[side, OWN] = search.acoustics.maximum_m + 1e-9
    _search_all(rangers, edges, search)
    _search_walls(rangers, search, 2)


@part
def _search_scattered(rangers: RangerPair, side: int, chance: float, search: Search) -> None:
    """The echo of a ranger that received none by mirrors."""
    sign = 1.0 if side == 0 else -1.0
    axis, threshold_db = (sign * rangers.axis_x, sign * rangers.axis_y), search.threshold_db[side, OWN]
    earliest_m = search.earliest_m[side]
    range_m = scattered_range(
        (rangers.x, rangers.y), axis, search.walls, earliest_m, threshold_db, chance, search.acoustics
    )
    if range_m > 0.0:
        search.nearest_m[side, OWN] = range_m


@part
def _find_lit(rangers: RangerPair, walls: Floats, a: Acoustics, lit: Ints) -> int:
    """Fill `lit` with the indices of the walls that reach into a ranger's cone; returns their number."""
    cosine = math.sqrt(1.0 - min(FIRST_NULL / a.size, 1.0) ** 2)
    count = 0
    for w in range(len(walls)):
        if in_double_cone(rangers.x, rangers.y, rangers.axis_x, rangers.axis_y, cosine, walls[w]):
            lit[count] = w
            count += 1
    return count


@part
def _search_walls(rangers: RangerPair, search: Search, times: int) -> None:
    """Echoes straight back from the foot of the perpendicular on each wall, or back `times` times, with the wearer in between."""
    walls, a, nearest = search.walls, search.acoustics, search.nearest_m
    for w in search.lit:
        s = foot(rangers.x, rangers.y, walls[w])
        if s < 0.0 or s > 1.0:
            continue
        x, y = walls[w, 0] + s * (walls[w, 2] - walls[w, 0]), walls[w, 1] + s * (walls[w, 3] - walls[w, 1])
        side, away, off = _direction(rangers, x, y)
        range_m = times * away
        if range_m < search.earliest_m[side] or range_m >= nearest[side, OWN]:
            continue
        level = path_db(range_m, off, off, 2 * times - 1, a) + (times - 1) * a.body_db
        if level >= search.threshold_db[side, OWN] and not blocked(rangers.x, rangers.y, x, y, walls, w, w):
            nearest[side, OWN] = range_m


@part
def _search_edges(rangers: RangerPair, edges: Floats, search: Search) -> None:
    """Echoes straight back from the ends of walls, (e, 6) of `wall_edges`; none from the inside of a corner."""
    a, nearest = search.acoustics, search.nearest_m
    for e in range(len(edges)):
        x, y = edges[e, 0], edges[e, 1]
        side, away, off = _direction(rangers, x, y)
        if away < search.earliest_m[side] or away >= nearest[side, OWN]:
            continue
        if rod_db(away, off, a.frame_radius_m, a) < search.threshold_db[side, OWN]:
            continue
        if inside_corner(rangers.x - x, rangers.y - y, edges[e]):
            continue
        if not blocked(rangers.x, rangers.y, x, y, search.walls, -1, -1):
            nearest[side, OWN] = away


@part
def _search_wall_pairs(rangers: RangerPair, search: Search) -> None:
    """Echoes by two walls: to the sending ranger (a corner) or to the other one [Girard 2011, Figure 3b].

    p: the rangers; b, c: the points of reflection on the first and the last wall. i: mirror image of p in the last wall; j: that of i in the
    first wall. The path p-b-c-p is as long as the straight line p-j, which crosses the first wall in b; b-i crosses the last wall in c.

        -----c------ last wall
            / |
           p  |
            . |
        ------b----- first wall
    """
    px, py, walls = rangers.x, rangers.y, search.walls
    reach2 = 4.0 * search.acoustics.maximum_m * search.acoustics.maximum_m
    for last in search.lit:
        ix, iy = mirror(px, py, walls[last])
        if (ix - px) ** 2 + (iy - py) ** 2 > reach2:
            continue
        for first in search.lit:
            jx, jy = mirror(ix, iy, walls[first])
            way2 = (jx - px) ** 2 + (jy - py) ** 2
            if first == last or way2 > reach2:
                continue
            bx, by, reflects = reflection(px, py, jx, jy, walls[first])
            if not reflects or not is_before(px, py, bx, by, walls[first]):
                continue
            cx, cy, reflects = reflection(bx, by, ix, iy, walls[last])
            if reflects and is_before(px, py, cx, cy, walls[last]):
                _consider_pair(rangers, (bx, by), (cx, cy), 0.5 * math.sqrt(way2), (first, last), search)


@part
def _consider_pair(
    rangers: RangerPair,
    b: tuple[float, float],
    c: tuple[float, float],
    range_m: float,
    pair: tuple[int, int],
    search: Search,
) -> None:
    """Keep the path p-b-c-p of half length `range_m` as the nearest echo if it is nearer, loud enough and unobstructed."""
    px, py, walls, a = rangers.x, rangers.y, search.walls, search.acoustics
    first, last = pair
    sender, _, off_out = _direction(rangers, b[0], b[1])
    side, _, off_back = _direction(rangers, c[0], c[1])
    kind = OWN if sender == side else CROSS
    least_m = search.earliest_m[side] if kind == OWN else a.minimum_m
    if range_m < least_m or range_m >= search.nearest_m[side, kind]:
        return
    level = path_db(range_m, off_out, off_back, 2, a)
    if distance(px, py, b[0], b[1], c[0], c[1]) < a.body_m:
        level += a.body_db
    if level < search.threshold_db[side, kind] or blocked(px, py, b[0], b[1], walls, first, first):
        return
    if not blocked(c[0], c[1], px, py, walls, last, last) and not blocked(b[0], b[1], c[0], c[1], walls, first, last):
        search.nearest_m[side, kind] = range_m


@part
def _direction(rangers: RangerPair, x: float, y: float) -> tuple[int, float, float]:
    """Which ranger a point faces (0 left, 1 right), its distance, and its angle off that ranger's axis."""
    away = max(math.hypot(x - rangers.x, y - rangers.y), 1e-9)
    along = ((x - rangers.x) * rangers.axis_x + (y - rangers.y) * rangers.axis_y) / away
    return (0 if along > 0.0 else 1), away, math.acos(min(abs(along), 1.0))
