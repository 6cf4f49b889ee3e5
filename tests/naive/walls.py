# SPDX-License-Identifier: MIT
"""Slow, obviously right twins of the kernels."""

from __future__ import annotations

import math

import numpy as np
import shapely

from echostep.arrays import Floats


def crosses(ax: float, ay: float, bx: float, by: float, walls: Floats) -> bool:
    """Whether a move meets any wall."""
    move = shapely.LineString([(ax, ay), (bx, by)])
    return any(move.intersects(shapely.LineString(w.reshape(2, 2))) for w in walls)


def hidden(px: float, py: float, qx: float, qy: float, short_m: float, walls: Floats, but: int = -1) -> bool:
    """Whether any wall but one meets the sight line from p to `short_m` before q."""
    length = math.hypot(qx - px, qy - py)
    if length <= short_m:
        return False
    share = 1.0 - short_m / length
    sight = shapely.LineString([(px, py), (px + share * (qx - px), py + share * (qy - py))])
    met = shapely.intersects(sight, shapely.linestrings(walls.reshape(-1, 2, 2)))
    return bool(np.any(met[np.arange(len(walls)) != but]))


def echo_sources(px: float, py: float, axis_rad: float, walls: Floats) -> list[tuple[float, float, float]]:
    """Every (distance, off axis, kind) within 35 degrees and 6.3 m, nearest first; kind 0 wall, 1 edge, 2 corner."""
    found = []
    for j, (ax, ay, bx, by) in enumerate(walls.tolist()):
        length = math.hypot(bx - ax, by - ay)
        share = ((px - ax) * (bx - ax) + (py - ay) * (by - ay)) / length**2
        foot = (ax + share * (bx - ax), ay + share * (by - ay))
        if 0.0 <= share <= 1.0 and not hidden(px, py, *foot, 1e-3, walls, j):
            found.append((*foot, 0.0))
    points = corners_and_edges(px, py, walls)
    heard = []
    for x, y, kind in found + points:
        distance = math.hypot(x - px, y - py)
        off_axis = abs(math.remainder(math.atan2(y - py, x - px) - axis_rad, 2 * math.pi))
        if not 1e-6 < distance <= 6.3 or off_axis > math.radians(40.0):
            continue
        if kind == 0.0 or not hidden(px, py, x, y, 0.01, walls):
            heard.append((distance, off_axis, kind))
    return sorted(heard)


def segment_distance(px: float, py: float, ax: float, ay: float, bx: float, by: float) -> float:
    """Distance of a point from a segment."""
    share = ((px - ax) * (bx - ax) + (py - ay) * (by - ay)) / ((bx - ax) ** 2 + (by - ay) ** 2)
    share = min(max(share, 0.0), 1.0)
    return math.hypot(ax + share * (bx - ax) - px, ay + share * (by - ay) - py)


def corners_and_edges(px: float, py: float, walls: Floats) -> list[tuple[float, float, float]]:
    """Ends of walls as (x, y, kind) for a listener at p, of those within 1 cm of each other the least, hidden or not."""
    found = []
    ends = sorted(set(map(tuple, walls.reshape(-1, 2).tolist())))
    for x, y in ends:
        if any(math.hypot(x - u, y - v) <= 0.01 for u, v in ends if (u, v) < (x, y)):
            continue
        sides = []
        for ax, ay, bx, by in walls.tolist():
            if segment_distance(x, y, ax, ay, bx, by) <= 0.01:
                sides += [math.atan2(v - y, u - x) for u, v in ((ax, ay), (bx, by)) if math.hypot(u - x, v - y) > 0.01]
        # The sector of the listener: the first wall counter-clockwise and the first wall clockwise.
        here = math.atan2(py - y, px - x)
        width = min((a - here) % (2 * math.pi) for a in sides) + min((here - a) % (2 * math.pi) for a in sides)
        if abs(width - math.pi) >= math.radians(3.0) and width >= math.radians(3.0):
            found.append((x, y, 2.0 if abs(width - math.pi / 2) <= math.radians(30.0) else 1.0))
    return found


def cone_reading(
    px: float, py: float, axis_rad: float, walls: Floats, rays: int, aperture_rad: float, maximum_m: float
) -> float:
    """The shortest of so many rays in a cone that meet their first wall within half their spacing of its normal."""
    shortest = maximum_m
    for k in range(rays):
        angle = axis_rad + ((k + 0.5) / rays - 0.5) * aperture_rad
        ux, uy = math.cos(angle), math.sin(angle)
        first, counts = maximum_m, False
        for ax, ay, bx, by in walls.tolist():
            across = ux * (by - ay) - uy * (bx - ax)
            if across == 0.0:
                continue
            length = ((ax - px) * (by - ay) - (ay - py) * (bx - ax)) / across
            place = ((ax - px) * uy - (ay - py) * ux) / across
            if 0.0 <= place <= 1.0 and 0.0 < length < first:
                slant = math.asin(min(abs(ux * (bx - ax) + uy * (by - ay)) / math.hypot(bx - ax, by - ay), 1.0))
                first, counts = length, slant <= 0.5 * aperture_rad / rays
        if counts:
            shortest = min(shortest, first)
    return shortest


def merged(points: list[tuple[float, float, float]], tau_m: float) -> list[tuple[float, float, float]]:
    """Particles (x, y, weight): from the heaviest down, one that is closer than tau to one already kept gives it its weight."""
    kept: list[list[float]] = []
    for k in sorted(range(len(points)), key=lambda k: -points[k][2]):
        x, y, weight = points[k]
        near = [host for host in kept if (x - host[0]) ** 2 + (y - host[1]) ** 2 < tau_m**2]
        if near:
            near[0][2] += weight
        else:
            kept.append([x, y, weight])
    return [(x, y, weight) for x, y, weight in kept]


def similarity(modelled: tuple[float, float], measured: tuple[float, float], maximum_m: float) -> float:
    """[Girard 2011, eq. 1], a ranger after the other."""
    parts = [min(d, z, maximum_m) / min(max(d, z), maximum_m) for d, z in zip(modelled, measured, strict=True)]
    return sum(parts) / len(parts)


class Girard:
    """The eight steps with the printed parameters on Python lists; draws as the fast one does."""

    def __init__(self, walls: Floats, start: tuple[float, float], rng: np.random.Generator) -> None:
        self.walls = walls
        self.rng = rng
        self.particles = [(*start, 1.0)]

    def step(self, dx: float, dy: float, heading: float, pair: tuple[float, float] | None) -> tuple[float, float]:
        angles, shares = self.rng.uniform(0.0, 2.0 * math.pi, 20), np.sqrt(self.rng.uniform(0.0, 1.0, 20))
        vectors = [
            (dx + 0.25 * r * math.cos(a), dy + 0.25 * r * math.sin(a))
            for a, r in zip(angles.tolist(), shares.tolist(), strict=True)
        ]
        moved = [
            (x + u, y + v, w)
            for x, y, w in self.particles
            for u, v in vectors
            if not crosses(x, y, x + u, y + v, self.walls)
        ]
        heard = [6.0 if math.isnan(z) else z for z in pair or ()]
        aperture = math.radians(55.0)
        weighed = []
        for x, y, w in merged(moved, 0.05):
            if pair is None:
                weighed.append((x, y, w))
                continue
            modelled = [
                cone_reading(x, y, heading + side, self.walls, 7, aperture, 6.0)
                for side in (0.5 * math.pi, -0.5 * math.pi)
            ]
            weighed.append((x, y, similarity((modelled[0], modelled[1]), (heard[0], heard[1]), 6.0)))
        self.particles = sorted(weighed, key=lambda p: -p[2])[:150]
        total = sum(w for _, _, w in self.particles)
        return sum(x * w for x, _, w in self.particles) / total, sum(y * w for _, y, w in self.particles) / total
