"""The roster: who is where, who is lost, who has fallen silent.

In: payloads from anybody, with their topic and the time of their arrival by the commander's own clock. Out: `Member`s, sorted by need, and counts of
what was not believed, by name. Owns the last report of each member. Only the commander's clock decides who is stale; the trackers' may be wrong.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from enum import StrEnum

from echostep.team.outbox import aged
from echostep.team.report import BadReportError, Position, Presence, Report, check_name, decode, decode_presence

MOST_MEMBERS = 256
MOST_REASONS = 64
CLOCK_OFF_S = 5.0
CLOCK_JUMP_S = 5.0
MOST_STALE_S = 60.0  # no tracker may ask for a longer patience
HURRY_M_S = 12.0  # nobody walks so fast: the position has jumped
STILL_S = 30.0
ENDED_KEPT_S = 3600.0  # runs that ended are shown for so long
REMEMBERED_S = 86_400.0  # what a broker remembers for longer is of another day
KEPT_S = 60.0  # a run that a newer run of the same name has replaced is forgotten after so long


class Need(StrEnum):
    """A member's state, the most pressing first."""

    LOST = "lost"
    STALE = "stale"
    UNCERTAIN = "uncertain"
    WAITING = "waiting"
    TRACKING = "tracking"
    ENDED = "ended"


_ORDER = {need: k for k, need in enumerate(Need)}


@dataclass(slots=True)
class Member:
    """One run of one tracker, as last heard; times are the commander's monotonic clock."""

    report: Report
    heard_s: float
    retained: bool  # the broker remembered it: nobody knows how old it is but by the tracker's clock
    clock_off_s: float  # how far the tracker's clock is ahead, latency included
    presence: str = "online"
    missed: int = 0
    notes: Counter[str] = field(default_factory=Counter)

    @property
    def key(self) -> tuple[str, str, str]:
        return self.report.team, self.report.name, self.report.run

    @property
    def patience_s(self) -> float:
        """How long his last report holds."""
        return min(self.report.stale_after_s, MOST_STALE_S)

    def silent_s(self, now_s: float) -> float:
        """Seconds without a word."""
        return max(now_s - self.heard_s, 0.0)

    def position(self, now_s: float) -> Position | None:
        """Where he may be by now: when he is silent, as far as he may have walked since."""
        p, silent_s = self.report.position, self.silent_s(now_s)
        if p is None or self.presence == "ended" or silent_s <= self.patience_s:
            return p
        return replace(aged(p, silent_s), age_s=p.age_s + silent_s)

    def need(self, now_s: float) -> Need:
        """What the commander should think of him."""
        if self.presence == "ended":
            return Need.ENDED
        if self.report.status == "lost":
            return Need.LOST
        if self.presence == "broken" or self.silent_s(now_s) > self.patience_s:
            return Need.STALE
        return Need(self.report.status)


class Roster:
    """`hear` every payload; `members` are sorted by need."""

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()  # what was not believed, and why
        self.heard = 0
        self._members: dict[tuple[str, str, str], Member] = {}
        self._presence: dict[tuple[str, str, str], str] = {}

    def hear(self, topic: str | None, payload: bytes, retained: bool, now_s: float, unix_s: float) -> None:
        """Take one payload; never raises."""
        self.heard += 1
        try:
            team, name, leaf = _parts(topic)
            if leaf == "estimate":
                self._report(team, name, decode(payload), retained, now_s, unix_s)
            elif leaf == "presence":
                self._note_presence(team, name, decode_presence(payload))
            else:
                raise BadReportError("unknown topic")
        except BadReportError as error:
            self.refuse(str(error))

    def refuse(self, why: str, count: int = 1) -> None:
        """Count what was not believed; reasons are few, whoever makes them up."""
        why = why[:100]
        if why not in self.counts and len(self.counts) >= MOST_REASONS:
            why = "other"
        self.counts[why] += count

    def members(self, now_s: float) -> list[Member]:
        """Everybody, lost and stale first; among equals the one who is silent longest, then the least certain."""
        self._forget(now_s)

        def pressing(m: Member) -> tuple[int, float, float, tuple[str, str, str]]:
            p, need = m.report.position, m.need(now_s)
            silence = m.silent_s(now_s) if need in (Need.LOST, Need.STALE) and m.silent_s(now_s) > m.patience_s else 0.0
            return _ORDER[need], -silence, -(p.radius95_m if p else 0.0), m.key

        return sorted(self._members.values(), key=pressing)

    def duplicates(self, now_s: float) -> set[tuple[str, str]]:
        """Names under which several trackers speak."""
        speaking = Counter(
            m.key[:2]
            for m in self._members.values()
            if m.need(now_s) is not Need.ENDED and m.silent_s(now_s) <= m.patience_s
        )
        return {key for key, count in speaking.items() if count > 1}

    def _report(self, team: str, name: str, r: Report, retained: bool, now_s: float, unix_s: float) -> None:
        if (r.team, r.name) != (team, name):
            raise BadReportError("name and topic contradict each other")
        key = (team, name, r.run)
        off_s = r.sent_s - unix_s
        if retained and off_s < -REMEMBERED_S:
            raise BadReportError("remembered by the broker for more than a day")
        heard_s = now_s - max(-off_s, 0.0) if retained else now_s
        last = self._members.get(key)
        if last is None:
            if len(self._members) >= MOST_MEMBERS and not self._forget(now_s, hard=True):
                raise BadReportError(f"more than {MOST_MEMBERS} trackers")
            self._members[key] = Member(r, heard_s, retained, off_s, self._presence.pop(key, "online"))
            return
        if retained and r == last.report:
            return  # told again after a new connection
        if r.sequence <= last.report.sequence:
            raise BadReportError("older than what was heard before")
        last.missed += r.sequence - last.report.sequence - 1
        if not retained and not last.retained and abs(off_s - last.clock_off_s) > CLOCK_JUMP_S:
            last.notes["clock jumped"] += 1
        if _leaps(last.report.position, r.position):
            last.notes["position jumped"] += 1
        last.report, last.heard_s, last.retained, last.clock_off_s = r, max(heard_s, last.heard_s), retained, off_s
        if last.presence == "broken":
            last.presence = "online"

    def _note_presence(self, team: str, name: str, p: Presence) -> None:
        key = (team, name, p.run)
        if (member := self._members.get(key)) is not None:
            member.presence = p.presence
        else:
            if len(self._presence) >= MOST_MEMBERS:
                self._presence.pop(next(iter(self._presence)))
            self._presence[key] = p.presence

    def _forget(self, now_s: float, *, hard: bool = False) -> bool:
        """Drop runs that a newer one has replaced, in need of room also those that ended; whether any went."""
        newest: dict[tuple[str, str], float] = {}
        for m in self._members.values():
            newest[m.key[:2]] = max(newest.get(m.key[:2], -math.inf), m.heard_s)
        gone = [
            m.key
            for m in self._members.values()
            if (m.heard_s < newest[m.key[:2]] and (m.presence != "online" or m.silent_s(now_s) > KEPT_S))
            or (m.need(now_s) is Need.ENDED and (hard or m.silent_s(now_s) > ENDED_KEPT_S))
        ]
        for key in gone:
            del self._members[key]
        return bool(gone)


def _parts(topic: str | None) -> tuple[str, str, str]:
    """Team, name and leaf of a topic; raises BadReportError."""
    parts = (topic or "").split("/")
    if len(parts) != 4 or parts[0] != "echostep":
        raise BadReportError("unknown topic")
    for name in parts[1:3]:
        check_name(name)
    return parts[1], parts[2], parts[3]


def _leaps(before: Position | None, after: Position | None) -> bool:
    """Whether a position is farther from the last one than legs and both ellipses explain."""
    if before is None or after is None or before.floor != after.floor:
        return False
    way_m = math.hypot(after.x_m - before.x_m, after.y_m - before.y_m)
    walked_m = HURRY_M_S * max(after.t_s - before.t_s, 0.0)
    return way_m > walked_m + before.radius95_m + after.radius95_m + 1.0


def distance_m(a: Position, b: Position) -> float | None:
    """Straight distance of two positions on one floor."""
    return math.hypot(a.x_m - b.x_m, a.y_m - b.y_m) if a.floor == b.floor else None


def nearest(me: Member, others: Iterable[Member]) -> tuple[float, Member] | None:
    """The closest other member with a position on the same floor; by their last known places."""
    if me.report.position is None:
        return None
    found = [
        (d, o) for o in others
        if o is not me and o.report.position is not None and (d := distance_m(me.report.position, o.report.position)) is not None
    ]  # fmt: skip
    return min(found, key=lambda pair: pair[0], default=None)
