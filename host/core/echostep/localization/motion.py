# SPDX-License-Identifier: MIT
"""From a measured segment of the path: its move, and its change of height.

In: a `MeasuredSegment`. Out: `Move`, `HeightChange`. Owns the errors of the path that the segment does not state.
"""

from __future__ import annotations

import math
from statistics import median

from echostep.height.levels import HeightChange
from echostep.particles.arrays import Move
from echostep.path import MeasuredSegment, PathSegment

BESIDE_M = 0.05  # of the trunk from a foot on the floor: half of a step's width of 10 cm
HEIGHT_SD_M = 0.3  # of one height by pressure: an SCP1000 in its fast mode, a little worse than in its data sheet
HEIGHT_SAMPLES = 9  # used at the end of a segment: a second
AIR_SD_M = 0.1  # of a height by pressure that more samples do not reduce: draughts


def move_of(segment: PathSegment) -> Move:
    """The segment's way; in a turn the trunk moves around the measured foot."""
    sd_m = math.hypot(segment.sd_m, 2.0 * math.sin(0.5 * abs(segment.turn_rad)) * BESIDE_M)
    return Move(segment.dx_m, segment.dy_m, sd_m, segment.turn_sd_rad, segment.scale_sd, *segment.bend_m)


def height_change(measured: MeasuredSegment, riding_m: float) -> HeightChange:
    """The foot's rise, and the median of the last heights by pressure: a slammed door moves a mean, but not a median."""
    segment, last = measured.segment, measured.height_m[-HEIGHT_SAMPLES:].tolist()
    span_s = segment.t1_s - segment.t0_s
    if not last:
        return HeightChange(segment.rise_m, segment.rise_sd_m, 0.0, math.inf, 0.0, span_s)
    height_sd_m = math.hypot(AIR_SD_M, HEIGHT_SD_M / math.sqrt(len(last)))
    return HeightChange(segment.rise_m, segment.rise_sd_m, median(last), height_sd_m, riding_m, span_s)
