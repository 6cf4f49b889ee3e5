# SPDX-License-Identifier: MIT
"""Which meetings count, which wait for their segment, and the effect of each.

In: meetings. Out: whether each counts, meetings whose time has come. Owns when each teammate was met, and the meetings that wait.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from enum import StrEnum

from msgspec import structs

from echostep.aiding.team.meeting import WRONG, Meeting, TimedMeeting, carries_position
from echostep.particles.limits import PROBABLE
from echostep.path import Odometer
from echostep.ports.people.meeting import parse_meeting

# Assumed, not measured.
# Path on which a wearer's own echoes, or drift, renew the filter's information
RENEWED_M = 10.0
CONTRADICTIONS = 2  # teammates that must contradict a believed cloud: one of a team has a wrong start, as simulated
PLACE_M = 2.0  # radio range within which the teammate's place is the wearer's, as after a tap; reflections are longer, hardly ever shorter
MOST_NAMES = 4096  # teammates and beacons that are remembered: the most of a team's beacons that a tracker keeps
MOST_WAITING = 64  # meetings that wait for their segment


class MeetingEffect(StrEnum):
    """The effect of a meeting on the tracked cloud.

    `used`: the cloud agrees, and was reweighted; `moved`: the cloud was doubted, or others contradicted it too, and the one that is tracked now lies
    about the teammate; `contradicts`: the teammate is elsewhere, and nothing was changed; `empty`: the teammate does not know its own place;
    `repeated`: nothing is new since the last meeting with this teammate.
    """

    USED = "used"
    MOVED = "moved"
    CONTRADICTS = "contradicts"
    EMPTY = "empty"
    REPEATED = "repeated"


@dataclass(frozen=True, slots=True)
class MeetingNews:
    """The newest meeting: its number, counted from 1, the teammate, and the effect."""

    number: int
    name: str
    effect: MeetingEffect


class MeetingMemory:
    """Decides which meetings may count: a teammate's position counts again after RENEWED_M of the wearer's own path."""

    def __init__(self, odometer: Odometer) -> None:
        """`odometer`: of the wearer's path."""
        self._odometer = odometer
        # Mark on the path at the last meeting with each teammate, or range to a beacon of theirs
        self._met_m: dict[tuple[str, int | None], float] = {}
        self._contradicted_m: list[float] = []  # marks at the contradictions since the last agreement

    def refusal(self, meeting: Meeting) -> MeetingEffect | None:
        """Why a meeting does not count; None if it counts, which is remembered."""
        if not carries_position(meeting):
            return MeetingEffect.EMPTY
        key = meeting.name, meeting.beacon
        last_m = self._met_m.pop(key, -math.inf)
        repeated = self._odometer.since_m(last_m) < RENEWED_M
        self._met_m[key] = last_m if repeated else self._odometer.path_m
        if len(self._met_m) > MOST_NAMES:
            self._met_m.pop(next(iter(self._met_m)))
        return MeetingEffect.REPEATED if repeated else None

    def forget_beacons(self) -> None:
        """Reset the ranges to beacons: a search has begun, whose cloud they have not reweighted yet."""
        self._met_m = {key: m for key, m in self._met_m.items() if key[1] is None}

    def agree(self) -> None:
        """A teammate agrees with the cloud: earlier contradictions are cancelled."""
        self._contradicted_m.clear()

    def contradict(self) -> int:
        """A teammate contradicts the cloud; returns how many have done so in the last RENEWED_M without an agreement since."""
        recent_m = [m for m in self._contradicted_m if self._odometer.since_m(m) < RENEWED_M]
        self._contradicted_m = [*recent_m, self._odometer.path_m][-MOST_NAMES:]
        return len(self._contradicted_m)


def moved_by(meeting: Meeting, here: float, count: int) -> float | None:
    """Probability of the teammate's place where `count` contradictions move the cloud there, else None. `here`: probability that it is right.

    If the cloud is right, all of them are wrong: odds of here * wrong^count; otherwise this one is right with 1 - wrong.
    """
    wrong = WRONG[meeting.status]
    moved = (1.0 - here) * (1.0 - wrong) / (here * wrong**count + 1.0 - here)
    is_alone = count < CONTRADICTIONS and here >= PROBABLE
    return None if (meeting.range_m or 0.0) > PLACE_M or is_alone or moved < PROBABLE else moved


class MeetingQueue:
    """Meetings that wait for their segment. `counts`: of all meetings by effect; `bad` ones are no meetings."""

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self.news: MeetingNews | None = None
        self._waiting: list[TimedMeeting] = []

    def receive(self, payload: bytes, levels: int) -> Meeting | None:
        """The meeting in the bytes of a chunk, on a plan of `levels` levels; other bytes are counted."""
        message = parse_meeting(payload)
        if message is None or message.level >= levels:
            self.counts["bad"] += 1
            return None
        return Meeting(**structs.asdict(message))

    def add(self, meeting: Meeting, t_s: float) -> None:
        """Keep a meeting of this time; if too many, the oldest are dropped."""
        self._waiting = [*self._waiting, (-math.inf if math.isnan(t_s) else t_s, meeting)][-MOST_WAITING:]

    def pop(self, t_s: float) -> list[TimedMeeting]:
        """The waiting meetings up to a time."""
        ready = [(met_s, meeting) for met_s, meeting in self._waiting if met_s <= t_s]
        self._waiting = [(met_s, meeting) for met_s, meeting in self._waiting if met_s > t_s]
        return ready

    def note(self, meeting: Meeting, effect: MeetingEffect) -> None:
        """Count the effect of a meeting; a range to a teammate's beacon is not reported as news."""
        if meeting.beacon is not None:
            self.counts[f"beacon {effect.value}"] += 1
            return
        self.counts[effect.value] += 1
        self.news = MeetingNews(1 if self.news is None else self.news.number + 1, meeting.name, effect)
