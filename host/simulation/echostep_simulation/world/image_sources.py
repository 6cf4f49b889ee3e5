# SPDX-License-Identifier: MIT
"""Plane geometry of sound rays: mirror images, intersections, occlusion.

In: points and wall segments (4,) x0 y0 x1 y1, metres. Out: numbers. Owns nothing.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Floats
from echostep.jit import kernel, part

TOUCH_M = 1e-3  # walls closer than this meet
REFLECTED_M = 0.01  # beyond a wall's end that still reflects: a tenth of the first Fresnel zone's radius at 2 m, 40 kHz


@part
def foot(px: float, py: float, wall: Floats) -> float:
    """Where along a wall's line its nearest point to p lies: 0 at the wall's start, 1 at its end."""
    ux, uy = wall[2] - wall[0], wall[3] - wall[1]
    return ((px - wall[0]) * ux + (py - wall[1]) * uy) / (ux * ux + uy * uy)


@part
def mirror(px: float, py: float, wall: Floats) -> tuple[float, float]:
    """The mirror image of p in the line of a wall."""
    ux, uy = wall[2] - wall[0], wall[3] - wall[1]
    s = 2.0 * ((px - wall[0]) * uy - (py - wall[1]) * ux) / (ux * ux + uy * uy)
    return px - s * uy, py + s * ux


@part
def crossing(px: float, py: float, qx: float, qy: float, wall: Floats) -> float:
    """The share of the path p-q at which a wall is met; -1 when it does not."""
    rx, ry, sx, sy = qx - px, qy - py, wall[2] - wall[0], wall[3] - wall[1]
    det = rx * sy - ry * sx
    if abs(det) < 1e-12:
        return -1.0
    t = ((wall[0] - px) * sy - (wall[1] - py) * sx) / det
    u = ((wall[0] - px) * ry - (wall[1] - py) * rx) / det
    return t if 0.0 < t < 1.0 and 0.0 <= u <= 1.0 else -1.0


@part
def reflection(px: float, py: float, qx: float, qy: float, wall: Floats) -> tuple[float, float, bool]:
    """Point of a wall at which the way p-q meets it, and whether it does, to REFLECTED_M.

    In a right-angled corner both walls reflect at their ends: without that margin rounding would decide.
    """
    rx, ry, sx, sy = qx - px, qy - py, wall[2] - wall[0], wall[3] - wall[1]
    det = rx * sy - ry * sx
    if abs(det) < 1e-12:
        return 0.0, 0.0, False
    t = ((wall[0] - px) * sy - (wall[1] - py) * sx) / det
    u = ((wall[0] - px) * ry - (wall[1] - py) * rx) / det
    more_t, more_u = REFLECTED_M / math.hypot(rx, ry), REFLECTED_M / math.hypot(sx, sy)
    meets = -more_t < t < 1.0 + more_t and -more_u <= u <= 1.0 + more_u
    u = min(max(u, 0.0), 1.0)
    return wall[0] + u * sx, wall[1] + u * sy, meets


@part
def is_before(px: float, py: float, x: float, y: float, wall: Floats) -> bool:
    """Whether p lies before a wall as seen from its point (x, y): at an end of the wall, p must be on the wall's side of that end.

    From outside, the two walls of a corner meet the way to the corner's apex as well, to REFLECTED_M, but reflect nothing back.
    """
    more = REFLECTED_M / math.hypot(wall[2] - wall[0], wall[3] - wall[1])
    at, of_p = foot(x, y, wall), foot(px, py, wall)
    return (at > more or of_p > 0.0) and (at < 1.0 - more or of_p < 1.0)


@part
def blocked(px: float, py: float, qx: float, qy: float, walls: Floats, but: int, but_too: int) -> bool:
    """Whether a wall other than the two numbered lies between p and q; walls that only touch p or q do not."""
    way = math.hypot(qx - px, qy - py)
    for w in range(len(walls)):
        if w not in (but, but_too):
            t = crossing(px, py, qx, qy, walls[w])
            if t >= 0.0 and TOUCH_M < t * way < way - TOUCH_M:
                return True
    return False


@part
def distance(px: float, py: float, bx: float, by: float, cx: float, cy: float) -> float:
    """Distance of p from the segment b-c."""
    ux, uy = cx - bx, cy - by
    s = ((px - bx) * ux + (py - by) * uy) / max(ux * ux + uy * uy, 1e-18)
    s = min(max(s, 0.0), 1.0)
    return math.hypot(bx + s * ux - px, by + s * uy - py)


@part
def in_double_cone(px: float, py: float, ax: float, ay: float, cosine: float, wall: Floats) -> bool:
    """Whether any point of a wall lies in the cones around the axis a and its opposite: an end does, or the wall cuts the axis."""
    bx, by, cx, cy = wall[0] - px, wall[1] - py, wall[2] - px, wall[3] - py
    along_b, along_c = bx * ax + by * ay, cx * ax + cy * ay
    limit = cosine * cosine
    if along_b * along_b >= limit * (bx * bx + by * by) or along_c * along_c >= limit * (cx * cx + cy * cy):
        return True
    return (ax * by - ay * bx) * (ax * cy - ay * cx) <= 0.0


@kernel
def wall_edges(walls: Floats) -> Floats:
    """Wall ends that diffract, (k, 6): x, y and the directions of the two walls that meet there, the same one twice at a free end.

    An end that touches the middle of another wall is not an edge, nor is one where more than two walls meet or where two make one straight wall.
    """
    edges = np.zeros((2 * len(walls), 6))
    count = 0
    for w in range(len(walls)):
        for e in (0, 2):
            if _edge(walls, w, e, edges[count]):
                count += 1
    return edges[:count].copy()


@part
def _edge(walls: Floats, w: int, e: int, edge: Floats) -> bool:
    """Fill one edge from an end of a wall; False when it is not an edge, or an earlier wall's."""
    x, y = walls[w, e], walls[w, e + 1]
    ux, uy = walls[w, 2 - e] - x, walls[w, 3 - e] - y
    vx, vy = ux, uy
    meeting = 0
    for v in range(len(walls)):
        if v == w or _is_beside(x, y, walls[v]):
            continue
        if distance(x, y, walls[v, 0], walls[v, 1], walls[v, 2], walls[v, 3]) > TOUCH_M:
            continue
        at_start = math.hypot(walls[v, 0] - x, walls[v, 1] - y) <= TOUCH_M
        at_end = math.hypot(walls[v, 2] - x, walls[v, 3] - y) <= TOUCH_M
        meeting += 1 if v > w and (at_start or at_end) else 2
        sign = 1.0 if at_start else -1.0
        vx, vy = sign * (walls[v, 2] - walls[v, 0]), sign * (walls[v, 3] - walls[v, 1])
    straight = meeting == 1 and abs(ux * vy - uy * vx) < 1e-3 * math.hypot(ux, uy) * math.hypot(vx, vy)
    edge[0], edge[1], edge[2], edge[3], edge[4], edge[5] = x, y, ux, uy, vx, vy
    return meeting < 2 and not straight


@part
def _is_beside(x: float, y: float, wall: Floats) -> bool:
    """Whether a point lies more than 2 TOUCH_M outside the box around a wall: a quick answer for nearly all walls."""
    more = 2.0 * TOUCH_M
    if x < min(wall[0], wall[2]) - more or x > max(wall[0], wall[2]) + more:
        return True
    return y < min(wall[1], wall[3]) - more or y > max(wall[1], wall[3]) + more


@part
def inside_corner(x: float, y: float, edge: Floats) -> bool:
    """Whether the direction (x, y) from an edge lies inside the corner of less than 180 degrees that its walls make."""
    ux, uy, vx, vy = edge[2], edge[3], edge[4], edge[5]
    det = ux * vy - uy * vx
    return det != 0.0 and (x * vy - y * vx) / det > 0.0 and (ux * y - uy * x) / det > 0.0
