# SPDX-License-Identifier: MIT
"""From a measured segment of the path: its move, its change of height, and gaps after which the wearer may be elsewhere.

In: `MeasuredSegment`s in order of time. Out: `Move`, `HeightChange`, the kind of gap that ends with a segment. Owns the errors of the path that the
segment does not state, and the time of the last segment.
"""

from __future__ import annotations

import math
from enum import Enum, auto
from statistics import median

from echostep.height.levels import HeightChange
from echostep.particles.arrays import Move
from echostep.path import MeasuredSegment, PathSegment

BESIDE_M = 0.05  # of the trunk from a foot on the floor: half of a step's width of 10 cm
HEIGHT_SD_M = 0.3  # of one height by pressure: an SCP1000 in its fast mode, a little worse than in its data sheet
HEIGHT_SAMPLES = 9  # used at the end of a segment: a second
AIR_SD_M = 0.1  # of a height by pressure that more samples do not reduce: draughts
# Assumed, not measured.
PAUSE_S = 1.0  # between two segments: nothing was received
LONG_S = 5.0  # of an unobserved segment: a walk out of the room


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


class Gap(Enum):
    """`PAUSE`: nothing came; `UNOBSERVED`: the foot was silent for a long time."""

    PAUSE = auto()
    UNOBSERVED = auto()


class Gaps:
    """Detects gaps between the segments of one walk."""

    def __init__(self) -> None:
        self.pause_s = 0.0  # between the last two segments
        self._end_s = math.inf  # of the last segment

    def ended(self, measured: MeasuredSegment) -> Gap | None:
        """The gap that this segment ends, or that is known by its end."""
        segment = measured.segment
        self.pause_s = max(segment.t0_s - self._end_s, 0.0)
        self._end_s = segment.t1_s
        if segment.unobserved:
            return Gap.UNOBSERVED if segment.t1_s - segment.t0_s > LONG_S else None
        return Gap.PAUSE if self.pause_s > PAUSE_S else None
