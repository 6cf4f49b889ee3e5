"""What can be heard from somewhere in one tile, and which walls may hide it from there.

In: the walls of a `WallIndex` and a tile. Out: its faces and points as two `SourceTable`s. Owns nothing.
A face is a wall that can throw sound straight back, a point is a place where walls end or meet. All answers are safe: what is left out can be
heard from nowhere in the tile, and what is not among the screens hides nothing from anywhere in it. So whoever asks from a place in the tile gets
the exact answer from a few walls [potentially visible sets, Teller and Sequin 1991].
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Floats, Int32s
from echostep.jit import inline_kernel, kernel, lean_kernel
from echostep.walls.index import BEARINGS, CONE_RAD, EAR_REACH_M, FACE, JOIN_M, POINT, TILE_M, SourceTable, WallIndex

EDGE, CORNER = 1.0, 2.0
FLAT_RAD = math.radians(3.0)  # two walls that turn by less continue each other
CORNER_RAD = math.radians(30.0)  # two reflections send sound back from a right angle, give or take this
SLACK_M = 1e-6


@kernel
def tile_sources(tile: int, index: WallIndex, slant: float) -> tuple[SourceTable, SourceTable]:
    """Faces and points that can be heard from a tile, for sound up to `slant` (tangent) off the normal of a wall."""
    corners = np.empty((4, 2))
    x, y = index.x0_m + tile % index.columns * TILE_M, index.y0_m + tile // index.columns * TILE_M
    for k in range(4):
        corners[k, 0] = x + (TILE_M + SLACK_M if k in (1, 2) else -SLACK_M)
        corners[k, 1] = y + (TILE_M + SLACK_M if k in (2, 3) else -SLACK_M)
    near = _walls_near(tile, index)
    return _faces(corners, near, index.walls, slant), _points(corners, near, index)


@kernel
def _walls_near(tile: int, index: WallIndex) -> Int32s:
    """Numbers of the walls that may come within earshot of a tile, ascending."""
    reach = math.ceil((EAR_REACH_M + JOIN_M) / TILE_M)
    column, row = tile % index.columns, tile // index.columns
    left, right = max(column - reach, 0), min(column + reach + 1, index.columns)
    found = np.empty(64, np.int32)
    count = 0
    for r in range(max(row - reach, 0), min(row + reach + 1, index.rows)):
        for k in range(index.start[r * index.columns + left], index.start[r * index.columns + right]):
            if count == len(found):
                found = np.concatenate((found, found))
            found[count] = index.ids[k]
            count += 1
    found = np.sort(found[:count])
    kept = 0
    for k in range(count):
        if kept == 0 or found[k] != found[kept - 1]:
            found[kept] = found[k]
            kept += 1
    return found[:kept]


@kernel
def _faces(corners: Floats, near: Int32s, walls: Floats, slant: float) -> SourceTable:
    faces, starts = np.empty((len(near), FACE)), np.zeros(len(near) + 1, np.int32)
    centre, spread, distance = np.empty(len(near)), np.empty(len(near)), np.empty(len(near))
    screens, used, count = np.empty(256, np.int32), 0, 0
    spans = np.empty((len(near), 4))
    for w in near:
        x, y, tx, ty, length = _frame(walls, w)
        s0, s1, low, high = _extent(corners, x, y, tx, ty)
        far = max(high, -low)
        slack = min(far, EAR_REACH_M) * slant
        s0, s1 = max(s0 - slack, -slack), min(s1 + slack, length + slack)
        nearest = max(low, -high, 0.0)
        if s0 > s1 or nearest > EAR_REACH_M:
            continue
        if len(screens) < used + len(near):
            screens = np.concatenate((screens, screens, near))
        before, covering = used, 0
        for u in near:
            if u == w:
                continue
            a, b, ha, hb = _clip(walls, u, x, y, tx, ty, s0, s1)
            if a > b or max(ha, hb) < min(low, 0.0) or min(ha, hb) > max(high, 0.0):
                continue
            if max(abs(ha), abs(hb)) < SLACK_M or (slant == 0.0 and b - a < SLACK_M * SLACK_M):
                continue  # on the same line; edge on
            screens[used] = u
            used += 1
            side = 1.0 if low > 0.0 else -1.0
            if nearest > JOIN_M and min(side * ha, side * hb) > JOIN_M and max(side * ha, side * hb) < nearest:
                spans[covering, 0], spans[covering, 1], spans[covering, 2], spans[covering, 3] = a, b, ha, hb
                covering += 1
        if _covered(spans[:covering], s0, s1, 2.0 * slack):
            used = before
            continue
        faces[count, 0], faces[count, 1], faces[count, 2], faces[count, 3], faces[count, 4] = x, y, tx, ty, length
        distance[count] = nearest
        centre[count] = math.atan2(-tx, ty) if low > 0.0 else math.atan2(tx, -ty)
        spread[count] = math.atan(slant) if nearest > 0.0 else math.pi
        count += 1
        starts[count] = used
    bearings, order = _by_bearing(centre[:count], spread[:count], distance)
    total = np.array([0, count], np.int32)
    return SourceTable(total, bearings, order, faces[:count].copy(), starts[: count + 1].copy(), screens[:used].copy())


@inline_kernel
def _frame(walls: Floats, w: int) -> tuple[float, float, float, float, float]:
    """Start of a wall, its unit tangent and its length."""
    ux, uy = walls[w, 2] - walls[w, 0], walls[w, 3] - walls[w, 1]
    length = math.hypot(ux, uy)
    return walls[w, 0], walls[w, 1], ux / length, uy / length, length


@lean_kernel
def _extent(corners: Floats, x: float, y: float, tx: float, ty: float) -> tuple[float, float, float, float]:
    """Least and greatest place along a line of four corners, and least and greatest height over it."""
    s0, s1, low, high = np.inf, -np.inf, np.inf, -np.inf
    for k in range(4):
        dx, dy = corners[k, 0] - x, corners[k, 1] - y
        s, h = dx * tx + dy * ty, dy * tx - dx * ty
        s0, s1, low, high = min(s0, s), max(s1, s), min(low, h), max(high, h)
    return s0, s1, low, high


@lean_kernel
def _clip(
    walls: Floats, u: int, x: float, y: float, tx: float, ty: float, s0: float, s1: float
) -> tuple[float, float, float, float]:
    """The part of wall u with s0 <= place along the line <= s1: from, to, and the heights there; from > to for none."""
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


@lean_kernel
def _covered(spans: Floats, low: float, high: float, overlap: float) -> bool:
    """Whether spans (from, to, height, height) leave no gap between low and high; those that do not join must overlap by so much."""
    reach, height = low, np.nan
    while reach < high:
        best, best_height = reach, height
        for k in range(len(spans)):
            joined = spans[k, 0] <= reach and abs(spans[k, 2] - height) < SLACK_M
            if (joined or spans[k, 0] <= max(reach - overlap, low)) and spans[k, 1] > best:
                best, best_height = spans[k, 1], spans[k, 3]
        if best == reach:
            return False
        reach, height = best, best_height
    return True


@kernel
def _points(corners: Floats, near: Int32s, index: WallIndex) -> SourceTable:
    points, starts = np.empty((8, POINT + 3)), np.zeros(9, np.int32)
    screens, used, count = np.empty(256, np.int32), 0, 0
    sectors, rays = np.empty((64, 5)), np.empty((64, 2))
    walls = index.walls
    for w in near:
        for end in range(2):
            x, y = walls[w, 2 * end], walls[w, 2 * end + 1]
            dx = max(corners[0, 0] - x, x - corners[2, 0], 0.0)
            dy = max(corners[0, 1] - y, y - corners[2, 1], 0.0)
            if dx * dx + dy * dy > EAR_REACH_M * EAR_REACH_M:
                continue
            kinds = _sectors(x, y, 2 * w + end, index, corners, sectors, rays)
            if kinds == 0:
                continue
            if len(screens) < used + len(near):
                screens = np.concatenate((screens, screens, near))
            more, centre, spread = _point_screens(x, y, corners, near, walls, screens[used:])
            if more < 0:
                continue
            for k in range(kinds):
                if count == len(points):
                    points, starts = np.concatenate((points, points)), np.concatenate((starts, starts))
                if len(screens) < used + more:
                    screens = np.concatenate((screens, screens))
                points[count, 0], points[count, 1], points[count, 2:POINT] = x, y, sectors[k]
                points[count, POINT], points[count, POINT + 1] = centre, spread
                points[count, POINT + 2] = dx * dx + dy * dy
                if k > 0:
                    screens[used : used + more] = screens[used - more : used]
                used += more
                count += 1
                starts[count] = used
    bearings, order = _by_bearing(points[:count, POINT], points[:count, POINT + 1], points[:count, POINT + 2])
    rows, total = points[:count, :POINT].copy(), np.array([0, count], np.int32)
    return SourceTable(total, bearings, order, rows, starts[: count + 1].copy(), screens[:used].copy())


@kernel
def _sectors(x: float, y: float, end: int, index: WallIndex, corners: Floats, sectors: Floats, rays: Floats) -> int:
    """Rows of `sectors`: what the wall end x, y is to some place in the tile; their number, 0 too where another end stands for this one."""
    walls, count = index.walls, 0
    column, row = int((x - index.x0_m) / TILE_M), int((y - index.y0_m) / TILE_M)
    tile = row * index.columns + column
    for k in range(index.start[tile], index.start[tile + 1]):
        u = index.ids[k]
        ux, uy, tx, ty, length = _frame(walls, u)
        s, h = (x - ux) * tx + (y - uy) * ty, (y - uy) * tx - (x - ux) * ty
        if abs(h) > JOIN_M or s < -JOIN_M or s > length + JOIN_M or count + 2 > len(rays):
            continue
        at_start, at_end = math.hypot(s, h) <= JOIN_M, math.hypot(s - length, h) <= JOIN_M
        if (at_start and _stands_for(walls, u, 0, x, y, end)) or (at_end and _stands_for(walls, u, 1, x, y, end)):
            return 0
        if not at_end or at_start:
            rays[count, 0], rays[count, 1] = tx, ty
            count += 1
        if not at_start:
            rays[count, 0], rays[count, 1] = -tx, -ty
            count += 1
    return _kinds(x, y, rays[:count], corners, sectors)


@inline_kernel
def _stands_for(walls: Floats, u: int, its_end: int, x: float, y: float, end: int) -> bool:
    """Of the ends that join in one place the least in x, y, number is the source."""
    ux, uy = walls[u, 2 * its_end], walls[u, 2 * its_end + 1]
    if ux != x:
        return ux < x
    if uy != y:
        return uy < y
    return 2 * u + its_end < end


@kernel
def _kinds(x: float, y: float, rays: Floats, corners: Floats, sectors: Floats) -> int:
    """The sectors between the walls that leave a place and what it is to a listener there: kind, from, to."""
    angles, order, count = np.empty(len(rays)), np.empty(len(rays), np.int32), 0
    for k in range(len(rays)):
        angles[k] = math.atan2(rays[k, 1], rays[k, 0])
        place = k
        while place > 0 and angles[order[place - 1]] > angles[k]:
            order[place] = order[place - 1]
            place -= 1
        order[place] = k
    for i in range(len(order)):
        a, b = order[i], order[(i + 1) % len(order)]
        width = angles[b] - angles[a]
        if i == len(order) - 1:
            width += 2.0 * math.pi
        if abs(width - math.pi) < FLAT_RAD or width < FLAT_RAD or count == len(sectors):
            continue
        if width < math.pi and not _sector_meets(x, y, rays[a], rays[b], corners):
            continue
        sectors[count, 0] = CORNER if abs(width - 0.5 * math.pi) <= CORNER_RAD else EDGE
        sectors[count, 1:3], sectors[count, 3:5] = rays[a], rays[b]
        if len(order) == 1:
            sectors[count, 1:5] = 0.0
        count += 1
    return count


@inline_kernel
def in_sector(dx: float, dy: float, ax: float, ay: float, bx: float, by: float) -> bool:
    """Whether direction d lies in the sector from a counter-clockwise to b; a = b = 0 is all round."""
    after_a, before_b = ax * dy - ay * dx >= 0.0, dx * by - dy * bx >= 0.0
    return (after_a and before_b) if ax * by - ay * bx > 0.0 else (after_a or before_b)


@lean_kernel
def _sector_meets(x: float, y: float, a: Floats, b: Floats, corners: Floats) -> bool:
    """Whether a tile may reach into the sector narrower than a half turn from a to b about x, y."""
    left_of_a, right_of_b = False, False
    for k in range(4):
        dx, dy = corners[k, 0] - x, corners[k, 1] - y
        left_of_a |= a[0] * dy - a[1] * dx >= 0.0
        right_of_b |= dx * b[1] - dy * b[0] >= 0.0
    return left_of_a and right_of_b


@kernel
def _point_screens(
    x: float, y: float, corners: Floats, near: Int32s, walls: Floats, screens: Int32s
) -> tuple[int, float, float]:
    """Walls that may stand between x, y and a place in the tile, into `screens`: their number, -1 if they hide it from everywhere.

    And the bearing of x, y from the tile, with the most that it differs from that.
    """
    inside = corners[0, 0] <= x <= corners[2, 0] and corners[0, 1] <= y <= corners[2, 1]
    mx, my = 0.5 * (corners[0, 0] + corners[2, 0]) - x, 0.5 * (corners[0, 1] + corners[2, 1]) - y
    length = math.hypot(mx, my)
    ex, ey = (mx / length, my / length) if length > 0.0 else (1.0, 0.0)
    low, high, nearest = np.inf, -np.inf, np.inf
    for k in range(4):
        dx, dy = corners[k, 0] - x, corners[k, 1] - y
        ahead, aside = dx * ex + dy * ey, dy * ex - dx * ey
        nearest = min(nearest, ahead)
        if ahead > 0.0:
            low, high = min(low, aside / ahead), max(high, aside / ahead)
    narrow = not inside and nearest > JOIN_M
    x0, x1 = min(x, corners[0, 0]), max(x, corners[2, 0])
    y0, y1 = min(y, corners[0, 1]), max(y, corners[2, 1])
    spans, covering, count = np.empty((len(near), 4)), 0, 0
    for u in near:
        ax, ay, bx, by = walls[u, 0], walls[u, 1], walls[u, 2], walls[u, 3]
        if max(ax, bx) < x0 or min(ax, bx) > x1 or max(ay, by) < y0 or min(ay, by) > y1:
            continue
        if (ax == x and ay == y) or (bx == x and by == y):
            continue  # both lines meet there, so nowhere else
        if narrow:
            a, b, before = _wedge(ax - x, ay - y, bx - x, by - y, ex, ey, low, high, corners, x, y)
            if a > b:
                continue
            if before:
                spans[covering, 0], spans[covering, 1], spans[covering, 2], spans[covering, 3] = a, b, 0.0, 0.0
                covering += 1
        screens[count] = u
        count += 1
    if narrow and _covered(spans[:covering], low, high, 0.0):
        return -1, 0.0, 0.0
    return count, math.atan2(-my, -mx), math.atan(max(high, -low)) if narrow else math.pi


@kernel
def _by_bearing(centre: Floats, spread: Floats, distance: Floats) -> tuple[Int32s, Int32s]:
    """For each bearing of an axis, the rows that may be within CONE_RAD of it, nearest first, as starts and row numbers."""
    start, order, count = np.zeros(BEARINGS + 1, np.int32), np.empty(BEARINGS * len(centre), np.int32), 0
    width = 2.0 * math.pi / BEARINGS
    for b in range(BEARINGS):
        for i in range(len(centre)):
            off = (b + 0.5) * width - centre[i]
            off = abs(off - 2.0 * math.pi * math.floor(off / (2.0 * math.pi) + 0.5))
            if off <= CONE_RAD + 0.5 * width + spread[i] + SLACK_M:
                place = count
                while place > start[b] and distance[order[place - 1]] > distance[i]:
                    order[place] = order[place - 1]
                    place -= 1
                order[place] = i
                count += 1
        start[b + 1] = count
    return start, order[:count].copy()


@lean_kernel
def _wedge(
    ax: float, ay: float, bx: float, by: float, ex: float, ey: float, low: float, high: float,
    corners: Floats, x: float, y: float,
) -> tuple[float, float, bool]:  # fmt: skip
    """Part of a wall a-b in the wedge low <= aside / ahead <= high about the origin, from > to for none; and whether all corners lie behind it."""
    a_ahead, a_aside, b_ahead, b_aside = ax * ex + ay * ey, ay * ex - ax * ey, bx * ex + by * ey, by * ex - bx * ey
    if min(a_aside - high * a_ahead, b_aside - high * b_ahead) > SLACK_M:
        return 1.0, 0.0, False
    if max(a_aside - low * a_ahead, b_aside - low * b_ahead) < -SLACK_M:
        return 1.0, 0.0, False
    ux, uy = bx - ax, by - ay
    here = ax * uy - ay * ux  # its sign tells on which side of the wall the origin lies
    before, beside = True, True
    for k in range(4):
        side = ((corners[k, 1] - y - ay) * ux - (corners[k, 0] - x - ax) * uy) * here
        before &= side < 0.0
        beside &= side > 0.0
    if beside or max(a_ahead, b_ahead) <= 0.0:
        return 1.0, 0.0, False
    if min(a_ahead, b_ahead) <= 0.0 or abs(here) <= 2.0 * JOIN_M * math.hypot(ux, uy):
        return low, high, False
    a, b = a_aside / a_ahead, b_aside / b_ahead
    return max(min(a, b), low), min(max(a, b), high), before
