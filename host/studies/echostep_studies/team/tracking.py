# SPDX-License-Identifier: MIT
"""The trackers of a team, with or without meetings.

In: `TeamWalks`, the starts given to the trackers. Out: their estimates. Owns the models of a tap, of a radio range and of a false report.

After an encounter both trackers get each other's newest report at one moment; reports are up to a second old. A tap
comes up to TAP_S after they were nearest, and they do not stop for it. Beacons are shared every SHARE_S, without taps.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from enum import StrEnum

import numpy as np

from echostep.localization import Estimate, Start
from echostep.plan import Pose
from echostep.ports.chunks import Chunk, portion_of
from echostep.ports.people.meeting import MEETING, MeetingMessage
from echostep.ports.people.team_beacons import SHARE_S, TEAM_BEACONS, TeamBeacons
from echostep.tracker import Tracker
from echostep_app.session.team.teammate_feed import meeting_with
from echostep_app.team.age import aged
from echostep_app.team.publish import position_of
from echostep_simulation.scenario import START_NS
from echostep_studies.bench.walks import PORTION, T
from echostep_studies.team.walks import Encounter, TeamWalks

TAP_S = 1.0  # from the encounter to the tap, at most; assumed
# Of a range by ultra-wideband radio between two bodies: it is hardly ever short
RADIO_SD_M, RADIO_BIAS_M = (0.15, 0.1)
LIAR = 0  # number of the wearer whose reports are false
LIE_M = (6.0, 0.0)  # from the true place
LIE_SD_M = 0.05


class How(StrEnum):
    """Kind of measurement at an encounter: a tap, a radio range, a tap with a false report, or shared beacons instead."""

    TAP = "tap"
    RADIO = "radio"
    LIAR = "liar"
    BEACONS = "beacons"


def track_team(walks: TeamWalks, starts: Sequence[Pose | Start], how: How | None, seed: int) -> list[list[Estimate]]:
    """Estimates of all wearers; `starts`: their starts; `how`: None for trackers without meetings."""
    team = [_Wearer(walks, k, start, seed) for k, start in enumerate(starts)]
    if how is How.BEACONS:
        _share_all(walks, team)
    elif how is not None:
        _meet_all(walks, team, how, seed)
    for wearer in team:
        wearer.advance(np.inf)
    return [wearer.estimates for wearer in team]


def _meet_all(walks: TeamWalks, team: Sequence[_Wearer], how: How, seed: int) -> None:
    """Give both trackers of each encounter each other's report."""
    for encounter in _told_at(walks.encounters, how, np.random.default_rng([seed, 76])):
        rng = np.random.default_rng([seed, 77, int(1e3 * encounter.t_s)])
        reports = [_report(walks, team, who, encounter, how, rng) for who in encounter.who]
        for who, meeting in zip(encounter.who, reversed(reports), strict=True):
            if meeting is not None:
                team[who].meet(meeting, encounter.t_s)


def _share_all(walks: TeamWalks, team: Sequence[_Wearer]) -> None:
    """Every SHARE_S give each tracker the beacons that the others have placed."""
    end_s = max(truth[-1, T] for truth in walks.truth)
    for t_s in np.arange(SHARE_S, end_s, SHARE_S).tolist():
        for wearer in team:
            wearer.advance(t_s)
        placed = [wearer.tracker.own_beacons() for wearer in team]
        for who, beacons in enumerate(placed):
            if beacons:
                message = TeamBeacons(1, f"wearer {who}", f"{who:08x}", walks.plan.digest, beacons)
                for other in (*team[:who], *team[who + 1 :]):
                    other.hear(Chunk(TEAM_BEACONS, START_NS + int(1e9 * t_s), message.encode()))


def _told_at(encounters: Sequence[Encounter], how: How, rng: np.random.Generator) -> list[Encounter]:
    """The encounters in order of the times at which the trackers get them."""
    late_s = np.zeros(len(encounters)) if how is How.RADIO else rng.uniform(0.0, TAP_S, len(encounters))
    delayed = [replace(e, t_s=e.t_s + float(s)) for e, s in zip(encounters, late_s, strict=True)]
    return sorted(delayed, key=lambda e: e.t_s)


class _Wearer:
    """A tracker and the bytes that it has not taken yet."""

    def __init__(self, walks: TeamWalks, number: int, start: Pose | Start, seed: int) -> None:
        self.tracker = Tracker(walks.plan, start, seed=seed)
        self.estimates: list[Estimate] = []
        self._chunks = walks.chunks[number]
        self._taken = 0

    def advance(self, t_s: float) -> None:
        """Take all bytes up to a time of the simulation."""
        while self._taken < len(self._chunks):
            portion = self._chunks[self._taken : self._taken + PORTION]
            early = [chunk for chunk in portion if chunk.t_arrival_ns <= START_NS + 1e9 * t_s]
            self.estimates += self.tracker.take(portion_of(early))
            self._taken += len(early)
            if len(early) < len(portion):
                return

    def meet(self, meeting: MeetingMessage, t_s: float) -> None:
        """Give the tracker a meeting now."""
        self.hear(Chunk(MEETING, START_NS + int(1e9 * t_s), meeting.encode()))

    def hear(self, chunk: Chunk) -> None:
        """Give the tracker a chunk now."""
        self.estimates += self.tracker.feed(chunk)


def _report(
    walks: TeamWalks, team: Sequence[_Wearer], who: int, encounter: Encounter, how: How, rng: np.random.Generator
) -> MeetingMessage | None:
    """The report about this wearer that the other tracker gets."""
    team[who].advance(encounter.t_s)
    estimate = team[who].tracker.state.estimate
    if estimate is None:
        return None
    position = aged(position_of(walks.plan.levels, estimate), max(encounter.t_s - estimate.t_s, 0.0))
    name, status = f"wearer {who}", estimate.status.value
    match how:
        case How.RADIO:
            error_m = abs(RADIO_BIAS_M * rng.standard_normal()) + RADIO_SD_M * rng.standard_normal()
            measured = (max(encounter.distance_m + error_m, 0.0), RADIO_SD_M)
            return meeting_with(name, status, position, measured)
        case How.LIAR if who == LIAR:
            x, y, variance = position.x_m + LIE_M[0], position.y_m + LIE_M[1], LIE_SD_M**2
            false = replace(position, x_m=x, y_m=y, xx_m2=variance, xy_m2=0.0, yy_m2=variance, floor_probability=1.0)
            return meeting_with(name, "tracking", false)
    return meeting_with(name, status, position)
