"""From the foot's stances to the trunk's path.

In: `Step` and `Stance` of one foot (walk frame). Out: `PathSegment`s: straight pieces of the trunk's path between anchors. Owns the last anchor.

The trunk passes over the foot in the middle of the stance [Perry 1992, mid stance]; between two such moments it moves evenly. A person who stands
keeps the trunk over the foot, but for half a usual stance at either end.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace
from statistics import median

import numpy as np

from echostep.angles import wrap
from echostep.arrays import Floats
from echostep.foot.steps import Stance, Step
from echostep.path import STANDING_PIECE_S, PathSegment


@dataclass(frozen=True, slots=True)
class GaitSettings:
    """Where the foot is: `foot_left_m` to the left of the trunk (negative: right foot); `half_stance_s` until it has been observed.

    `anchor_sd_m`: how exactly the trunk passes over the foot, per axis; not the same for every person, but from step to step.
    """

    foot_left_m: float = -0.08
    half_stance_s: float = 0.25
    anchor_sd_m: float = 0.04


class TrunkPath:
    """Turns stances into legs; every leg begins where the one before it ended."""

    def __init__(self, settings: GaitSettings) -> None:
        self._settings = settings
        self._anchor: tuple[float, float, float, float] | None = None  # t, x, y, heading
        self._foot_xy = (0.0, 0.0)
        self._stance_begin_s = 0.0
        self._halves: deque[float] = deque([settings.half_stance_s], maxlen=7)
        self._toe = ToeAngle()
        self.steps = 0

    def add_standing(self, t_s: Floats, foot_heading_rad: Floats) -> list[tuple[int, PathSegment]]:
        """The foot is still at all of `t_s` (n,): what becomes known of the trunk, and at which of them."""
        if self._anchor is None and len(t_s):
            self._stance_begin_s = float(t_s[0])
            heading = float(foot_heading_rad[0]) + self._toe.angle_rad
            self._anchor = (self._stance_begin_s, *self._trunk(heading), heading)
        found: list[tuple[int, PathSegment]] = []
        until = t_s - self._half_s()
        while self._anchor is not None:
            at = int(np.searchsorted(until - self._anchor[0], STANDING_PIECE_S))
            if at == len(t_s):
                break
            found.append((at, self._stay(float(until[at]))))
        return found

    def add_stance(self, stance: Stance) -> list[PathSegment]:
        """A stance is over."""
        legs = []
        until = stance.t_end_s - self._half_s()
        if self._anchor is not None and until > self._anchor[0]:
            legs.append(self._stay(until))
        length = stance.t_end_s - stance.t_start_s
        if 0.1 < length < 0.8:
            self._halves.append(0.5 * length)
        return legs

    def add_step(self, step: Step) -> list[PathSegment]:
        """The foot has landed."""
        self.steps += 1
        self._toe.learn(step)
        dx, dy = float(step.move_m[0]), float(step.move_m[1])
        self._foot_xy = (self._foot_xy[0] + dx, self._foot_xy[1] + dy)
        self._stance_begin_s = step.t_end_s
        heading = step.heading_rad + self._toe.angle_rad
        variance = 0.5 * (float(step.covariance[0][0]) + float(step.covariance[1][1]))
        leg = self._go(step.t_end_s + self._half_s(), heading, math.sqrt(max(variance, 0.0)), step.heading_sd_rad)
        rise_sd = math.sqrt(max(float(step.covariance[2][2]), 0.0))
        return [replace(leg, rise_m=float(step.move_m[2]), rise_sd_m=rise_sd)]

    def _go(self, t_s: float, heading: float, sd_m: float, turn_sd_rad: float) -> PathSegment:
        x, y = self._trunk(heading)
        t0, x0, y0, heading0 = self._anchor or (t_s - 1.0, x, y, heading)
        t_s = max(t_s, t0)
        self._anchor = (t_s, x, y, heading)
        return PathSegment(
            t0, t_s, x - x0, y - y0, heading0, heading, sd_m, turn_sd_rad, self.steps, self._settings.anchor_sd_m
        )

    def _stay(self, t_s: float) -> PathSegment:
        assert self._anchor is not None
        t0, x, y, heading = self._anchor
        self._anchor = (t_s, x, y, heading)
        return PathSegment(
            t0, t_s, 0.0, 0.0, heading, heading, 0.0, 0.0, self.steps, self._settings.anchor_sd_m, 0.0, 0.0
        )

    def _trunk(self, heading: float) -> tuple[float, float]:
        """Where the trunk is above this foot; left of the heading is (-sin, cos)."""
        left = self._settings.foot_left_m
        return self._foot_xy[0] + left * math.sin(heading), self._foot_xy[1] - left * math.cos(heading)

    def _half_s(self) -> float:
        return min(max(median(self._halves), 0.1), 0.35)


class ToeAngle:
    """The angle from the foot's yaw to the direction of travel, learnt from straight forward steps."""

    LONGEST_MEMORY = 20

    def __init__(self) -> None:
        self.angle_rad = 0.0
        self._seen = 0
        self._last_heading: float | None = None

    def learn(self, step: Step) -> None:
        """Take a step into account when it is long, straight and forward."""
        before, self._last_heading = self._last_heading, step.heading_rad
        dx, dy = float(step.move_m[0]), float(step.move_m[1])
        if before is None or math.hypot(dx, dy) < 0.6 or abs(wrap(step.heading_rad - before)) > math.radians(15.0):
            return
        mean_heading = before + 0.5 * wrap(step.heading_rad - before)
        error = wrap(math.atan2(dy, dx) - mean_heading - self.angle_rad)
        if abs(error) > math.radians(45.0):
            return
        self._seen = min(self._seen + 1, self.LONGEST_MEMORY)
        self.angle_rad += error / (self._seen + 1)
