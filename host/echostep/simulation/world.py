"""The world that the rangers hear: echoes from a plan.

In: where the trunk is, walls, a seeded generator. Out: times of flight a millisecond, for each ranger's own ping and for the other's. Owns nothing.
Sound levels in dB relative to a wall at 1 m on the axis; the tracker's likelihood shares nothing with this but the plan.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Counts = NDArray[np.uint16]


class Acoustics(NamedTuple):
    """What decides whether an echo is heard [Girard 2011, 2.6; SRF02 technical specification].

    `rim_rad`: 6 dB are lost there; the loss grows with the fourth power of the angle, so that the range shrinks toward the edge of the cone.
    `edge_db`: diffraction at a wall's end against a whole wall. `bounce_db`, `body_db`: loss per further wall, and past the wearer's body.
    `threshold_db` and its spread: a wall on the axis is heard up to 6 m.
    """

    speed_m_s: float = 343.2
    rim_rad: float = math.radians(27.5)
    edge_db: float = -16.0
    bounce_db: float = -3.0
    body_db: float = -8.0
    threshold_db: float = -18.5
    threshold_sd_db: float = 1.0
    minimum_m: float = 0.15
    maximum_m: float = 6.0
    noise_m: float = 0.025
    parallel_rad: float = math.radians(8.0)


SRF02 = Acoustics()


@dataclass(frozen=True, slots=True)
class Echoes:
    """`own_us`, `cross_us` (n, 2): left, right; 0 where nothing is heard (see host/DESIGN.md, the bench)."""

    own_us: Counts
    cross_us: Counts


def ranger_bias_m(rng: np.random.Generator) -> Floats:
    """Constant range error of the two rangers, (2,): with the noise it makes the 3-4 cm of the SRF02 [Girard 2011, 2.6]."""
    return 0.025 * rng.standard_normal(2)


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
    near = _near_walls(trunk_m, walls, acoustics.maximum_m + 0.5)
    noise = rng.standard_normal((n, 2, 4))
    own, cross = np.zeros((n, 2)), np.zeros((n, 2))
    _hear(trunk_m, heading_rad, near, noise, acoustics, own, cross)
    to_us = 2e6 / acoustics.speed_m_s
    own = np.where(own > 0.0, np.maximum(own + bias_m, acoustics.minimum_m), 0.0)
    own_us = np.clip(np.rint(own * to_us), 0, 65534).astype(np.uint16)
    cross_us = np.clip(np.rint(cross * to_us), 0, 65534).astype(np.uint16)
    return Echoes(own_us, cross_us)


def _near_walls(points: Floats, walls: Floats, reach_m: float) -> Floats:
    """The walls whose bounding boxes come within reach of the points'."""
    low, high = points.min(0) - reach_m, points.max(0) + reach_m
    ends = walls.reshape(-1, 2, 2)
    keep = ((ends.max(1) >= low) & (ends.min(1) <= high)).all(1)
    return np.ascontiguousarray(walls[keep])


@njit(cache=True)
def directivity_db(off_axis_rad: float, rim_rad: float) -> float:
    """Level against the axis, -6 dB at the rim [Girard 2011, Figure 2b]."""
    return -6.0 * (off_axis_rad / rim_rad) ** 4


@njit(cache=True)
def _hear(
    trunk: Floats, heading: Floats, walls: Floats, noise: Floats, a: Acoustics, own: Floats, cross: Floats
) -> None:
    """Ranges (m, half the way of the sound) per millisecond and ranger; 0 when nothing is heard."""
    for k in range(len(heading)):
        px, py = trunk[k, 0], trunk[k, 1]
        facing = np.full(2, -1)
        distance, loss = np.zeros(2), np.zeros(2)
        for side in range(2):
            axis = heading[k] + (0.5 - side) * math.pi
            level_noise = a.threshold_sd_db * noise[k, side, 0]
            nearest = a.maximum_m + 0.1
            heard = 0.0
            for w in range(len(walls)):
                d, off = _perpendicular(px, py, axis, walls[w])
                if d <= 0.0 or d >= nearest or off > 1.0:
                    continue
                level = directivity_db(off, a.rim_rad) - 20.0 * math.log10(max(d, 0.1))
                if level + level_noise < a.threshold_db or _blocked(px, py, walls, w):
                    continue
                nearest, heard = d, d
                facing[side], distance[side], loss[side] = w, d, directivity_db(off, a.rim_rad)
            edge = _edge(px, py, axis, nearest, level_noise, walls, a)
            if edge > 0.0:
                heard = edge
            if heard >= a.minimum_m:
                own[k, side] = heard + a.noise_m * noise[k, side, 1]
        _cross_talk(k, facing, distance, loss, walls, noise, a, cross)


@njit(cache=True)
def _perpendicular(px: float, py: float, axis: float, wall: Floats) -> tuple[float, float]:
    """Distance and off-axis angle of the point of a wall that throws sound straight back; distance 0 when there is none."""
    ux, uy = wall[2] - wall[0], wall[3] - wall[1]
    s = ((px - wall[0]) * ux + (py - wall[1]) * uy) / (ux * ux + uy * uy)
    if s < 0.0 or s > 1.0:
        return 0.0, 0.0
    fx, fy = wall[0] + s * ux - px, wall[1] + s * uy - py
    d = math.hypot(fx, fy)
    return d, abs((math.atan2(fy, fx) - axis + math.pi) % (2.0 * math.pi) - math.pi)


@njit(cache=True)
def _blocked(px: float, py: float, walls: Floats, but: int) -> bool:
    """Whether another wall stands before the reflecting point of wall `but`."""
    wall = walls[but]
    ux, uy = wall[2] - wall[0], wall[3] - wall[1]
    s = ((px - wall[0]) * ux + (py - wall[1]) * uy) / (ux * ux + uy * uy)
    return _blocked_point(px, py, wall[0] + s * ux, wall[1] + s * uy, walls, but)


@njit(cache=True)
def _blocked_point(px: float, py: float, qx: float, qy: float, walls: Floats, but: int) -> bool:
    """Whether any wall other than `but` meets the open segment p-q; walls that merely touch q do not count."""
    for w in range(len(walls)):
        if w == but:
            continue
        cx, cy, dx, dy = walls[w, 0], walls[w, 1], walls[w, 2], walls[w, 3]
        rx, ry, sx, sy = qx - px, qy - py, dx - cx, dy - cy
        det = rx * sy - ry * sx
        if abs(det) < 1e-12:
            continue
        t = ((cx - px) * sy - (cy - py) * sx) / det
        u = ((cx - px) * ry - (cy - py) * rx) / det
        if 1e-6 < t < 0.999 and -1e-9 <= u <= 1.0 + 1e-9:
            return True
    return False


@njit(cache=True)
def _edge(px: float, py: float, axis: float, before: float, level_noise: float, walls: Floats, a: Acoustics) -> float:
    """Distance of the nearest wall end that is heard before `before`; 0 for none."""
    nearest = before
    found = 0.0
    for w in range(len(walls)):
        for e in (0, 2):
            dx, dy = walls[w, e] - px, walls[w, e + 1] - py
            d = math.hypot(dx, dy)
            if d >= nearest or d < a.minimum_m:
                continue
            off = abs((math.atan2(dy, dx) - axis + math.pi) % (2.0 * math.pi) - math.pi)
            if off > 1.0:
                continue
            level = a.edge_db + directivity_db(off, a.rim_rad) - 30.0 * math.log10(max(d, 0.1))
            if level + level_noise < a.threshold_db or _blocked_point(px, py, walls[w, e], walls[w, e + 1], walls, w):
                continue
            nearest, found = d, d
    return found


@njit(cache=True)
def _cross_talk(
    k: int, facing: Floats, distance: Floats, loss: Floats, walls: Floats, noise: Floats, a: Acoustics, cross: Floats
) -> None:
    """The other ranger's ping by two bounces between parallel walls [Girard 2011, Figure 3b]: past the wearer, out and in again."""
    if facing[0] < 0 or facing[1] < 0:
        return
    w, v = walls[facing[0]], walls[facing[1]]
    turn = math.atan2(w[3] - w[1], w[2] - w[0]) - math.atan2(v[3] - v[1], v[2] - v[0])
    if abs((turn + 0.5 * math.pi) % math.pi - 0.5 * math.pi) > a.parallel_rad:
        return
    way = distance[0] + distance[1]
    level = loss[0] + loss[1] + 2.0 * a.bounce_db + a.body_db - 20.0 * math.log10(max(way, 0.1))
    for side in range(2):
        if way <= a.maximum_m and level + a.threshold_sd_db * noise[k, side, 2] >= a.threshold_db:
            cross[k, side] = way + a.noise_m * noise[k, side, 3]
