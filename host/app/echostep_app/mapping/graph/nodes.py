# SPDX-License-Identifier: MIT
"""The path of a walk as nodes of a graph: one where each segment that moves or turns ends, and the pings between.

In: `MeasuredSegment`s in order of time. Out: `Nodes`, `Pings`. Owns nothing. Frame: walk.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.path import MeasuredSegment

STILL_M, STILL_RAD = 0.01, math.radians(0.5)  # a segment that moves and turns less belongs to the node before it
# Growth of the path's error per square root of a metre beside the step's own covariance, as the particle filter has it [particles.py]
MOVE_SD, TURN_SD_RAD = 0.03, math.radians(0.3)
# The same for a heading that a belt's gyro holds: in all 0.25 degrees, as simulated walks err over 5 to 50 m; two belts of one walk differ by 0.15
HELD_TURN_SD_RAD = math.radians(0.2)
LEAST_SD_M = 0.005  # of a turn on the spot: the trunk moves over the foot


@dataclass(frozen=True, slots=True)
class Nodes:
    """`t_s` (n,), `pose` (n, 3): x, y, heading by odometry; standard deviations (n - 1,) of the way from each node to the next.

    `way_m` (n,): length of the path so far.
    """

    t_s: Floats
    pose: Floats
    sd_m: Floats
    turn_sd_rad: Floats
    way_m: Floats

    def __len__(self) -> int:
        return len(self.t_s)


@dataclass(frozen=True, slots=True)
class Pings:
    """Pings (k,): place `at_m` (k, 2) and `axis_rad` by odometry, `range_m` (NaN: no echo), ranger with its axis from the trunk's heading, and the
    node before each with the share of the way to the next.
    """

    at_m: Floats
    axis_rad: Floats
    range_m: Floats
    ranger: Ints
    off_heading_rad: Floats
    node: Ints
    share: Floats


def nodes_of(segments: Sequence[MeasuredSegment]) -> tuple[Nodes, Pings]:
    """Nodes and pings of a walk; the first node is the origin of the walk frame."""
    first = segments[0].segment
    rows = [(first.t0_s, 0.0, 0.0, first.heading0_rad, 0.0)]
    sds: list[tuple[float, float]] = []
    pings: list[Floats] = []
    for measured in segments:
        s = measured.segment
        length, turn = math.hypot(s.dx_m, s.dy_m), s.turn_rad
        _, x, y, heading, way = rows[-1]
        moves = length > STILL_M or abs(turn) > STILL_RAD
        span_s = s.t1_s - s.t0_s
        share = np.clip((measured.t_s - s.t0_s) / span_s, 0.0, 1.0) if span_s > 0.0 and moves else 0.0 * measured.t_s
        along = share if moves else 0.0 * share
        off = measured.off_heading_rad
        axis = heading + along * turn + off
        at_x, at_y = x + along * s.dx_m, y + along * s.dy_m
        node = np.full(len(share), len(rows) - 1)
        pings.append(np.column_stack([at_x, at_y, axis, measured.range_m, measured.ranger, off, node, along]))
        if moves:
            rows.append((s.t1_s, x + s.dx_m, y + s.dy_m, heading + turn, way + length))
            held = s.belt is not None and s.turn_sd_rad < s.belt.foot_turn_sd_rad  # the belt measured its turn
            growth = (HELD_TURN_SD_RAD if held else TURN_SD_RAD) * math.sqrt(length)
            move_sd_m = math.hypot(s.sd_m, LEAST_SD_M, MOVE_SD * math.sqrt(length))
            sds.append((move_sd_m, math.hypot(s.turn_sd_rad, growth)))
    table, sd, ping = np.array(rows), np.array(sds).reshape(-1, 2), np.concatenate(pings)
    nodes = Nodes(table[:, 0], table[:, 1:4].copy(), sd[:, 0], sd[:, 1], table[:, 4])
    axis, range_m, ranger, off, node, share = ping[:, 2:].T.copy()
    return nodes, Pings(ping[:, :2].copy(), axis, range_m, ranger.astype(np.int64), off, node.astype(np.int64), share)


def rotated(points: Floats, angle_rad: Floats) -> Floats:
    """Points (n, 2), each turned by its own angle (n,)."""
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    x, y = points.T
    return np.column_stack([c * x - s * y, s * x + c * y])
