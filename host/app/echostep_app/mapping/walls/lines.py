# SPDX-License-Identifier: MIT
"""The straight lines of walls: both faces of a thin wall, and pieces of one wall that were never joined, are one line.

In: walls of the solved graph with their fragments. Out: `Lines`. Owns the limits.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Bools, Floats
from echostep_app.mapping.graph.graph import Graph
from echostep_app.mapping.graph.spots import is_spot

SAME_M = 0.12  # two walls nearer than this, beside each other, are one: less is not a wall's thickness but two errors
SAME_RAD = math.radians(4.0)
BESIDE_M = 1.0  # along the walls, between two that may be one line
ALIGNED_RAD = math.radians(2.0)  # within it a wall has a direction of the building
LEAST_M = 0.5  # of fragments on a line, together


class Lines(NamedTuple):
    """`normal_rad` (l,) in [0, pi), `rho_m` (l,), `sd_m` (l,) of the place; `low_m`, `high_m`: extent of its fragments along (-sin, cos) of the
    normal; `aligned`: whether it has one of the building's directions.
    """

    normal_rad: Floats
    rho_m: Floats
    sd_m: Floats
    low_m: Floats
    high_m: Floats
    aligned: Bools


def find_lines(graph: Graph) -> Lines:
    """Lines of all walls, longest first."""
    centre, _ = graph.places()
    f, of = graph.fragments, graph.walls.of
    lines: list[Floats] = []
    for wall in range(len(graph.walls.rho_m)):
        own = np.flatnonzero(of == wall)
        if 2.0 * f.half_m[own].sum() >= LEAST_M or is_spot(f.half_m[own]).any():
            lines.append(_line(centre[own], graph.walls.normal_rad[wall], f.half_m[own], graph.base_rad))
    lines.sort(key=lambda line: -line[5])
    merged: list[Floats] = []
    for line in lines:
        same = next((k for k, other in enumerate(merged) if _same(line, other)), None)
        if same is None:
            merged.append(line)
        else:
            merged[same] = _joined(merged[same], line)
    merged.sort(key=lambda line: -line[5])
    table = np.array(merged).reshape(-1, 7)
    aligned = np.zeros(len(table), np.bool_)
    if graph.base_rad is not None:
        aligned = np.abs((table[:, 0] - graph.base_rad + 0.25 * math.pi) % (0.5 * math.pi) - 0.25 * math.pi) < 1e-9
    return Lines(table[:, 0], table[:, 1], table[:, 4], table[:, 2], table[:, 3], aligned)


def joined(a: Lines, b: Lines) -> Lines:
    """The lines of both."""
    return Lines._make(np.concatenate(columns) for columns in zip(a, b, strict=True))


def _line(centre: Floats, normal_rad: float, half_m: Floats, base_rad: float | None) -> Floats:
    """Normal, rho, low, high, sd, weight (length), spread of the pieces."""
    if base_rad is not None:
        off = (normal_rad - base_rad + 0.25 * math.pi) % (0.5 * math.pi) - 0.25 * math.pi
        normal_rad -= off if abs(off) < ALIGNED_RAD else 0.0
    normal_rad %= 2.0 * math.pi
    if normal_rad >= math.pi:
        normal_rad -= math.pi
    c, s = math.cos(normal_rad), math.sin(normal_rad)
    across, along = c * centre[:, 0] + s * centre[:, 1], c * centre[:, 1] - s * centre[:, 0]
    weight = half_m / half_m.sum()
    rho = float(np.average(across, weights=weight))
    variance = float(weight @ (across - rho) ** 2)
    sd = math.sqrt(variance / len(centre) + 0.03**2)
    return np.array([normal_rad, rho, (along - half_m).min(), (along + half_m).max(), sd, 2.0 * half_m.sum(), variance])


def _same(a: Floats, b: Floats) -> bool:
    """Whether two lines are of one wall."""
    turned = (a[0] - b[0] + 0.5 * math.pi) % math.pi - 0.5 * math.pi
    if abs(turned) > SAME_RAD:
        return False
    middle = 0.5 * (a[2] + a[3])
    x, y = math.cos(a[0]) * a[1] - math.sin(a[0]) * middle, math.sin(a[0]) * a[1] + math.cos(a[0]) * middle
    off = math.cos(b[0]) * x + math.sin(b[0]) * y - b[1]
    along = math.cos(b[0]) * y - math.sin(b[0]) * x
    half = 0.5 * (a[3] - a[2])
    return abs(off) < SAME_M and along - half < b[3] + BESIDE_M and along + half > b[2] - BESIDE_M


def _joined(a: Floats, b: Floats) -> Floats:
    """Line a with the pieces of line b, weighed by length; b's middle moves a's place."""
    middle = 0.5 * (b[2] + b[3])
    x, y = math.cos(b[0]) * b[1] - math.sin(b[0]) * middle, math.sin(b[0]) * b[1] + math.cos(b[0]) * middle
    across, along = math.cos(a[0]) * x + math.sin(a[0]) * y, math.cos(a[0]) * y - math.sin(a[0]) * x
    half, weight = 0.5 * (b[3] - b[2]), a[5] + b[5]
    share = b[5] / weight
    rho = a[1] + share * (across - a[1])
    sd = math.hypot((1.0 - share) * a[4], share * b[4])
    return np.array([a[0], rho, min(a[2], along - half), max(a[3], along + half), max(sd, 0.03), weight, a[6]])
