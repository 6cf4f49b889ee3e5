"""Slow, obviously right twins of the kernels."""

from __future__ import annotations

import math

import numpy as np
import shapely
from numpy.typing import NDArray

Floats = NDArray[np.float64]


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
        if not 1e-6 < distance <= 6.3 or off_axis > math.radians(35.0):
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
