# SPDX-License-Identifier: MIT
"""The taps of a recorded walk as its truth: the places that the wearer tapped on the page, against a track computed without them.

In: a recording with check-ins, the plan on which they were tapped. Out: `TappedWalk`. Owns the rule which check-ins reach the tracker: the one that
it waits for as its start, which is then no truth, and no other. In the live run each tap has corrected the tracker, so the live estimates after a tap
contain the truth that they would be compared with.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from echostep.errors import EchostepError
from echostep.localization import Estimate, Start
from echostep.plan import Plan, Pose
from echostep.ports.chunks import Portion
from echostep.ports.people.check_in import PERSON, CheckIn, Undo, parse_person
from echostep.recording import open_parts
from echostep.tracker import Tracker
from echostep.walk.recorded import tracker_of
from echostep.walk.table import refuse_none
from echostep_app.plan.places.standing import StandingGround
from echostep_app.scorecard.card import PATH_S
from echostep_app.scorecard.track_columns import ScoredPath, track_of


class TappedWalk(NamedTuple):
    """The track of a walk, its taps as surveyed points on the same clock, the comparison in words, and the damage of the recording."""

    track: ScoredPath
    truth: ScoredPath
    words: str
    damage: list[str]


class TimedTap(NamedTuple):
    """A check-in at `t_s`: the time of the newest sample that had arrived."""

    t_s: float
    check_in: CheckIn


class Taps:
    """Call `take` with all portions of a recording, in order; `kept`: the taps that were not undone, by their numbers in the run."""

    def __init__(self, tracker: Tracker) -> None:
        self._tracker = tracker
        self._withheld = 0
        self.kept: dict[int, TimedTap] = {}

    def take(self, portion: Portion) -> Iterator[Estimate]:
        """The estimates of a tracker that gets no tap but its start."""
        for piece in portion.cut_after(PERSON):
            message, end = piece.of(PERSON), len(piece.port)
            before = end - len(message.row)
            yield from self._tracker.take(piece.rows(0, before))
            if before < end and not self._withholds(message.received):
                yield from self._tracker.take(piece.rows(before, end))

    def _withholds(self, received: bytes) -> bool:
        """Whether a message is a tap that the tracker does not wait for, or takes such a tap back."""
        state = self._tracker.state
        match parse_person(received):
            case CheckIn() as check_in if not state.waits_for_start:
                self._withheld += 1
                self.kept[state.check_ins + self._withheld] = TimedTap(self._tracker.front_end.newest_s, check_in)
                return True
            case Undo(number) if number in self.kept:
                del self.kept[number]
                return True
        return False


def tapped_walk(path: Path, plan: Plan, start: Start | Pose | None) -> TappedWalk:
    """Track a recording without its taps; raises EchostepError where it has none, or one that cannot be on the plan."""
    recording = open_parts([path])
    tracker = tracker_of(recording, plan, start)
    taps = Taps(tracker)
    estimates = [e for portion in recording.portions() for e in taps.take(portion)]
    refuse_none(estimates, path)
    timed = [tap for tap in taps.kept.values() if math.isfinite(tap.t_s)]
    truth = _truth(path, timed, plan)
    sd_m = float(np.median([tap.check_in.sd_m for tap in timed]))
    taken = f"{len(timed)} taps, each with a standard deviation of {sd_m:.2f} m; the track was made without them"
    words = f"{path}: {taken}"
    return TappedWalk(track_of(estimates, str(path)), truth, words, [f"{path}: {line}" for line in recording.damage()])


def _truth(path: Path, taps: list[TimedTap], plan: Plan) -> ScoredPath:
    """The taps as surveyed points; raises EchostepError."""
    if not taps:
        raise EchostepError(f"{path}: no tap in it after the start: tap on the page of a live run where you stand")
    ground = StandingGround(plan)
    for tap_s, place in taps:
        if objection := ground.objection(place.x_m, place.y_m, place.level):
            raise EchostepError(
                f"{path}: the tap at {tap_s:.0f} s, {place.x_m:.2f},{place.y_m:.2f}: {objection.reason}: "
                "give the plan on which it was tapped with --plan"
            )
    t_s = np.array([tap.t_s for tap in taps])
    if len(taps) > 1 and float(np.median(np.diff(t_s))) <= PATH_S:
        raise EchostepError(f"{path}: most taps came within {PATH_S:g} s of the one before: no walk of points")
    at = [tap.check_in for tap in taps]
    return ScoredPath(
        path, t_s, np.array([(tap.x_m, tap.y_m) for tap in at]), np.zeros(len(at), bool), {},
        height_m=np.array([plan.levels[tap.level].height_m for tap in at]),
        level=np.array([float(tap.level) for tap in at]),
    )  # fmt: skip
