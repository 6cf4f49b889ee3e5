# SPDX-License-Identifier: MIT
"""The trunk's path from the steps and stances of one foot.

In: `Step` and `Stance` of one foot (walk frame). Out: `PathSegment`s: pieces of the trunk's path between anchors. Owns the last anchor.

The trunk passes over the foot in the middle of the stance [Perry 1992, mid stance]; between two such moments it moves evenly.
While the wearer stands, the trunk stays over the foot, except for half a usual stance at either end.
An anchor is the trunk's time, position and heading at such a moment.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace
from statistics import median

import numpy as np

from echostep.arrays import Floats
from echostep.elementary import wrap
from echostep.foot.steps import Stance, Step
from echostep.foot.zupt_ins import GAP_S
from echostep.path import STANDING_PIECE_S, PathSegment

# The source of these limits is not recorded.
HALVES, RUN_HALVES = 7, 3  # stances whose median duration counts, walking and running: a gap may cut one off
STANDING_S = 0.8  # duration of a stance; longer ones are standing
LONGEST_HALF_S = 0.35
REACH_M = 0.4  # of a leg, ahead of the trunk: half a long step
MIDDLE_SD_S = 0.03  # assumed, of the time at which the trunk is over the foot: in a walk `GaitSettings.anchor_sd_m`
RUN_STANCE_S = 0.12  # assumed; a walking foot is still for 0.2 to 0.5 s, a running one for 0.04 to 0.1 s
RUN_MEMORY = 2  # stances of which the briefest decides whether the foot runs: a turn within a run takes longer, assumed
STRAIGHT_STEP_M = 0.6  # least length of a step that shows the direction of travel
STRAIGHT_STEP_RAD = math.radians(15.0)  # largest turn of such a step
FORWARD_RAD = math.radians(45.0)  # largest angle of a forward step to the toe
KNOWN_SCALE_SD = 0.01  # in which any foot's lengths differ: `CloudSettings.start_scale_sd`
TOE_MEMORY = 20  # steps that the mean of the toe angle remembers
ALOFT_S = 1.5  # assumed: no step is without a stance for longer, but one over an obstacle


@dataclass(frozen=True, slots=True)
class GaitSettings:
    """`foot_left_m`: distance of the foot to the left of the trunk (negative: right foot). `half_stance_s`: used until stances are observed.

    `anchor_sd_m`: standard deviation per axis of the trunk's position over the foot; the error varies from step to step.
    """

    foot_left_m: float = -0.08
    half_stance_s: float = 0.25
    anchor_sd_m: float = 0.04


class TrunkPath:
    """Converts stances and steps into path segments; each segment begins where the one before it ended."""

    def __init__(self, settings: GaitSettings) -> None:
        self._settings = settings
        self._anchor: tuple[float, float, float, float] | None = None  # t, x, y, heading
        self._foot_xy = (0.0, 0.0)
        self._halves: deque[float] = deque([settings.half_stance_s], maxlen=HALVES)
        self._rests_s: deque[float] = deque(maxlen=RUN_MEMORY)
        self._toe = ToeAngle()
        self.steps = 0
        self._stood_s = math.inf  # last moment of a stance, or first one after a gap
        self._seen_s = math.inf  # newest sample
        self.doubts: list[str] = []  # of the newest step
        self._scale_sd = KNOWN_SCALE_SD

    def add_standing(self, t_s: Floats, foot_heading_rad: Floats) -> list[tuple[int, PathSegment]]:
        """Segments of standing while the foot is still at all times `t_s` (n,), each with the index of the sample that completes it."""
        if self._anchor is None and len(t_s):
            heading = float(foot_heading_rad[0]) + self._toe.angle_rad
            self._anchor = (float(t_s[0]), *self._trunk_xy(heading), heading)
        if len(t_s):
            self._stood_s = self._seen_s = float(t_s[-1])
        segments: list[tuple[int, PathSegment]] = []
        until_s = t_s - self._half_s()
        while self._anchor is not None:
            sample_index = int(np.searchsorted(until_s - self._anchor[0], STANDING_PIECE_S))
            if sample_index == len(t_s):
                break
            self._rests_s.clear()
            segments.append((sample_index, self._standing_segment(float(until_s[sample_index]))))
        return segments

    def add_flight(self, t_s: Floats) -> list[tuple[int, PathSegment]]:
        """Segments of a foot that is off the floor at all times `t_s` (n,), from ALOFT_S on, each with the index of the sample that completes it."""
        gaps = np.flatnonzero(np.diff(t_s, prepend=self._seen_s) > GAP_S)
        if len(gaps):
            self._stood_s = float(t_s[gaps[-1]])
        self._seen_s = float(t_s[-1]) if len(t_s) else self._seen_s
        segments: list[tuple[int, PathSegment]] = []
        while self._anchor is not None:
            due_s = max(self._stood_s + ALOFT_S, self._anchor[0] + STANDING_PIECE_S)
            sample_index = int(np.searchsorted(t_s, due_s))
            if sample_index == len(t_s):
                break
            segments.append((sample_index, replace(self._standing_segment(float(t_s[sample_index])), aloft=True)))
        return segments

    def add_stance(self, stance: Stance) -> list[PathSegment]:
        """The segment of standing up to half a stance before the end of this stance, if any."""
        segments = []
        duration_s = stance.t_end_s - stance.t_start_s
        self._rests_s.append(duration_s)
        until_s = stance.t_end_s - self._half_s()
        if self._anchor is not None and until_s > self._anchor[0]:
            segments.append(self._standing_segment(until_s))
        if duration_s < STANDING_S:
            self._halves.append(0.5 * duration_s)
        return segments

    def add_step(self, step: Step) -> list[PathSegment]:
        """The segment to the middle of the stance after this step."""
        self.steps += 1
        self.doubts = step.doubts()
        self._toe.learn(step)
        dx, dy = float(step.move_m[0]), float(step.move_m[1])
        self._foot_xy = (self._foot_xy[0] + dx, self._foot_xy[1] + dy)
        heading = step.heading_rad + self._toe.angle_rad
        variance = 0.5 * (float(step.covariance[0][0]) + float(step.covariance[1][1]))
        segment = self._moving_segment(step.t_end_s, heading, math.sqrt(max(variance, 0.0)), step.heading_sd_rad)
        rise_sd = math.sqrt(max(float(step.covariance[2][2]), 0.0))
        aloft = step.t_end_s - max(step.t_start_s, self._stood_s) > ALOFT_S  # its length, and so the scale, says little
        before, self._scale_sd = self._scale_sd, max(self._scale_sd, 0.0 if aloft else step.scale_sd)
        growth = math.sqrt(self._scale_sd**2 - before**2)
        return [replace(segment, rise_m=float(step.move_m[2]), rise_sd_m=rise_sd, scale_sd=growth, aloft=aloft)]

    def _moving_segment(self, landed_s: float, heading: float, sd_m: float, turn_sd_rad: float) -> PathSegment:
        """The segment from the last anchor to a new one over the foot; without a last anchor, an empty segment of one second."""
        x, y = self._trunk_xy(heading)
        half_s = self._half_s()
        t0, x0, y0, heading0 = self._anchor or (landed_s + half_s - 1.0, x, y, heading)
        # After a stand the trunk speeds up evenly
        gain = 2.0 if self._rests_s and self._rests_s[-1] > STANDING_S else 1.0
        m_s = gain * math.hypot(x - x0, y - y0) / max(landed_s + half_s - t0, RUN_STANCE_S)
        t_s = max(landed_s + min(half_s, REACH_M / max(m_s, REACH_M)), t0)
        self._anchor = (t_s, x, y, heading)
        anchor_sd_m = max(self._settings.anchor_sd_m, MIDDLE_SD_S * m_s)
        return PathSegment(
            t0, t_s, x - x0, y - y0, heading0, heading, sd_m, turn_sd_rad, self.steps, anchor_sd_m, running=self._runs
        )

    def _standing_segment(self, t_s: float) -> PathSegment:
        """The segment from the last anchor to the same position at `t_s`, the new anchor."""
        assert self._anchor is not None
        t0, x, y, heading = self._anchor
        self._anchor = (t_s, x, y, heading)
        return PathSegment(
            t0, t_s, 0.0, 0.0, heading, heading, 0.0, 0.0, self.steps, self._settings.anchor_sd_m, 0.0, 0.0, running=self._runs
        )  # fmt: skip

    def _trunk_xy(self, heading: float) -> tuple[float, float]:
        """Position of the trunk over the foot, for this heading of the trunk; left of the heading is (-sin, cos)."""
        left = self._settings.foot_left_m
        return self._foot_xy[0] + left * math.sin(heading), self._foot_xy[1] - left * math.cos(heading)

    @property
    def _runs(self) -> bool:
        return min(self._rests_s, default=math.inf) < RUN_STANCE_S

    def _half_s(self) -> float:
        """Half the usual duration of a stance; of a run by its last ones."""
        return min(median(list(self._halves)[-RUN_HALVES if self._runs else 0 :]), LONGEST_HALF_S)


class ToeAngle:
    """The angle from the foot's yaw to the direction of travel: running mean over straight forward steps."""

    def __init__(self) -> None:
        self.angle_rad = 0.0
        self._count = 0
        self._last_heading: float | None = None

    def learn(self, step: Step) -> None:
        """Update the mean by this step if it is long, straight and forward."""
        before, self._last_heading = self._last_heading, step.heading_rad
        dx, dy = float(step.move_m[0]), float(step.move_m[1])
        if before is None or math.hypot(dx, dy) < STRAIGHT_STEP_M:
            return
        if abs(wrap(step.heading_rad - before)) > STRAIGHT_STEP_RAD:
            return
        mean_heading = before + 0.5 * wrap(step.heading_rad - before)
        error = wrap(math.atan2(dy, dx) - mean_heading - self.angle_rad)
        if abs(error) > FORWARD_RAD:
            return
        self._count = min(self._count + 1, TOE_MEMORY)
        self.angle_rad += error / (self._count + 1)
