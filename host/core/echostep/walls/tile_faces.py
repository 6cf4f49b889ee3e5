# SPDX-License-Identifier: MIT
"""Faces of a tile: the walls that can reflect sound straight back to it.

In: a tile's corners and the walls near it. Out: a `SourceTable` of faces with their screens. Owns nothing.

Lengths in a wall's own axes: s along its unit tangent t, h to the left of it. A tile spans low <= h <= high.

      h ^   +------+ high
        |   | tile |          the wall can answer the tile from s0 <= s <= s1
        |   +------+ low
        o===s0====s1=====> s
      (x, y)
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats, Int32s
from echostep.jit import lean_part, part
from echostep.walls.index import EAR_REACH_M, FACE, JOIN_M, SourceTable
from echostep.walls.tile_geometry import SLACK_M, by_bearing, covered, frame


class Strip(NamedTuple):
    """Part of a wall that can answer a tile: start and unit tangent of the wall, the stretch s0 to s1 along it, heights of the tile over it (m)."""

    x: float
    y: float
    tx: float
    ty: float
    s0: float
    s1: float
    low: float
    high: float


@part
def tile_faces(corners: Floats, near: Int32s, walls: Floats, slant: float) -> SourceTable:
    """The walls of `near` that can answer a tile, unless other walls cover them, with their screens; rows have three more columns here."""
    faces, starts = np.empty((len(near), FACE + 3)), np.zeros(len(near) + 1, np.int32)
    screens, used, count = np.empty(256, np.int32), 0, 0
    spans = np.empty((len(near), 4))
    for w in near:
        x, y, tx, ty, length = frame(walls, w)
        s0, s1, low, high = _extent(corners, x, y, tx, ty)
        far = max(high, -low)
        slack = min(far, EAR_REACH_M) * slant
        s0, s1 = max(s0 - slack, -slack), min(s1 + slack, length + slack)
        nearest = max(low, -high, 0.0)
        if s0 > s1 or nearest > EAR_REACH_M:
            continue
        if len(screens) < used + len(near):
            screens = np.concatenate((screens, screens, near))
        strip = Strip(x, y, tx, ty, s0, s1, low, high)
        more, covering = _face_screens(w, near, walls, strip, slant, screens[used:], spans)
        if covered(spans[:covering], s0, s1, 2.0 * slack):
            continue
        used += more
        faces[count, 0], faces[count, 1], faces[count, 2], faces[count, 3], faces[count, 4] = x, y, tx, ty, length
        faces[count, FACE] = nearest
        faces[count, FACE + 1] = math.atan2(-tx, ty) if low > 0.0 else math.atan2(tx, -ty)
        faces[count, FACE + 2] = math.atan(slant) if nearest > 0.0 else math.pi
        count += 1
        starts[count] = used
    bearings, order = by_bearing(faces[:count], FACE)
    rows, total = faces[:count, :FACE].copy(), np.array([0, count], np.int32)
    return SourceTable(total, bearings, order, rows, starts[: count + 1].copy(), screens[:used].copy())


@lean_part
def _face_screens(
    w: int, near: Int32s, walls: Floats, strip: Strip, slant: float, screens: Int32s, spans: Floats
) -> tuple[int, int]:
    """Walls that may stand between wall w and a place in the tile, into `screens`, and spans covered by those between all of both, into `spans`.

    Returns the number of each.
    """
    x, y, tx, ty, s0, s1, low, high = strip
    nearest = max(low, -high, 0.0)
    count, covering = 0, 0
    for u in near:
        if u == w:
            continue
        a, b, ha, hb = _clip(walls, u, x, y, tx, ty, s0, s1)
        if a > b or max(ha, hb) < min(low, 0.0) or min(ha, hb) > max(high, 0.0):
            continue
        if max(abs(ha), abs(hb)) < SLACK_M or (slant == 0.0 and b - a < SLACK_M * SLACK_M):
            continue  # on the same line; edge on
        screens[count] = u
        count += 1
        side = 1.0 if low > 0.0 else -1.0
        if nearest > JOIN_M and min(side * ha, side * hb) > JOIN_M and max(side * ha, side * hb) < nearest:
            spans[covering, 0], spans[covering, 1], spans[covering, 2], spans[covering, 3] = a, b, ha, hb
            covering += 1
    return count, covering


@lean_part
def _extent(corners: Floats, x: float, y: float, tx: float, ty: float) -> tuple[float, float, float, float]:
    """Least and greatest s of four corners along a wall, and least and greatest h over it."""
    s0, s1, low, high = np.inf, -np.inf, np.inf, -np.inf
    for k in range(4):
        dx, dy = corners[k, 0] - x, corners[k, 1] - y
        s, h = dx * tx + dy * ty, dy * tx - dx * ty
        s0, s1, low, high = min(s0, s), max(s1, s), min(low, h), max(high, h)
    return s0, s1, low, high


@lean_part
def _clip(
    walls: Floats, u: int, x: float, y: float, tx: float, ty: float, s0: float, s1: float
) -> tuple[float, float, float, float]:
    """The part of wall u with s0 <= s <= s1 in the axes of the wall that starts at x, y: from, to, and h there; from > to for none."""
    ax, ay, bx, by = walls[u, 0] - x, walls[u, 1] - y, walls[u, 2] - x, walls[u, 3] - y
    a, b, ha, hb = ax * tx + ay * ty, bx * tx + by * ty, ay * tx - ax * ty, by * tx - bx * ty
    if a > b:
        a, b, ha, hb = b, a, hb, ha
    if b < s0 or a > s1:
        return 1.0, 0.0, 0.0, 0.0
    slope = (hb - ha) / (b - a) if b > a else 0.0
    if a < s0:
        a, ha = s0, ha + slope * (s0 - a)
    if b > s1:
        b, hb = s1, hb + slope * (s1 - b)
    return a, b, ha, hb
