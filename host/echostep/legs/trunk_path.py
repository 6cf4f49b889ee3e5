"""The trunk's path from the gyros of one leg and the belt, and the compass.

In: samples of thigh, calf and belt, with the compass where it was read, in blocks. Out: `gait.Leg`s, as the foot's path gives them. Owns the strides'
and the heading's estimators.

Lengths come from `legs`, directions from `heading`, both in a walk frame of their own: x is where the compass, or the wearer at first, points.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats
from echostep.legs.clipping import ClippingRepair
from echostep.legs.heading import CompassErrors, Heading, HeadingSettings
from echostep.legs.kinematics import LegLengths
from echostep.legs.stride import Flag, Stride, StrideSettings
from echostep.legs.strides import StrideEstimator
from echostep.path import STANDING_PIECE_S, PathSegment

TURN_SD_RAD = math.radians(0.7)  # in a stride, beside what the compass takes away again
FRAME_SD_RAD = math.radians(
    1.0
)  # of the walk frame, which is where the compass pointed at first: what it says later tells the gyro's bias
RANGE_RAD_S = math.radians(300.0)  # [ADIS16100 datasheet]
SLOW_RAD_S = math.radians(10.0)  # of a leg that stands, with its gyro's bias
SETTING_OFF_S = 1.0  # the first step
SCALE_SD = 0.004  # by which the scale of strides wanders from one to the next
CURVE_SD = 0.5  # of what a curve takes from a stride's length: he does not turn evenly
TWIST_RAD = math.radians(12.0)  # so far the pelvis turns to and fro in a straight stride, which costs no way
REMEMBERED_S = 12.0  # of headings: longer than any stride waits to be told
RECENT_S = 0.3  # who stands is told of so much later


@dataclass(frozen=True, slots=True)
class WearerSettings:
    """Hip to knee and knee to ankle of the wearer; `leg_scale`: how much longer his strides are than these tell, from a walk of known length.

    `leg_left_m`: where the leg with the gyros swings, to the left of the trunk (negative: the right leg); in a curve the outer leg goes farther.
    """

    thigh_m: float = 0.43
    shank_m: float = 0.43
    leg_scale: float = 1.0
    leg_left_m: float = -0.09


class GyroBlock(NamedTuple):
    """Samples (n,): time, rates of thigh, calf and belt (rad/s), compass heading (rad, counter-clockwise; NaN: not read)."""

    t_s: Floats
    thigh: Floats
    calf: Floats
    belt: Floats
    compass: Floats


class LegPath:
    """Feed it blocks of samples; what comes out does not depend on their size, but for when it comes."""

    def __init__(self, settings: WearerSettings, iron: CompassErrors | None = None) -> None:
        """`iron`: the compass', when it was calibrated."""
        segments = LegLengths(settings.thigh_m, settings.shank_m, settings.leg_scale)
        self._legs = StrideEstimator(StrideSettings(segments, calibrated=settings.leg_scale != 1.0))
        self._unclipped = ClippingRepair(np.full(2, -RANGE_RAD_S), np.full(2, RANGE_RAD_S))
        self._left_m = settings.leg_left_m
        self._heading = Heading(HeadingSettings(iron=iron, first_sd_rad=FRAME_SD_RAD))
        self._headings: deque[tuple[float, float]] = deque()  # t_s, heading not wrapped
        self._told_s = -math.inf  # up to where legs were told
        self._begun = False
        self.steps = 0

    def feed(self, block: GyroBlock) -> list[PathSegment]:
        """The legs that a block makes certain, in order of time, without gaps once the first is told."""
        still = (np.abs(block.thigh) < SLOW_RAD_S) & (np.abs(block.calf) < SLOW_RAD_S)
        found = self._heading.feed(block.t_s, block.belt, block.compass, still)
        self._headings.extend(zip(block.t_s.tolist(), found[:, 0].tolist(), strict=True))
        while self._headings and self._headings[0][0] < block.t_s[-1] - REMEMBERED_S:
            self._headings.popleft()
        t_s, rates = self._unclipped.feed(block.t_s, np.column_stack([block.thigh, block.calf]))
        told = [self._leg(stride) for stride in self._legs.feed(t_s, rates[:, 0], rates[:, 1])]
        legs = [leg for leg in told if leg is not None]
        since_s = self._legs.standing_since_s
        until_s = float(block.t_s[-1]) - RECENT_S
        if since_s is not None and until_s - max(self._told_s, since_s) >= STANDING_PIECE_S:
            legs.append(self._stay(max(self._told_s, since_s), until_s))
        return legs

    @property
    def remembered_s(self) -> float:
        """Since when headings are."""
        return self._headings[0][0] if self._headings else math.inf

    def heading_rad(self, t_s: float) -> float:
        """Heading of the trunk at a time not long ago."""
        times, headings = zip(*self._headings, strict=True)
        return float(np.interp(t_s, times, headings))

    def _leg(self, stride: Stride) -> PathSegment | None:
        """A stride as a leg; what of it was told as standing is left out."""
        t0, t1 = max(stride.t_start_s, self._told_s), stride.t_end_s
        if t1 <= t0:
            return None
        share = (t1 - t0) / (stride.t_end_s - stride.t_start_s)
        self._told_s = t1
        standing = Flag.STANDING in stride.flags
        self.steps += 0 if standing else 1
        begun = t1 - SETTING_OFF_S if Flag.EDGE in stride.flags else t0  # who turns on the spot goes nowhere before
        ahead, aside = self._direction(max(t0, begun), t1)
        length = share * stride.length_m
        if Flag.EDGE not in stride.flags and length > 0.0:
            length = max(length + self._left_m * (self.heading_rad(t1) - self.heading_rad(t0)), 0.0)
        scale_sd = 0.0 if standing else SCALE_SD if self._begun else stride.scale_sd
        self._begun = self._begun or not standing
        sd = math.hypot(stride.length_sd_m, CURVE_SD * length * (1.0 - math.hypot(ahead, aside)))
        turn_sd = math.hypot(TURN_SD_RAD, self._heading.bias_sd_rad_s * (t1 - t0))
        return PathSegment(
            t0, t1, length * ahead, length * aside,
            self.heading_rad(t0), self.heading_rad(t1), sd, 0.0 if standing else turn_sd, self.steps,
            scale_sd=scale_sd,
        )  # fmt: skip

    def _stay(self, t0: float, t1: float) -> PathSegment:
        self._told_s = t1
        return PathSegment(t0, t1, 0.0, 0.0, self.heading_rad(t0), self.heading_rad(t1), 0.0, 0.0, self.steps)

    def _direction(self, t0: float, t1: float) -> tuple[float, float]:
        """Where an even pace along the headings of a stride leads, per metre: less far in a curve; the pelvis twists to and fro in it."""
        times, headings = (np.array(column) for column in zip(*self._headings, strict=True))
        within = headings[(times >= t0) & (times <= t1)]
        if not len(within):
            within = np.array([self.heading_rad(0.5 * (t0 + t1))])
        twist = np.cos(within - within.mean()).mean() if np.ptp(within) < TWIST_RAD else 1.0
        return float(np.cos(within).mean() / twist), float(np.sin(within).mean() / twist)


def segment_after(leg: PathSegment, from_s: float) -> PathSegment:
    """What is left of a leg from a time on."""
    if from_s <= leg.t0_s:
        return leg
    share = (leg.t1_s - from_s) / (leg.t1_s - leg.t0_s)
    return PathSegment(
        from_s, leg.t1_s, share * leg.dx_m, share * leg.dy_m, leg.heading_rad(from_s), leg.heading1_rad,
        math.sqrt(share) * leg.sd_m, math.sqrt(share) * leg.turn_sd_rad, leg.step, leg.anchor_sd_m,
        share * leg.rise_m, leg.rise_sd_m, leg.scale_sd,
    )  # fmt: skip


def rotated_segment(leg: PathSegment, angle_rad: float, scale: float = 1.0) -> PathSegment:
    """The same leg in a walk frame that is rotated_segment by an angle against its own, and longer."""
    if angle_rad == 0.0 and scale == 1.0:
        return leg
    c, s = scale * math.cos(angle_rad), scale * math.sin(angle_rad)
    return PathSegment(
        leg.t0_s, leg.t1_s, c * leg.dx_m - s * leg.dy_m, s * leg.dx_m + c * leg.dy_m,
        leg.heading0_rad + angle_rad, leg.heading1_rad + angle_rad, leg.sd_m, leg.turn_sd_rad, leg.step,
        leg.anchor_sd_m, leg.rise_m, leg.rise_sd_m, leg.scale_sd,
    )  # fmt: skip
