# SPDX-License-Identifier: MIT
"""Pieces of walls along the path: lines that touch the circles of successive echoes.

In: pings with their places by odometry. Out: `Fragments`. Owns the limits. A smooth wall answers from the foot of the perpendicular, whatever the
ranger's axis within its cone [Kuc and Siegel 1987]: so the range r at p is the distance of the wall, n p + r = rho for its unit normal n, and
a line is fitted to many of them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.jit import kernel, part
from echostep_app.mapping.graph.nodes import Nodes, Pings, rotated

LEAST, MISSES = 4, 3  # pings that begin a piece; pings in a row off the line that end it
GATE_M = 0.12  # of a ping from the line: three standard deviations of range and sway
LONGEST_M = 2.0  # of path along one piece, so that the path's own error within it is negligible
SHORTEST_M = 0.35  # of path: below, the direction of the wall is not known
FARTHEST_M = 5.0  # range: beyond, echoes alternate between two walls
CONE_RAD = math.radians(30.0)  # half of the ranger's cone, and the heading's own error
SD_M, SD_RAD = 0.04, math.radians(1.0)  # least standard deviations: sway of the trunk, bias of a ranger
RANGE_SD_M = 0.04
# Of one range, from a flat wall [Robot Electronics, sonar FAQ]: residuals beyond it come from the surface
NOISE_M = 0.025
# Slope of the line fitted to a surface of this standard deviation, of half length 1: off by as much at each end
SLOPE = math.sqrt(3.0)


class Fragments(NamedTuple):
    """Pieces (f,) of walls, each in the frame of the `node` nearest to its middle: x ahead, y left.

    `centre_m` (f, 2): its middle on the wall; `normal_rad`: direction from the path to the wall; `half_m`: half its length along the wall;
    `sd_m`, `sd_rad`: of place and direction; `pings`: how many. `ping` (k,): index of the fragment of each ping, -1: none.
    """

    node: Ints
    centre_m: Floats
    normal_rad: Floats
    half_m: Floats
    sd_m: Floats
    sd_rad: Floats
    pings: Ints
    ping: Ints


def find_fragments(nodes: Nodes, pings: Pings) -> Fragments:
    """The fragments of both rangers in order of their nodes."""
    rows: list[Floats] = []
    owner = np.full(len(pings.range_m), -1, np.int64)
    for ranger in (0, 1):
        own = np.flatnonzero((pings.ranger == ranger) & (pings.range_m < FARTHEST_M))
        way_m = nodes.way_m[pings.node[own]]
        ranger_rows, of_ping = _runs(pings.at_m[own], pings.axis_rad[own], pings.range_m[own], way_m)
        owner[own[of_ping >= 0]] = of_ping[of_ping >= 0] + sum(len(r) for r in rows)
        rows.append(ranger_rows)
    table = np.concatenate(rows)
    middle, node = table[:, 0:2], nearest_nodes(pings, owner, len(table))
    pose = nodes.pose[node]
    centre = rotated(middle - pose[:, :2], -pose[:, 2])
    return Fragments(
        node,
        centre,
        table[:, 2] - pose[:, 2],
        table[:, 3],
        table[:, 4],
        table[:, 5],
        table[:, 6].astype(np.int64),
        owner,
    )


def nearest_nodes(pings: Pings, owner: Ints, count: int) -> Ints:
    """The node nearest to the middle ping of each of `count` fragments; `owner` (k,): fragment of each ping."""
    order = np.argsort(owner, kind="stable")
    first, end = (np.searchsorted(owner[order], np.arange(count), side) for side in ("left", "right"))
    k = order[first + (end - first) // 2]
    nearest: Ints = pings.node[k] + (pings.share[k] > 0.5)
    return nearest


@kernel
def _runs(at: Floats, axis: Floats, range_m: Floats, way: Floats) -> tuple[Floats, Ints]:
    """Rows (f, 7) of x, y, normal, half length, sd, sd of the normal, pings; and the row of each ping."""
    n = len(range_m)
    rows, of_ping = np.zeros((n // LEAST + 1, 7)), np.full(n, -1, np.int64)
    member = np.zeros(n, np.int64)
    row_count, begin = 0, 0
    while begin + LEAST <= n:
        for k in range(LEAST):
            member[k] = begin + k
        fit = fit_line(at, axis, range_m, member[:LEAST])
        if fit[2] > 0.5 * GATE_M or way[begin + LEAST - 1] - way[begin] > LONGEST_M:
            begin += 1
            continue
        count, missed, k = LEAST, 0, begin + LEAST
        next_begin = k
        while k < n and missed < MISSES and way[k] - way[begin] < LONGEST_M:
            r = math.cos(fit[0]) * at[k, 0] + math.sin(fit[0]) * at[k, 1] + range_m[k] - fit[1]
            if abs(r) < GATE_M:
                member[count] = k
                count += 1
                missed = 0
                next_begin = k + 1
                fit = fit_line(at, axis, range_m, member[:count])
            else:
                missed += 1
            k += 1
        row = _row(at, axis, member[:count], fit)
        if row[3] >= 0.5 * SHORTEST_M and row[4] < GATE_M:
            rows[row_count] = row
            for j in range(count):
                of_ping[member[j]] = row_count
            row_count += 1
            begin = next_begin
        else:
            begin += 1
    return rows[:row_count], of_ping


@kernel
def fit_line(at: Floats, axis: Floats, range_m: Floats, member: Ints) -> tuple[float, float, float]:
    """Direction of the normal, rho and rms residual of the line that touches the circles of these pings (Gauss-Newton from the mean axis)."""
    n = len(member)
    sx, sy = 0.0, 0.0
    for k in member:
        sx += math.cos(axis[k])
        sy += math.sin(axis[k])
    normal, rho = math.atan2(sy, sx), 0.0
    cx, cy = at[member[n // 2], 0], at[member[n // 2], 1]
    prior = (RANGE_SD_M / CONE_RAD * 2.0) ** 2  # the wall lies within the cone about the axis
    mean = normal
    for _ in range(4):
        c, s = math.cos(normal), math.sin(normal)
        saa, sab, sa, sb = 0.0, 0.0, 0.0, 0.0
        for k in member:
            x, y = at[k, 0] - cx, at[k, 1] - cy
            slope, r = -s * x + c * y, c * x + s * y + range_m[k]
            saa += slope * slope
            sab += slope
            sa += slope * r
            sb += r
        # minimise sum (r + slope d - rho)^2 + prior (normal + d - mean)^2
        det = saa + prior - sab * sab / n
        step = -(sa - sab * sb / n + prior * (normal - mean)) / det
        normal += min(max(step, -0.5), 0.5)
        rho = (sb + sab * step) / n
    c, s = math.cos(normal), math.sin(normal)
    total = 0.0
    for k in member:
        total += (c * (at[k, 0] - cx) + s * (at[k, 1] - cy) + range_m[k] - rho) ** 2
    return normal, rho + c * cx + s * cy, math.sqrt(total / n)


@part
def _row(at: Floats, axis: Floats, member: Ints, fit: tuple[float, float, float]) -> Floats:
    """The piece of these pings as a row; an sd of infinity where the wall is outside the cone."""
    normal, rho, rms = fit
    c, s = math.cos(normal), math.sin(normal)
    low, high, total, square, off = math.inf, -math.inf, 0.0, 0.0, 0.0
    n = len(member)
    for k in member:
        along = -s * at[k, 0] + c * at[k, 1]
        low, high = min(low, along), max(high, along)
        total += along
        square += along * along
        off += abs((normal - axis[k] + math.pi) % (2.0 * math.pi) - math.pi)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    spread = max(square / n - (total / n) ** 2, 1e-6)
    row = np.zeros(7)
    row[0], row[1] = c * rho - s * middle, s * rho + c * middle
    row[2], row[3] = normal, half
    row[4] = math.hypot(SD_M, rms / math.sqrt(n)) if off / n < CONE_RAD else math.inf
    uneven = SLOPE * math.sqrt(max(rms * rms - NOISE_M**2, 0.0)) / max(half, 0.5 * SHORTEST_M)
    row[5] = math.hypot(math.hypot(SD_RAD, uneven), RANGE_SD_M / math.sqrt(spread * max(n / 3.0, 1.0)))
    row[6] = n
    return row
