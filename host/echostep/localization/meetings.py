# SPDX-License-Identifier: MIT
"""What meetings with other wearers do to the clouds of a filter.

In: a `Meeting`, the tracked cloud with its probability, the search. Out: the same clouds, reweighted, or another cloud that is tracked from now on.
Owns when each teammate was met, and the meetings that wait.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from enum import StrEnum

from echostep.localization.meeting_model import WRONG, carries_position
from echostep.ports.meeting import Meeting, parse_meeting

# By reason: in so much of the path a wearer's own echoes, or drift, have renewed what the filter knows.
RENEWED_M = 10.0
CONTRADICTIONS = 2  # teammates who have to contradict a believed cloud: one of a team is at a wrong start, as simulated
PLACE_M = 2.0  # radio range within which the teammate's place is the wearer's, as after a tap; reflections are longer, hardly ever shorter
MOST_NAMES = 4096  # teammates and beacons that are remembered: the most of a team's beacons that a tracker keeps
MOST_WAITING = 64  # meetings that wait for their segment


TimedMeeting = tuple[float, Meeting]  # time (s) of a meeting, -inf where it is not known


class MeetingEffect(StrEnum):
    """What a meeting did.

    `used`: the cloud agrees, and was weighed; `moved`: the cloud was doubted, or others contradicted it too, and the one that is tracked now lies
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
    """The newest meeting: its number, counted from 1, with whom, and what it did."""

    number: int
    name: str
    effect: MeetingEffect


class MeetingMemory:
    """Says which meetings may count: a teammate's position counts again when the own cloud has been renewed."""

    def __init__(self) -> None:
        self._path_m: dict[
            tuple[str, int | None], float
        ] = {}  # length of the path at the last meeting with each teammate, or range to a beacon of theirs
        self._contradicted_m: list[float] = []  # lengths of the path at the contradictions since the last agreement

    def refusal(self, meeting: Meeting, path_m: float) -> MeetingEffect | None:
        """Why a meeting does not count; None where it does, which is remembered."""
        if not carries_position(meeting):
            return MeetingEffect.EMPTY
        key = meeting.name, meeting.beacon
        last_m = self._path_m.pop(key, None)
        repeated = last_m is not None and path_m - last_m < RENEWED_M
        self._path_m[key] = last_m if repeated and last_m is not None else path_m
        if len(self._path_m) > MOST_NAMES:
            self._path_m.pop(next(iter(self._path_m)))
        return MeetingEffect.REPEATED if repeated else None

    def forget_beacons(self) -> None:
        """A search has begun, which no range to a beacon has weighed yet."""
        self._path_m = {key: m for key, m in self._path_m.items() if key[1] is None}

    def agree(self) -> None:
        """A teammate agrees with the cloud: what others said against it is answered."""
        self._contradicted_m.clear()

    def contradict(self, path_m: float) -> int:
        """A teammate contradicts the cloud; returns how many have done so in the last RENEWED_M without an agreement since."""
        self._contradicted_m = [*(m for m in self._contradicted_m if path_m - m < RENEWED_M), path_m][-MOST_NAMES:]
        return len(self._contradicted_m)


def moved_probability(here: float, meeting: Meeting, count: int) -> float:
    """Probability that the meeting is right where `count` meetings contradict a cloud that is right with probability `here`.

    If the cloud is right, all of them are wrong: odds of here wrong^count; otherwise this one is right with 1 - wrong.
    """
    wrong = WRONG[meeting.status]
    return (1.0 - here) * (1.0 - wrong) / (here * wrong**count + 1.0 - here)


class MeetingQueue:
    """Meetings that wait for their segment. `counts`: of all meetings by what they did; `bad` ones are no meetings."""

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self.news: MeetingNews | None = None
        self._waiting: list[TimedMeeting] = []

    def hear(self, payload: bytes, levels: int) -> Meeting | None:
        """The meeting in the bytes of a chunk, on a plan of so many levels; bytes that are none are counted."""
        meeting = parse_meeting(payload)
        if meeting is None or meeting.level >= levels:
            self.counts["bad"] += 1
            return None
        return meeting

    def add(self, meeting: Meeting, t_s: float) -> None:
        """Keep a meeting of this time; of too many the oldest are dropped."""
        self._waiting = [*self._waiting, (-math.inf if math.isnan(t_s) else t_s, meeting)][-MOST_WAITING:]

    def pop(self, t_s: float) -> list[TimedMeeting]:
        """The waiting meetings up to a time."""
        ready = [(met_s, meeting) for met_s, meeting in self._waiting if met_s <= t_s]
        self._waiting = [(met_s, meeting) for met_s, meeting in self._waiting if met_s > t_s]
        return ready

    def note(self, meeting: Meeting, effect: MeetingEffect) -> None:
        """Count what a meeting did; a range to a teammate's beacon is no news."""
        if meeting.beacon is not None:
            self.counts[f"beacon {effect.value}"] += 1
            return
        self.counts[effect.value] += 1
        self.news = MeetingNews(1 if self.news is None else self.news.number + 1, meeting.name, effect)
