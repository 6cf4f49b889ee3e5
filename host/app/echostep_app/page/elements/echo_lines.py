# SPDX-License-Identifier: MIT
"""Echo lines: the last measured range of each ranger, and the range that the plan predicts.

In: a measured segment, the estimate at its end, the walls. Out: `EchoLine`s in the map frame. Owns nothing. It reads only wall tiles that the filter
has already loaded.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from echostep.echoes.likelihood import EchoModel, likeliest_source
from echostep.jit import kernel
from echostep.localization import Estimate
from echostep.path import MeasuredSegment
from echostep.walls.echo_sources import Walls, echo_sources, one_receiver
from echostep.walls.index import WallIndex


@dataclass(frozen=True, slots=True)
class EchoLine:
    """A ping sent at `t_s` from (x_m, y_m) along `axis_rad` (map frame). None: no echo came, or none is expected.

    The field names are keys of the frame's JSON. `ranger`: 0 left, 1 right.
    """

    t_s: float
    ranger: int
    x_m: float
    y_m: float
    axis_rad: float
    measured_m: float | None
    expected_m: float | None


def last_echo_lines(
    measured: MeasuredSegment, estimate: Estimate, east_m: float, walls: Walls, model: EchoModel
) -> tuple[EchoLine, ...]:
    """The last ping of each ranger on a measured segment, at the pose that the estimate gives for the time of the ping.

    `east_m`: how far the estimate's level is shifted to the east on the sheet of walls.
    """
    lines = []
    for ranger in (0, 1):
        rows = np.flatnonzero(measured.ranger == ranger)
        if not len(rows):
            continue
        ping_s, range_m = float(measured.t_s[rows[-1]]), float(measured.range_m[rows[-1]])
        x, y, heading_rad = _trunk_pose(measured, estimate, ping_s)
        axis = heading_rad + float(measured.off_heading_rad[rows[-1]])
        index = walls.near(np.array([x + east_m]), np.array([y]))
        expected = expected_range(x + east_m, y, axis, index, model)
        ranges = (None if math.isnan(v) else float(v) for v in (range_m, expected))
        lines.append(EchoLine(ping_s, ranger, x, y, axis, *ranges))
    return tuple(lines)


def _trunk_pose(measured: MeasuredSegment, estimate: Estimate, t_s: float) -> tuple[float, float, float]:
    """Position and heading of the trunk at `t_s`, in the map: the estimate moved back along its segment."""
    segment = measured.segment
    turn = estimate.heading_rad - segment.heading1_rad  # from the segment's frame to the map
    span_s = segment.t1_s - segment.t0_s
    share = min(max((t_s - segment.t0_s) / span_s, 0.0), 1.0) if span_s > 0.0 else 1.0
    way_x, way_y = segment.way_m(share)
    back_x, back_y, c, s = segment.dx_m - way_x, segment.dy_m - way_y, math.cos(turn), math.sin(turn)
    x = estimate.x_m - (c * back_x - s * back_y)
    y = estimate.y_m - (s * back_x + c * back_y)
    return x, y, turn + segment.heading0_rad + share * segment.turn_rad


@kernel
def expected_range(x: float, y: float, axis_rad: float, index: WallIndex, model: EchoModel) -> float:
    """Range of the likeliest first echo at a pose; NaN when it is likelier that no echo comes."""
    block, distance_m, off_axis_rad, kind = one_receiver()
    count = echo_sources(x, y, axis_rad, index, block)
    first, answers, unheard = likeliest_source(count, distance_m, off_axis_rad, kind, model)
    return distance_m[first] if answers > unheard else np.nan
