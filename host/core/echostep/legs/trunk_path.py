# SPDX-License-Identifier: MIT
"""The trunk's path from the gyros of one leg and the belt, and the compass.

In: samples of thigh, calf and belt, with the compass where it was read, in blocks. Out: `PathSegment`s, as from the foot. Owns the estimators of
strides and heading, and the latest headings.

Lengths come from `strides`, directions from `heading`, in a walk frame of their own: its x axis is the compass's, or without a compass the wearer's
first heading.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats
from echostep.elementary import cos, sin
from echostep.legs.clipping import ClippingRepair
from echostep.legs.heading import CompassErrors, Heading, HeadingSettings, missing_sd_rad
from echostep.legs.kinematics import USUAL_M, LegLengths
from echostep.legs.stride import Flag, Stride, StrideSettings
from echostep.legs.strides import StrideEstimator
from echostep.path import STANDING_PIECE_S, PathSegment

RANGE_RAD_S = math.radians(300.0)  # of the gyros [ADIS16100 datasheet]
# The source of these values is not recorded.
TURN_SD_RAD = math.radians(0.7)  # growth of the yaw error in a stride, without the part that the compass corrects
# First compass heading in the walk frame, which it defines; later ones show the gyro's bias
FRAME_SD_RAD = math.radians(1.0)
SLOW_RAD_S = math.radians(10.0)  # largest rate of a standing leg, with the gyro's bias
SETTING_OFF_S = 1.0  # duration of the motion in an edge of a walk
SCALE_SD = 0.004  # random walk of the strides' scale per stride
# Sd over the length and turn (rad) of an edge: who turns on the spot before it has taken a stride or none
TURNED_SD = 0.5
CURVE_SD = 0.5  # sd over the shortening of a stride in a curve: the trunk does not turn evenly
TWIST_RAD = math.radians(12.0)  # range of the pelvis' rotation in a straight stride, which does not shorten it
REMEMBERED_S = 12.0  # of headings: longer than any delay of a stride
RECENT_S = 0.3  # delay of the segments of standing


@dataclass(frozen=True, slots=True)
class WearerSettings:
    """`thigh_m`: hip to knee. `shank_m`: knee to ankle. `leg_scale`: factor on all stride lengths, from a walk of known length.

    `leg_left_m`: distance of the leg with the gyros to the left of the trunk (negative: right leg); in a curve the outer leg moves farther.
    """

    thigh_m: float = USUAL_M
    shank_m: float = USUAL_M
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
    """Path segments from blocks of samples; the size of the blocks changes only the time at which a segment is returned."""

    def __init__(self, settings: WearerSettings, iron: CompassErrors | None = None) -> None:
        """`iron`: errors of the compass; None if it was not calibrated."""
        lengths = LegLengths(settings.thigh_m, settings.shank_m, settings.leg_scale)
        self._strides = StrideEstimator(StrideSettings(lengths, calibrated=settings.leg_scale != 1.0))
        limits = np.array([RANGE_RAD_S, RANGE_RAD_S, np.inf])  # of thigh, calf, belt
        self._clipping = ClippingRepair(-limits, limits)
        self._left_m = settings.leg_left_m
        self._heading = Heading(HeadingSettings(iron=iron, first_sd_rad=FRAME_SD_RAD))
        self._headings: deque[tuple[float, float]] = deque()  # t_s, heading not wrapped
        self._covered_s = -math.inf  # end of the last segment
        self._begun = False  # whether there was a stride
        self.steps = 0

    def feed(self, block: GyroBlock) -> list[PathSegment]:
        """Segments completed by a block, in order of time."""
        still = (np.abs(block.thigh) < SLOW_RAD_S) & (np.abs(block.calf) < SLOW_RAD_S)
        headings = self._heading.feed(block.t_s, block.belt, block.compass, still)
        self._headings.extend(zip(block.t_s.tolist(), headings[:, 0].tolist(), strict=True))
        while self._headings and self._headings[0][0] < block.t_s[-1] - REMEMBERED_S:
            self._headings.popleft()
        t_s, rates = self._clipping.feed(block.t_s, np.column_stack([block.thigh, block.calf, block.belt]))
        strides = self._strides.feed(t_s, rates[:, 0], rates[:, 1], rates[:, 2])
        segments = [segment for stride in strides if (segment := self._stride_segment(stride)) is not None]
        since_s = self._strides.standing_since_s
        until_s = float(block.t_s[-1]) - RECENT_S
        if since_s is not None and until_s - max(self._covered_s, since_s) >= STANDING_PIECE_S:
            segments.append(self._standing_segment(max(self._covered_s, since_s), until_s))
        return segments

    @property
    def remembered_s(self) -> float:
        """Time of the oldest heading remembered since the newest gap; infinite without any."""
        return max(self._headings[0][0], self._heading.unbroken_s) if self._headings else math.inf

    def heading_rad(self, t_s: float) -> float:
        """Heading of the trunk (not wrapped) at a time since `remembered_s`, interpolated."""
        times, headings = zip(*self._headings, strict=True)
        return float(np.interp(t_s, times, headings))

    def unseen_sd_rad(self, t_s: float) -> float:
        """How far the trunk may have turned, 1 sd, between a time and the nearest sample."""
        times = np.array([t for t, _ in self._headings])
        return missing_sd_rad(float(np.abs(times - t_s).min()))

    def _stride_segment(self, stride: Stride) -> PathSegment | None:
        """The segment of a stride, without the time already covered by standing; None when nothing is left."""
        t0, t1 = max(stride.t_start_s, self._covered_s), stride.t_end_s
        if t1 <= t0:
            return None
        share = (t1 - t0) / (stride.t_end_s - stride.t_start_s)
        self._covered_s = t1
        standing = Flag.STANDING in stride.flags
        self.steps += 0 if standing else 1
        # No displacement before it: the wearer may turn on the spot
        edge, turn_rad = Flag.EDGE in stride.flags, self.heading_rad(t1) - self.heading_rad(t0)
        begun = t1 - SETTING_OFF_S if edge else t0
        ahead, aside = self._direction(max(t0, begun), t1)
        length = share * stride.length_m
        turned_sd = TURNED_SD * length * abs(turn_rad) if edge else 0.0
        if not edge and length > 0.0:
            length = max(length + self._left_m * turn_rad, 0.0)
        scale_sd = 0.0 if standing else SCALE_SD if self._begun else stride.scale_sd
        self._begun = self._begun or not standing
        sd = math.hypot(stride.length_sd_m, CURVE_SD * length * (1.0 - math.hypot(ahead, aside)), turned_sd)
        unseen_rad = missing_sd_rad(t1 - t0) if Flag.GAP in stride.flags else 0.0
        turn_sd = math.hypot(TURN_SD_RAD, self._heading.bias_sd_rad_s * (t1 - t0), unseen_rad)
        return PathSegment(
            t0, t1, length * ahead, length * aside,
            self.heading_rad(t0), self.heading_rad(t1), sd, 0.0 if standing else turn_sd, self.steps,
            scale_sd=scale_sd,
        )  # fmt: skip

    def _standing_segment(self, t0: float, t1: float) -> PathSegment:
        """The segment of standing from t0 to t1."""
        self._covered_s = t1
        return PathSegment(t0, t1, 0.0, 0.0, self.heading_rad(t0), self.heading_rad(t1), 0.0, 0.0, self.steps)

    def _direction(self, t0: float, t1: float) -> tuple[float, float]:
        """Mean of (cos, sin) of the headings from t0 to t1: displacement per metre at an even pace, shorter than 1 in a curve.

        The rotation of the pelvis to and fro does not count as a curve.
        """
        times, headings = (np.array(column) for column in zip(*self._headings, strict=True))
        within = headings[(times >= t0) & (times <= t1)]
        if not len(within):
            within = np.array([self.heading_rad(0.5 * (t0 + t1))])
        twist = cos(within - within.mean()).mean() if np.ptp(within) < TWIST_RAD else 1.0
        return float(cos(within).mean() / twist), float(sin(within).mean() / twist)


def segment_after(segment: PathSegment, from_s: float) -> PathSegment:
    """The part of a segment from a time on."""
    if from_s <= segment.t0_s:
        return segment
    share = (segment.t1_s - from_s) / (segment.t1_s - segment.t0_s)
    return replace(
        segment, t0_s=from_s, dx_m=share * segment.dx_m, dy_m=share * segment.dy_m, heading0_rad=segment.heading_rad(from_s),
        sd_m=math.sqrt(share) * segment.sd_m, turn_sd_rad=math.sqrt(share) * segment.turn_sd_rad, rise_m=share * segment.rise_m,
    )  # fmt: skip


def rotated_segment(segment: PathSegment, angle_rad: float, scale: float = 1.0) -> PathSegment:
    """The segment rotated by an angle about z and scaled, as seen in another walk frame."""
    if angle_rad == 0.0 and scale == 1.0:
        return segment
    c, s = scale * math.cos(angle_rad), scale * math.sin(angle_rad)
    return replace(
        segment, dx_m=c * segment.dx_m - s * segment.dy_m, dy_m=s * segment.dx_m + c * segment.dy_m,
        heading0_rad=segment.heading0_rad + angle_rad, heading1_rad=segment.heading1_rad + angle_rad,
    )  # fmt: skip
