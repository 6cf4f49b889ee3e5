# SPDX-License-Identifier: MIT
"""Places of walls that are detected while the trunk turns on the spot: at the end of a room, where no ranger is ever carried along the wall.

In: pings of no fragment, the directions of the building. Out: fragments of one spot each. Owns the limits. From one place a wall, a corner and an
edge sound alike: the range is the same while the axis sweeps over them, and the middle of that sweep is where they are [Kuc and Siegel 1987]. A
building with two directions decides: a spot across one of them is taken for a wall.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Bools, Floats, Ints
from echostep.jit import kernel
from echostep_app.mapping.graph.directions import LEAST_EVIDENCE, RIGHT_RAD, Directions
from echostep_app.mapping.graph.fragments import FARTHEST_M, SD_M, Fragments, nearest_nodes
from echostep_app.mapping.graph.nodes import Nodes, Pings, rotated

LEAST, MISSED = 5, 1  # pings of a ranger, and how many between two may be of other places
SWEEP_RAD = math.radians(25.0)  # of the axis, with the same range: half of the cone
FITS_M = 0.08  # of a range from the mean: three standard deviations
SPOT_M = 0.15  # from the first ping to the last: the trunk moves over the feet
# Of the middle of the sweep from a direction of the building; also its standard deviation: it turns nothing
ACROSS_RAD = math.radians(20.0)
# Of the range: mean of 1 - cos, by which a corner within ACROSS_RAD is farther than its wall
CORNER = ACROSS_RAD**2 / 6.0
SPOT_HALF_M = 0.1  # half the width that reflects: the first Fresnel zone at 2.5 m, sqrt(wavelength * range / 2), wavelength 8.6 mm


def is_spot(half_m: Floats) -> Bools:
    """Which fragments of these half lengths (f,) are spots: all others are longer."""
    short: Bools = half_m <= SPOT_HALF_M
    return short


def with_spots(nodes: Nodes, pings: Pings, fragments: Fragments, directions: Directions) -> Fragments:
    """The fragments, followed by those of spots; a building without directions has none."""
    if directions.evidence < LEAST_EVIDENCE:
        return fragments
    spots, of_ping = _both_rangers(pings, fragments.ping < 0)
    node = nearest_nodes(pings, of_ping, len(spots))
    direction = directions.base_rad - directions.drift_rad[node]
    off = (spots[:, 2] - direction + 0.5 * RIGHT_RAD) % RIGHT_RAD - 0.5 * RIGHT_RAD
    across, first = np.abs(off) < ACROSS_RAD, len(fragments.node)
    number = np.append(np.where(across, first + np.cumsum(across) - 1, -1), -1)
    on_walls = _on_walls(nodes, node[across], spots[across], (spots[:, 2] - off)[across])
    columns = [np.concatenate([a, b]) for a, b in zip(fragments[:-1], on_walls, strict=True)]
    return Fragments(*[*columns, np.where(of_ping < 0, fragments.ping, number[of_ping])])


def _on_walls(nodes: Nodes, node: Ints, spots: Floats, normal_rad: Floats) -> tuple[Floats | Ints, ...]:
    """The columns of `Fragments`, without `ping`, of spots (s, 5) on walls with these normals by odometry."""
    count, pose, range_m = len(spots), nodes.pose[node], spots[:, 3]
    on_wall = spots[:, :2] + range_m[:, None] * np.column_stack([np.cos(normal_rad), np.sin(normal_rad)])
    return (
        node,
        rotated(on_wall - pose[:, :2], -pose[:, 2]),
        normal_rad - pose[:, 2],
        np.full(count, SPOT_HALF_M),
        np.hypot(SD_M, CORNER * range_m),
        np.full(count, ACROSS_RAD),
        spots[:, 4].astype(np.int64),
    )


def _both_rangers(pings: Pings, free: Bools) -> tuple[Floats, Ints]:
    """Rows of `_spots` of both rangers, among the pings (k,) that are `free`; and the row of each ping."""
    of_ping, rows, count = np.full(len(free), -1, np.int64), [np.zeros((0, 5))], 0
    for ranger in (0, 1):
        every = np.flatnonzero(pings.ranger == ranger)
        own = np.flatnonzero(free[every] & (pings.range_m[every] < FARTHEST_M))
        which = every[own]
        ranger_rows, of = _spots(pings.at_m[which], pings.axis_rad[which], pings.range_m[which], own)
        of_ping[which] = np.where(of < 0, -1, of + count)
        rows.append(ranger_rows)
        count += len(ranger_rows)
    return np.concatenate(rows), of_ping


@kernel
def _spots(at: Floats, axis: Floats, range_m: Floats, number: Ints) -> tuple[Floats, Ints]:
    """Rows (s, 5) of x, y, axis, range and pings: the middle of each sweep; and the row of each ping (k,), -1: none.

    `number` (k,): which ping of the ranger each is, without gaps where none was lost.
    """
    n = len(range_m)
    rows, of_ping = np.zeros((n // LEAST + 1, 5)), np.full(n, -1, np.int64)
    row_count, begin = 0, 0
    while begin + LEAST <= n:
        total, end = range_m[begin], begin + 1
        while (
            end < n
            and number[end] - number[end - 1] <= MISSED + 1
            and abs(range_m[end] - total / (end - begin)) < FITS_M
            and math.hypot(at[end, 0] - at[begin, 0], at[end, 1] - at[begin, 1]) < SPOT_M
        ):
            total += range_m[end]
            end += 1
        low, high, count = axis[begin:end].min(), axis[begin:end].max(), end - begin
        if count >= LEAST and high - low > SWEEP_RAD:
            rows[row_count, 0], rows[row_count, 1] = at[begin:end, 0].mean(), at[begin:end, 1].mean()
            rows[row_count, 2], rows[row_count, 3], rows[row_count, 4] = 0.5 * (low + high), total / count, count
            of_ping[begin:end] = row_count
            row_count += 1
            begin = end
        else:
            begin += 1
    return rows[:row_count], of_ping
