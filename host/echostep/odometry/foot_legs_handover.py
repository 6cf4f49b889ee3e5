"""The trunk's way from whoever tells it: the foot while it speaks, the legs where it is silent.

In: legs of the foot's path and blocks of leg samples, in order of their messages. Out: `PathSegment`s of one walk frame, without overlap. Owns which
of the two carries on, and what turns and scales the one into the frame of the other.

The foot is several times as exact, so it carries while it lives. The last half minute of leg samples is kept; when the foot falls silent they are
gone through: as far as both know the way, the foot's tells how long these legs' strides are and where their heading points, and whether they are worn
at all. Then they carry. When the foot is back, it takes over where its path meets theirs, rotated_segment to their heading.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace

from echostep.angles import wrap
from echostep.legs.heading import CompassErrors
from echostep.legs.trunk_path import GyroBlock, LegPath, WearerSettings, rotated_segment, segment_after
from echostep.path import UNOBSERVED_SD_M, PathSegment

SILENT_S = 0.5  # a foot that is this far behind the board does not tell
KEPT_S = 30.0
LIKE = 0.35  # the legs' way against the foot's may be off by this share: else nobody wears them
LEAST_M = 3.0  # of a way that tells whether
USUAL_M = 10.0  # a way as telling as what is known of all people
REJOIN_SD_RAD = math.radians(2.0)  # of the angle between foot and legs where the foot takes over
BRIDGE_M_S, BRIDGE_M, BRIEF_S = 0.4, 1.5, 1.0
STRAIGHT_M, STRAIGHT_RAD = 0.5, math.radians(20.0)
PATIENCE_S = 4.0  # a foot that is back waits for the legs to catch up


class FootLegsHandover:
    """`foot` and `legs` take what comes, in order, and return what is certain."""

    def __init__(self, settings: WearerSettings, iron: CompassErrors | None = None) -> None:
        """`iron`: the compass', when it was calibrated."""
        self._settings, self._iron = settings, iron
        self._path: LegPath | None = None  # while the legs carry
        self._kept: deque[GyroBlock] = deque()
        self._known: deque[PathSegment] = deque()  # that the foot told, as long ago as the kept blocks
        self._waiting: list[PathSegment] = []  # of a foot that is back
        self._covered_s = -math.inf
        self._foot_turn = self._leg_turn = 0.0  # into the one walk frame
        self._leg_scale = 1.0
        self._foot_seen = False
        self._step = 0  # of the last leg
        self._step_base: int | None = 0  # added to a source's own count; None: it begins to carry with the next leg

    @property
    def watched_s(self) -> float:
        """Up to when the legs watched him, if they carry."""
        return float(self._kept[-1].t_s[-1]) if self._path is not None else -math.inf

    def foot(self, legs: list[PathSegment]) -> list[PathSegment]:
        """What the foot's path tells."""
        self._foot_seen = self._foot_seen or bool(legs)
        if self._path is not None:
            self._waiting += legs
            return self._rejoined()
        self._known.extend(legs)
        while self._known and self._known[0].t1_s < self._known[-1].t1_s - KEPT_S:
            self._known.popleft()
        return [self._on(leg, self._foot_turn) for leg in legs]

    def legs(self, block: GyroBlock, foot_newest_s: float) -> list[PathSegment]:
        """A block of leg samples; `foot_newest_s`: of the newest sample of the foot, NaN before the first."""
        now_s = float(block.t_s[-1])
        self._kept.append(block)
        while self._kept[0].t_s[-1] < now_s - KEPT_S:
            self._kept.popleft()
        if self._path is not None:
            return self._carried(self._path.feed(block)) + self._rejoined()
        if now_s - foot_newest_s < SILENT_S:
            return []
        return self._take_over()

    def _take_over(self) -> list[PathSegment]:
        """Go through what was kept; the legs carry if they are worn."""
        if self._foot_seen and not self._known:
            return []
        path = LegPath(self._settings, self._iron)
        told = [leg for block in self._kept for leg in path.feed(block)]
        if self._foot_seen and not self._learn(path, told):
            self._known.clear()  # until the foot has told more, they are not asked again
            return []
        self._path, self._step_base = path, None
        return self._carried(told)

    def _learn(self, path: LegPath, told: list[PathSegment]) -> bool:
        """Scale and heading of the legs by the foot, over the time that both tell; whether they tell of the same walk."""
        since_s = max(self._known[0].t0_s, told[0].t0_s) if told else math.inf
        until_s = self._known[-1].t1_s
        way_m = _length(self._known, since_s, until_s)
        legs_m = _length(told, since_s, until_s)
        if way_m < LEAST_M or not abs(legs_m / way_m - 1.0) < LIKE:
            return False
        self._leg_scale = (way_m + USUAL_M) / (legs_m + USUAL_M)
        straight = [leg for leg in self._known if _straight(leg) and leg.t1_s >= path.remembered_s] or [self._known[-1]]
        between = [leg.heading1_rad - path.heading_rad(leg.t1_s) for leg in straight]
        mean = math.atan2(sum(math.sin(a) for a in between), sum(math.cos(a) for a in between))
        self._leg_turn = wrap(mean + self._foot_turn)
        return True

    def _carried(self, told: list[PathSegment]) -> list[PathSegment]:
        return [
            self._on(rotated_segment(leg, self._leg_turn, self._leg_scale), 0.0)
            for leg in told
            if leg.t1_s > self._covered_s
        ]

    def _rejoined(self) -> list[PathSegment]:
        """Back to the foot with a straight stride, where foot and trunk look the same way, once the legs have told all before it."""
        assert self._path is not None
        nobody = self._covered_s == -math.inf
        while (
            self._waiting
            and not nobody
            and (not _straight(self._waiting[0]) or self._waiting[0].t1_s <= self._covered_s)
        ):
            del self._waiting[0]
        if not self._waiting:
            return []
        first = self._waiting[0]
        if first.t0_s > self._covered_s and self._waiting[-1].t1_s < self._covered_s + PATIENCE_S:
            return []
        if not nobody:
            at_s = max(first.t0_s, self._covered_s)
            self._foot_turn = wrap(self._path.heading_rad(at_s) + self._leg_turn - first.heading_rad(at_s))
            self._waiting[0] = replace(first, turn_sd_rad=math.hypot(first.turn_sd_rad, REJOIN_SD_RAD))
        legs, self._waiting = [*self._bridge(first), *self._waiting], []
        self._path, self._step_base = None, None
        self._known.clear()
        self._known.extend(legs)
        return [self._on(leg, self._foot_turn) for leg in legs]

    def _bridge(self, first: PathSegment) -> list[PathSegment]:
        """From where the legs left off to where the foot begins, in the foot's frame: nobody told, but it was not long."""
        if not -math.inf < self._covered_s < first.t0_s:
            return []
        assert self._path is not None
        span_s = first.t0_s - self._covered_s
        sd = min(BRIDGE_M_S * span_s, BRIDGE_M)
        if span_s > BRIEF_S:
            sd = max(sd, 1.01 * UNOBSERVED_SD_M)  # the cloud is to look everywhere about
        heading = self._path.heading_rad(self._covered_s) + self._leg_turn - self._foot_turn
        return [PathSegment(self._covered_s, first.t0_s, 0.0, 0.0, heading, first.heading0_rad, sd, 0.0, first.step)]

    def _on(self, leg: PathSegment, turn_rad: float) -> PathSegment:
        """The leg, from where the way is covered on, as a part of the one way."""
        if self._step_base is None:
            self._step_base = self._step + 1 - leg.step
        self._step = leg.step + self._step_base
        leg = rotated_segment(segment_after(leg, self._covered_s), turn_rad)
        self._covered_s = max(self._covered_s, leg.t1_s)
        return leg if leg.step == self._step else replace(leg, step=self._step)


def _straight(leg: PathSegment) -> bool:
    """Whether it is a stride straight on."""
    long = math.hypot(leg.dx_m, leg.dy_m) > STRAIGHT_M
    return long and not leg.unobserved and abs(wrap(leg.heading1_rad - leg.heading0_rad)) < STRAIGHT_RAD


def _length(legs: list[PathSegment] | deque[PathSegment], since_s: float, until_s: float) -> float:
    """Way in a stretch of time."""
    total = 0.0
    for leg in legs:
        t0, t1 = max(leg.t0_s, since_s), min(leg.t1_s, until_s)
        if t1 > t0:
            total += math.hypot(leg.dx_m, leg.dy_m) * (t1 - t0) / (leg.t1_s - leg.t0_s)
    return total
