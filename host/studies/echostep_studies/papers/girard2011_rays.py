# SPDX-License-Identifier: MIT
"""Readings of both rangers at many poses.

In: poses and the tables of their tiles. Out: for each ranger the shortest ray that counts [Girard 2011, eq. 3]. Owns nothing.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats
from echostep.jit import allocating_part, inline_part, kernel, lean_part
from echostep.walls.echo_sources import tile_sources, unit_at
from echostep.walls.index import BEARINGS, CONE_RAD, SourceTable, WallIndex, segments_cross, wall_at

SAME_M = 1e-9  # walls so close together are met by a ray at once
Receiver = tuple[float, float, float, float]  # place (m), unit vector of the axis


class Poses(NamedTuple):
    """n poses, each (n,): place (m) and heading (rad); the rangers look to the left and to the right of the heading."""

    x: Floats
    y: Floats
    heading: Floats


class Cone(NamedTuple):
    """Rays of a ranger: `fan` (3, rays + 1) has cosine and sine of each off the axis, and the sine of the bound before it.

    `slant`: tangent of half the spacing of two rays. `maximum_m`: reading when no ray counts.
    """

    fan: Floats
    slant: float
    maximum_m: float


@kernel
def lambda_ray_ranges(
    x: Floats, y: Floats, heading_rad: Floats, index: WallIndex,
    rays: int = 7, aperture_rad: float = math.radians(55.0), maximum_m: float = 6.0,
) -> Floats:  # fmt: skip
    """Readings (n, 2) of the left and the right ranger at n poses [Girard 2011, eq. 3].

    Each ranger sends `rays` rays, `aperture_rad` / `rays` apart about its axis. A ray ends at the first wall it meets, and counts if it meets that
    within half the spacing from its normal. The reading is the shortest ray that counts, `maximum_m` (at most EAR_REACH_M) if there is none.
    No ray is cast: a wall can only answer on the ray that is nearest to its normal. Fast where `Walls` was made for half the spacing.
    """
    ranges = np.empty((len(x), 2))
    spacing = aperture_rad / rays
    angle = (np.arange(rays + 1) + 0.5 - 0.5 * rays) * spacing
    bound = np.sin(np.minimum(np.maximum(angle - 0.5 * spacing, -0.5 * math.pi), 0.5 * math.pi))
    cosine, sine = np.cos(angle), np.sin(angle)
    slant = math.tan(0.5 * spacing) * (1.0 + 1e-12)
    tables_hold = slant <= index.slant * (1.0 + 1e-11) and 0.5 * aperture_rad <= CONE_RAD
    cone = Cone(np.vstack((cosine, sine, bound)), slant, maximum_m)
    _cone_ranges(Poses(x, y, heading_rad), index, cone, tables_hold, ranges)
    return ranges


@lean_part
def _cone_ranges(poses: Poses, index: WallIndex, cone: Cone, tables_hold: bool, ranges: Floats) -> None:
    """Fill `ranges` of the poses; `tables_hold`: whether the index was made for at least this slant."""
    x, y, heading = poses
    for i in range(len(x)):
        unit = unit_at(x[i], y[i], heading[i] + 0.5 * math.pi, index)
        if unit < 0:
            ranges[i, 0] = ranges[i, 1] = cone.maximum_m
            continue
        tile, left = unit // BEARINGS, unit % BEARINGS
        k = index.tile_number[tile] - 1
        ax, ay = -math.sin(heading[i]), math.cos(heading[i])
        to_left, to_right = (x[i], y[i], ax, ay), (x[i], y[i], -ax, -ay)
        if not (0 <= k < index.tabulated and tables_hold):
            ranges[i, 0] = _cone_range_without_tables(to_left, tile, index, cone)
            ranges[i, 1] = _cone_range_without_tables(to_right, tile, index, cone)
            continue
        right = (left + BEARINGS // 2) % BEARINGS
        left, right = left + k * BEARINGS, right + k * BEARINGS
        ranges[i, 0] = _cone_range(to_left, index.walls, index.faces, left, cone)
        ranges[i, 1] = _cone_range(to_right, index.walls, index.faces, right, cone)


@allocating_part
def _cone_range_without_tables(receiver: Receiver, tile: int, index: WallIndex, cone: Cone) -> float:
    """`_cone_range` where the index has no tables for the tile or for this slant."""
    faces, _ = tile_sources(tile, index, cone.slant)
    shortest = cone.maximum_m
    for u in range(BEARINGS):
        shortest = min(shortest, _cone_range(receiver, index.walls, faces, u, cone))
    return shortest


@inline_part
def _cone_range(receiver: Receiver, walls: Floats, faces: SourceTable, u: int, cone: Cone) -> float:
    """The shortest ray that counts of a ranger, among the walls of unit u."""
    px, py, ax, ay = receiver
    fan, slant, shortest = cone
    rays = fan.shape[1] - 1
    for position in range(faces.start[u], faces.start[u + 1]):
        i = faces.order[position]
        dx, dy = px - faces.rows[i, 0], py - faces.rows[i, 1]
        tx, ty = faces.rows[i, 2], faces.rows[i, 3]
        h = dy * tx - dx * ty
        d, aside = abs(h), -(ax * tx + ay * ty) * h
        s, aslant = dx * tx + dy * ty, d * slant
        if not (d < shortest and -aslant <= s <= faces.rows[i, 4] + aslant and (ax * ty - ay * tx) * h > 0.0):
            continue
        if aside < fan[2, 0] * d or aside >= fan[2, rays] * d:
            continue
        k = 0  # the ray nearest to the wall's normal
        for j in range(1, rays):
            k += aside >= fan[2, j] * d
        rx, ry = ax * fan[0, k] - ay * fan[1, k], ay * fan[0, k] + ax * fan[1, k]
        length = d / abs(rx * ty - ry * tx)
        foot = s + length * (rx * tx + ry * ty)
        if not (length < shortest and 0.0 <= foot <= faces.rows[i, 4]):
            continue
        qx, qy, j = px + (length - SAME_M) * rx, py + (length - SAME_M) * ry, faces.screen_start[i]
        while j < faces.screen_start[i + 1] and not segments_cross(px, py, qx, qy, wall_at(walls, faces.screens[j])):
            j += 1
        shortest = length if j == faces.screen_start[i + 1] else shortest
    return shortest
