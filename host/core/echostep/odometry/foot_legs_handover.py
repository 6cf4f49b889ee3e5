# SPDX-License-Identifier: MIT
"""Handover between foot and leg odometry: one path of the trunk from both.

In: segments of the foot's path and blocks of leg gyro samples, in order of their messages. Out: `PathSegment`s of one walk frame, without overlap.
Owns which of the two is active, and the rotation and scale from each source's frame into the common one.

The foot's path is several times as accurate, so the foot is active while its samples come. The leg samples of the last KEPT_S are kept:

    foot falls silent   the kept samples are processed. Where both paths overlap in time, the foot's path gives the legs' scale and rotation, and
                        decides whether leg gyros are worn at all. If so, the legs are active.
    foot comes back     its segments wait for a straight stride, where foot and trunk point the same way, and for the legs to reach its time. Then the
                        foot is active again, rotated to the legs' heading there.
    foot lies still     and the leg swings: the sensor is not worn, and counts as silent since it stood. The legs go on from there.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable
from dataclasses import replace

from echostep.elementary import wrap
from echostep.legs.heading import CompassErrors
from echostep.legs.trunk_path import GyroBlock, LegPath, WearerSettings, rotated_segment, segment_after
from echostep.path import UNOBSERVED_SD_M, PathSegment

# Assumed, not measured, unless a source is named.
SILENT_S = 0.5  # the foot is silent when its newest sample is older than the leg samples by this
KEPT_S = 30.0  # of leg samples and foot segments
MAX_LENGTH_ERROR = 0.35  # share by which the legs' length may differ from the foot's; beyond it no leg gyros are worn
MIN_OVERLAP_M = 3.0  # of the foot's path, to compare lengths
ALIGNED_SD = 0.025  # of the scale that the foot gives: a person's scale changes by 2 to 3 % with speed
STRIDES_SD = 0.05  # of the same scale, divided by the root of the path (m) that gives it: 0.06 m a stride of 1.4 m
REJOIN_SD_RAD = math.radians(2.0)  # of the angle between foot and legs where the foot takes over
BRIDGE_M_S, BRIDGE_M = 0.4, 1.5  # standard deviation of an unobserved gap: per second, and at most
BRIEF_S = 1.0  # a longer gap counts as unobserved
STRAIGHT_M, STRAIGHT_RAD = 0.5, math.radians(20.0)  # a straight stride is longer and turns less
CATCH_UP_S = 4.0  # longest time for which the foot's segments wait for the legs
# Mean rates of thigh and calf (rad/s) in walking, and of a leg that stands: each with an exponential density. Tenths of a second that are alike;
# log-odds before any sample of a stand that its sensor is not worn
SWINGS_RAD_S, STANDS_RAD_S, ALIKE, NOT_WORN = 2.0, 0.3, 5.0, math.log(1e-4)


class FootLegsHandover:
    """Call `add_foot_segments` and `add_leg_block` in order of the messages; both return the segments that are certain."""

    def __init__(self, settings: WearerSettings, iron: CompassErrors | None = None) -> None:
        """`iron`: errors of the compass, when it was calibrated."""
        self._settings, self._iron = settings, iron
        self._leg_path: LegPath | None = None  # while the legs are active
        self._kept_blocks: deque[GyroBlock] = deque()
        self._kept_segments: deque[PathSegment] = deque()  # of the foot, over the same time as the kept blocks
        self._returned: list[PathSegment] = []  # of the foot that came back, not yet active
        self._covered_s = -math.inf  # end of the common path
        self._foot_turn_rad = self._leg_turn_rad = 0.0  # rotation of each source's frame into the common walk frame
        self._leg_scale = 1.0
        self._compared_m = (0.0, 0.0)  # path measured by both, foot and legs, over all dropouts
        self._foot_seen = False
        self._log_odds = NOT_WORN  # of a sensor that is not worn, in this stand
        self._step = 0  # of the last segment
        self._step_base: int | None = 0  # added to the active source's own count; None until its next segment

    @property
    def legs_observed_s(self) -> float:
        """Time of the newest leg sample while the legs are active, else minus infinity."""
        return float(self._kept_blocks[-1].t_s[-1]) if self._leg_path is not None else -math.inf

    @property
    def is_foot_worn(self) -> bool:
        """False while the foot stands and the leg swings."""
        return self._log_odds < 0.0

    def add_foot_segments(self, segments: list[PathSegment]) -> list[PathSegment]:
        """Segments of the foot's path, in the foot's frame."""
        self._foot_seen = self._foot_seen or bool(segments)
        if not self.is_foot_worn:
            return []
        if self._leg_path is not None:
            self._returned += segments
            return self._return_to_foot()
        self._kept_segments.extend(segments)
        while self._kept_segments and self._kept_segments[0].t1_s < self._kept_segments[-1].t1_s - KEPT_S:
            self._kept_segments.popleft()
        return [self._append(segment, self._foot_turn_rad) for segment in segments]

    def add_leg_block(self, block: GyroBlock, foot_newest_s: float, *, foot_stands: bool = False) -> list[PathSegment]:
        """A block of leg samples; `foot_newest_s`: time of the foot's newest sample, NaN before the first."""
        now_s, was_worn = float(block.t_s[-1]), self.is_foot_worn
        is_silent = not now_s - foot_newest_s < SILENT_S  # true before the first sample, too
        self._compare(block, foot_stands=foot_stands and not is_silent)
        self._kept_blocks.append(block)
        while self._kept_blocks[0].t_s[-1] < now_s - KEPT_S:
            self._kept_blocks.popleft()
        if self._leg_path is not None:
            return self._append_leg_segments(self._leg_path.feed(block)) + self._return_to_foot()
        if was_worn and not self.is_foot_worn:  # the foot's path ends where its last stand began
            while self._kept_segments and self._kept_segments[-1].dx_m == self._kept_segments[-1].dy_m == 0.0:
                self._kept_segments.pop()
            self._covered_s = self._kept_segments[-1].t1_s if self._kept_segments else self._covered_s
        elif not is_silent and self.is_foot_worn:
            return []
        return self._switch_to_legs()

    def _compare(self, block: GyroBlock, *, foot_stands: bool) -> None:
        """Update the odds that the sensor which stands is not worn; a foot that moves is."""
        rate = float((abs(block.thigh) + abs(block.calf)).sum()) / (2 * len(block.t_s))
        gain = math.log(STANDS_RAD_S / SWINGS_RAD_S) + rate * (1.0 / STANDS_RAD_S - 1.0 / SWINGS_RAD_S)
        gain = gain / ALIKE if rate < math.inf else 0.0  # not a number: no leg gyro
        self._log_odds = max(self._log_odds + gain, NOT_WORN) if foot_stands else NOT_WORN

    def _switch_to_legs(self) -> list[PathSegment]:
        """Process the kept leg samples; the legs become active if leg gyros are worn."""
        if self._foot_seen and not self._kept_segments:
            return []
        path = LegPath(self._settings, self._iron)
        leg_segments = [segment for block in self._kept_blocks for segment in path.feed(block)]
        if self._foot_seen and not self._align_legs(path, leg_segments):
            self._kept_segments.clear()  # no further attempt until the foot has given new segments
            return []
        self._leg_path, self._step_base = path, None
        return self._append_leg_segments(leg_segments)

    def _align_legs(self, path: LegPath, leg_segments: list[PathSegment]) -> bool:
        """Set the legs' scale and rotation from the foot over the strides that both measured; False when their lengths disagree."""
        begin_s, end_s = self._kept_segments[0].t0_s, self._kept_segments[-1].t1_s
        # A stride that the legs did not see has no length, but a deviation
        seen = (s for s in leg_segments if s.sd_m <= math.hypot(s.dx_m, s.dy_m))
        spans = [(max(s.t0_s, begin_s), min(s.t1_s, end_s)) for s in seen]
        foot_m, legs_m = (sum(_length_m(each, *at) for at in spans) for each in (self._kept_segments, leg_segments))
        if foot_m < MIN_OVERLAP_M:
            if self._compared_m[0] == 0.0:  # in no earlier dropout either
                return False
        elif not abs(legs_m / foot_m - 1.0) < MAX_LENGTH_ERROR:
            return False
        self._compared_m = (self._compared_m[0] + foot_m, self._compared_m[1] + legs_m)
        self._leg_scale = self._compared_m[0] / self._compared_m[1]
        remembered = (s for s in self._kept_segments if _is_straight(s) and s.t1_s >= path.remembered_s)
        straight = list(remembered) or [self._kept_segments[-1]]
        turns = [segment.heading1_rad - path.heading_rad(segment.t1_s) for segment in straight]
        mean = math.atan2(sum(math.sin(a) for a in turns), sum(math.cos(a) for a in turns))
        self._leg_turn_rad = wrap(mean + self._foot_turn_rad)
        return True

    def _append_leg_segments(self, segments: list[PathSegment]) -> list[PathSegment]:
        """The legs' segments beyond the end of the common path, scaled and rotated."""
        return [self._append(self._as_common(segment), 0.0) for segment in segments if segment.t1_s > self._covered_s]

    def _as_common(self, segment: PathSegment) -> PathSegment:
        """A segment of the legs in the common frame; once the foot has given the scale, its error is at most the foot's."""
        scaled = rotated_segment(segment, self._leg_turn_rad, self._leg_scale)
        if self._compared_m[0] == 0.0:
            return scaled
        sd = math.hypot(ALIGNED_SD, STRIDES_SD / math.sqrt(self._compared_m[0]))
        return replace(scaled, scale_sd=min(scaled.scale_sd, sd))

    def _return_to_foot(self) -> list[PathSegment]:
        """Make the foot active again at its first straight stride, once the legs have reached it or CATCH_UP_S is over."""
        assert self._leg_path is not None
        empty = self._covered_s == -math.inf  # the legs have given no segment
        if not empty:
            late = (k for k, s in enumerate(self._returned) if _is_straight(s) and s.t1_s > self._covered_s)
            del self._returned[: next(late, len(self._returned))]
        if not self._returned:
            return []
        first = self._returned[0]
        if first.t0_s > self._covered_s and self._returned[-1].t1_s < self._covered_s + CATCH_UP_S:
            return []
        if not empty:
            join_s = max(first.t0_s, self._covered_s)
            self._foot_turn_rad = wrap(
                self._leg_path.heading_rad(join_s) + self._leg_turn_rad - first.heading_rad(join_s)
            )
            self._returned[0] = replace(first, turn_sd_rad=math.hypot(first.turn_sd_rad, REJOIN_SD_RAD))
        segments, self._returned = [*self._bridge(first), *self._returned], []
        self._leg_path, self._step_base = None, None
        self._kept_segments.clear()
        self._kept_segments.extend(segments)
        return [self._append(segment, self._foot_turn_rad) for segment in segments]

    def _bridge(self, first: PathSegment) -> list[PathSegment]:
        """A segment without displacement over the gap between the legs' end and the foot's first segment, in the foot's frame; none without a gap."""
        if not -math.inf < self._covered_s < first.t0_s:
            return []
        assert self._leg_path is not None
        span_s = first.t0_s - self._covered_s
        sd_m = min(BRIDGE_M_S * span_s, BRIDGE_M)
        if span_s > BRIEF_S:
            sd_m = max(sd_m, 1.01 * UNOBSERVED_SD_M)  # makes the segment an unobserved one
        heading_rad = self._leg_path.heading_rad(self._covered_s) + self._leg_turn_rad - self._foot_turn_rad
        turn_sd = self._leg_path.unseen_sd_rad(first.t0_s)
        return [
            PathSegment(
                self._covered_s, first.t0_s, 0.0, 0.0, heading_rad, first.heading0_rad, sd_m, turn_sd, first.step
            )
        ]

    def _append(self, segment: PathSegment, turn_rad: float) -> PathSegment:
        """The part of a segment beyond the end of the common path, rotated into its frame, with the common step count."""
        if self._step_base is None:
            self._step_base = self._step + 1 - segment.step
        self._step = segment.step + self._step_base
        segment = rotated_segment(segment_after(segment, self._covered_s), turn_rad)
        self._covered_s = max(self._covered_s, segment.t1_s)
        return segment if segment.step == self._step else replace(segment, step=self._step)


def _is_straight(segment: PathSegment) -> bool:
    """Whether a segment is an observed straight stride."""
    is_long = math.hypot(segment.dx_m, segment.dy_m) > STRAIGHT_M
    return is_long and not segment.unobserved and abs(segment.turn_rad) < STRAIGHT_RAD


def _length_m(segments: Iterable[PathSegment], begin_s: float, end_s: float) -> float:
    """Length of the path between two times."""
    total_m = 0.0
    for segment in segments:
        t0, t1 = max(segment.t0_s, begin_s), min(segment.t1_s, end_s)
        if t1 > t0:
            total_m += math.hypot(segment.dx_m, segment.dy_m) * (t1 - t0) / (segment.t1_s - segment.t0_s)
    return total_m
