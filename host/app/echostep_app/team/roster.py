# SPDX-License-Identifier: MIT
"""The roster: the last report and the state of each member of a team.

In: payloads from untrusted senders, with topic and time of arrival on the commander's clock. Out: `Member`s, the most urgent state first,
and counts of rejected payloads by reason. Owns the last report of each member. Only the commander's clock decides which report is stale;
trackers' clocks may be wrong.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum

from echostep.ports.people.team_beacons import BEACONS, parse_team_beacons
from echostep_app.team.age import later, no_better
from echostep_app.team.inbox import ReceivedMessage
from echostep_app.team.messages.report import (
    BadReportError,
    Presence,
    Report,
    check_name,
    decode,
    decode_presence,
)
from echostep_app.team.outbox import MAX_QUEUED

MAX_MEMBERS = 256
MAX_REASONS = 64
CLOCK_OFF_S = 5.0  # a larger difference of clocks is noted
MAX_STALE_S = 60.0  # a report is stale after so long at most, whatever it says
NO_STEP_S = 30.0  # a longer time without a step is noted
ENDED_KEPT_S = 3600.0  # a run that ended is shown for so long
MOST_NUMBERS_S = 100.0  # reports that a sender numbers in a second, beside those of a full queue
CONTRADICTION = "reports of two senders under this name contradict each other"
MAX_RETAINED_S = 86_400.0  # an older retained report is rejected
REPLACED_KEPT_S = 60.0  # a silent run is removed after so long when a newer run has the same name


class MemberState(StrEnum):
    """State of a member, the most urgent first."""

    MAYDAY = "mayday"
    ASKED = "asked"  # after a fall
    LOST = "lost"
    STALE = "stale"
    UNCERTAIN = "uncertain"
    WAITING = "waiting"
    TRACKING = "tracking"
    ENDED = "ended"


_URGENCY = {state: k for k, state in enumerate(MemberState)}


@dataclass(slots=True)
class Member:
    """Last report of one run of one tracker; times are on the commander's monotonic clock."""

    report: Report
    received_s: float
    retained: bool  # kept by the broker: its age is known by the tracker's clock only
    clock_ahead_s: float  # tracker's clock minus commander's clock at arrival
    presence: str = "online"
    missed: int = 0
    notes: Counter[str] = field(default_factory=Counter)
    _at: tuple[float, Report] | None = None  # the report at the time that was asked for last

    @property
    def key(self) -> tuple[str, str, str]:
        return self.report.team, self.report.name, self.report.run

    @property
    def stale_after_s(self) -> float:
        """For how many seconds the last report is valid."""
        return min(self.report.stale_after_s, MAX_STALE_S)

    def silent_s(self, now_s: float) -> float:
        """Seconds since the last report."""
        return max(now_s - self.received_s, 0.0)

    def at(self, now_s: float) -> Report:
        """What the last report says at a time of the commander's clock: every age and every word is of that time."""
        if self._at is None or self._at[0] != now_s:
            self._at = now_s, later(self.report, self.silent_s(now_s))
        return self._at[1]

    def contradict(self) -> None:
        """Note, and raise, that a report of this name and run is another sender's."""
        self.notes[CONTRADICTION] += 1
        raise BadReportError("a second sender under one name and run")

    def state(self, now_s: float) -> MemberState:
        """State at a time of the commander's clock: a call for help outranks the end of a run, and that a broken connection or silence."""
        alarm = self.report.alarm
        if alarm and alarm.kind == "mayday":
            return MemberState.MAYDAY
        if alarm and (alarm.kind, alarm.reason) == ("asking", "fall"):
            return MemberState.ASKED
        if self.presence == "ended":
            return MemberState.ENDED
        if self.presence == "broken" or self.silent_s(now_s) > self.stale_after_s:
            return MemberState.STALE
        return MemberState(self.at(now_s).status)


class Roster:
    """`receive` takes payloads; `members` gives the members, the most urgent first."""

    def __init__(self) -> None:
        self.rejected: Counter[str] = Counter()  # payloads by reason
        self.received = 0
        self._members: dict[tuple[str, str, str], Member] = {}
        self._presence: dict[tuple[str, str, str], str] = {}

    def copy(self) -> Roster:
        """An independent copy of the roster."""
        made = Roster()
        made.rejected, made.received = self.rejected.copy(), self.received
        made._members = {key: replace(m, notes=m.notes.copy()) for key, m in self._members.items()}
        made._presence = dict(self._presence)
        return made

    @property
    def keys(self) -> list[tuple[str, str, str]]:
        """Keys of all members, in the order in which they came."""
        return list(self._members)

    def receive(self, topic: str | None, payload: bytes, retained: bool, now_s: float, unix_s: float) -> bool:
        """Update the roster with one payload; returns whether it was believed. Never raises."""
        self.received += 1
        try:
            team, name, leaf = _topic_parts(topic)
            if leaf == "estimate":
                self._receive_report(team, name, decode(payload), retained, now_s, unix_s)
            elif leaf == "presence":
                self._receive_presence(team, name, decode_presence(payload))
            elif leaf == BEACONS:
                if (beacons := parse_team_beacons(payload)) is None or beacons.name != name:
                    raise BadReportError(
                        "not valid beacons" if beacons is None else "beacons and topic contradict each other"
                    )
            else:
                raise BadReportError("unknown topic")
        except BadReportError as error:
            self.count_rejected(str(error))
            return False
        return True

    def take(self, messages: Sequence[ReceivedMessage], dropped: Mapping[str, int]) -> list[ReceivedMessage]:
        """Receive messages, and count dropped ones by reason; returns the accepted ones."""
        believed = [message for message in messages if self.receive(*message)]
        for reason, count in dropped.items():
            self.received += count
            self.count_rejected(reason, count)
        return believed

    def count_rejected(self, reason: str, count: int = 1) -> None:
        """Count rejected payloads; after MAX_REASONS different reasons the others are counted together."""
        reason = reason[:100]
        if reason not in self.rejected and len(self.rejected) >= MAX_REASONS:
            reason = "other"
        self.rejected[reason] += count

    def members(self, now_s: float) -> list[Member]:
        """All members, by urgency of state; then the longest silent first (lost and stale ones), then the least certain."""
        self._remove_old(now_s)

        def urgency(m: Member) -> tuple[int, float, float, tuple[str, str, str]]:
            p, state = m.at(now_s).position, m.state(now_s)
            silence = (
                m.silent_s(now_s)
                if state in (MemberState.MAYDAY, MemberState.ASKED, MemberState.LOST, MemberState.STALE)
                and m.silent_s(now_s) > m.stale_after_s
                else 0.0
            )
            return _URGENCY[state], -silence, -(p.radius95_m if p else 0.0), m.key

        return sorted(self._members.values(), key=urgency)

    def duplicates(self, now_s: float) -> set[tuple[str, str]]:
        """(team, name) pairs that several running trackers use."""
        running = Counter(
            m.key[:2]
            for m in self._members.values()
            if m.state(now_s) is not MemberState.ENDED and m.silent_s(now_s) <= m.stale_after_s
        )
        return {key for key, count in running.items() if count > 1}

    def _receive_report(self, team: str, name: str, r: Report, retained: bool, now_s: float, unix_s: float) -> None:
        if (r.team, r.name) != (team, name):
            raise BadReportError("name and topic contradict each other")
        r = no_better(r, r.status)  # a lost one of another sender: a place that it knew last, no claim
        key = (team, name, r.run)
        ahead_s = r.sent_s - unix_s
        if retained and ahead_s < -MAX_RETAINED_S:
            raise BadReportError("remembered by the broker for more than a day")
        received_s = now_s - max(-ahead_s, 0.0) if retained else now_s
        last = self._members.get(key)
        if last is None:
            if len(self._members) >= MAX_MEMBERS and not self._remove_old(now_s, all_ended=True):
                raise BadReportError(f"more than {MAX_MEMBERS} trackers")
            self._members[key] = Member(r, received_s, retained, ahead_s, self._presence.pop(key, "online"))
            return
        if retained and r == last.report:
            return  # the broker repeats it after a new connection
        if r.sequence <= last.report.sequence:
            if not retained and r.sent_s > last.report.sent_s:  # a sender numbers in the order of time
                last.contradict()
            raise BadReportError("older than what was heard before")
        missed = r.sequence - last.report.sequence - 1
        if missed > MAX_QUEUED + MOST_NUMBERS_S * last.silent_s(now_s):  # forged: the others would be older
            last.contradict()
        last.missed += missed
        last.report, last.received_s, last._at = r, max(received_s, last.received_s), None
        last.retained, last.clock_ahead_s = retained, ahead_s
        if not retained or last.presence == "broken":
            last.presence = "online"

    def _receive_presence(self, team: str, name: str, p: Presence) -> None:
        key = (team, name, p.run)
        if (member := self._members.get(key)) is not None:
            member.presence = p.presence
        else:
            if len(self._presence) >= MAX_MEMBERS:
                self._presence.pop(next(iter(self._presence)))
            self._presence[key] = p.presence

    def _remove_old(self, now_s: float, *, all_ended: bool = False) -> bool:
        """Remove runs replaced by a newer one, and ended runs (`all_ended`: also recent ones); returns whether any was removed."""
        newest: dict[tuple[str, str], float] = {}
        for m in self._members.values():
            newest[m.key[:2]] = max(newest.get(m.key[:2], -math.inf), m.received_s)
        removed = [
            m.key
            for m in self._members.values()
            if (m.received_s < newest[m.key[:2]] and (m.presence != "online" or m.silent_s(now_s) > REPLACED_KEPT_S))
            or (m.state(now_s) is MemberState.ENDED and (all_ended or m.silent_s(now_s) > ENDED_KEPT_S))
        ]
        for key in removed:
            del self._members[key]
        return bool(removed)


def _topic_parts(topic: str | None) -> tuple[str, str, str]:
    """Team, name and leaf of a topic; raises BadReportError."""
    parts = (topic or "").split("/")
    if len(parts) != 4 or parts[0] != "echostep":
        raise BadReportError("unknown topic")
    for name in parts[1:3]:
        check_name(name)
    return parts[1], parts[2], parts[3]
