# SPDX-License-Identifier: MIT
"""Marks as a page draws them: beacons, and marks of commanders (a cleared room, a hazard, no way, a meeting point); the newest meeting in words.

In: a tracker, in its thread; its state. Out: `BeaconMark`s that any thread may read, `ShownMeeting`. Owns the words.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import islice

from echostep.aiding import BeaconState, MeetingEffect
from echostep.particles.ellipse import CHI2_95, ellipse95
from echostep.ports.people.team_beacons import MOST_SHARED
from echostep.tracker import Tracker
from echostep.tracker.state import TrackerState
from echostep_app.plan.routing import RoutePlace

# A beacon counts as heard this long after its last reading: longer than a step, at whose end readings are used
RECENT_S = 1.5
BLOCKED = "blocked"  # kind of a mark: there is no way


@dataclass(frozen=True, slots=True)
class ShownOrder:
    """A commander's order that the wearer has not understood yet, in words; `urgent`: it is repeated. The names are keys of the page's JSON."""

    id: str
    text: str
    urgent: bool


@dataclass(frozen=True, slots=True)
class ShownMark:
    """A mark of kind `mark` at a place; `by`: who set it. The names are keys of the frame's JSON."""

    id: str
    mark: str
    x_m: float
    y_m: float
    level: int
    by: str


def closed_places(marks: Iterable[ShownMark]) -> tuple[RoutePlace, ...]:
    """The places at which marks say that there is no way."""
    return tuple(RoutePlace(mark.x_m, mark.y_m, mark.level) for mark in marks if mark.mark == BLOCKED)


@dataclass(frozen=True, slots=True)
class BeaconMark:
    """A beacon by its number, at the mean of its position over the particles. The field names are keys of the frame's JSON.

    `radius95_m`: radius of a circle with the beacon's spread, scaled as a 95 % ellipse. `state`: value of a `BeaconState`.
    `heard`: whether a reading came within the last `RECENT_S`. `by`: the teammate who has placed it; None: this wearer.
    """

    number: int
    x_m: float
    y_m: float
    radius95_m: float
    level: int
    state: str
    heard: bool
    by: str | None = None


def beacon_marks(tracker: Tracker, t_s: float) -> tuple[BeaconMark, ...]:
    """Marks of all beacons with a known position at time `t_s`: the wearer's own, and teammates' that are not among these."""
    state = tracker.state
    numbers = state.beacon_numbers
    own = tuple(
        BeaconMark(
            numbers[b.slot], b.x_m, b.y_m, math.sqrt(CHI2_95) * b.sd_m, b.level, b.state.value,
            t_s - b.heard_s < RECENT_S,
        )
        for b in tracker.beacon_places(t_s)
    )  # fmt: skip
    known = {mark.number for mark in own}
    shared = {b.number: (name, b) for name, beacons in state.team_beacons.items() for b in beacons}
    return own + tuple(
        BeaconMark(
            number, b.x_m, b.y_m, ellipse95(b.xx_m2, b.xy_m2, b.yy_m2).major_m, b.level, BeaconState.WELL.value, heard=False, by=name
        )
        for number, (name, b) in islice(shared.items(), MOST_SHARED) if number not in known
    )  # fmt: skip


WORDS = {
    MeetingEffect.USED: "{} and you agree about the place.",
    MeetingEffect.MOVED: "Your position is now beside {}.",
    MeetingEffect.CONTRADICTS: "{} is elsewhere by their tracker. Your position was kept: if it is wrong, tap where you are or meet another one.",
    MeetingEffect.EMPTY: "The tracker of {} does not know the place: nothing was changed.",
    MeetingEffect.REPEATED: "You met {} just now: nothing was changed. It counts again after 10 m.",
}


@dataclass(frozen=True, slots=True)
class ShownMeeting:
    """Meeting `number` in words. The names are keys of the frame's JSON."""

    number: int
    text: str


def shown_meeting(state: TrackerState) -> ShownMeeting | None:
    """The newest meeting; None before the first."""
    news = state.met
    return None if news is None else ShownMeeting(news.number, WORDS[news.effect].format(news.name))
