# SPDX-License-Identifier: MIT
"""A member of the team in words: the row of the list, and the details behind it.

In: members, the plan, a time. Out: `ShownWearer`, `ShownDetails`: plain data, whose field names are keys of the page's JSON. Owns nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from echostep.plan import Plan
from echostep_app.operation.orders import order_notes
from echostep_app.page.elements.marks import ShownMark
from echostep_app.team.commander import heading_on, notes
from echostep_app.team.cot import alarm_words
from echostep_app.team.messages.crews import Crew, crew_of
from echostep_app.team.messages.marks import AlarmKey, MarkBoard
from echostep_app.team.messages.orders import HOLDS_S
from echostep_app.team.roster import Member, MemberState
from echostep_app.wearer.falls import LYING_RAD, UPRIGHT_RAD
from echostep_app.wearer.steady_status import late_words, span_words

STATES = {
    MemberState.MAYDAY: "mayday", MemberState.ASKED: "asked after a fall",
    MemberState.LOST: "lost", MemberState.STALE: "silent", MemberState.UNCERTAIN: "uncertain",
    MemberState.WAITING: "no position yet", MemberState.TRACKING: "", MemberState.ENDED: "run ended",
}  # in words; a position that is tracked needs none  # fmt: skip
COUNTED = {state: words or "tracked" for state, words in STATES.items()}  # in the summary


@dataclass(frozen=True, slots=True)
class ShownEvent:
    """A change of a wearer's state: time of day in seconds since 1970, and what happened."""

    unix_s: float
    text: str


@dataclass(frozen=True, slots=True)
class ShownWearer:
    """A row of the list. `level` is an index into the plan's levels, None without a position on this plan.

    `open_alarm`: a mayday that no commander has acknowledged.
    """

    id: int
    team: str
    name: str
    state: str
    words: str
    level: int | None
    notes: tuple[str, ...]
    open_alarm: bool = False


@dataclass(frozen=True, slots=True)
class ShownFact:
    """One line of the details."""

    name: str
    value: str


@dataclass(frozen=True, slots=True)
class ShownDetails:
    """The data of one wearer. `history`: the newest event first."""

    id: int
    facts: tuple[ShownFact, ...]
    history: tuple[ShownEvent, ...]


Shared = tuple[tuple[ShownMark, ...], tuple[Crew, ...], tuple[ShownEvent, ...]]


def summary_words(members: Sequence[Member], now_s: float) -> str:
    """How many wearers there are, and how many in each state: "8 wearers: 1 lost, 7 tracked"."""
    states = [m.state(now_s) for m in members]
    counts = ", ".join(f"{states.count(state)} {COUNTED[state]}" for state in MemberState if state in states)
    return f"{len(members)} wearer{'s' * (len(members) != 1)}" + (f": {counts}" if counts else "")


def level_on(plan: Plan, m: Member) -> int | None:
    """The plan's level that a member is on; None without a position, and when it was tracked on another plan."""
    p = m.report.last_known
    if p is None or m.report.plan_sha256 != plan.digest or not 0 <= p.floor < len(plan.levels):
        return None
    return p.floor


def alarm_key(m: Member) -> AlarmKey | None:
    """Of the present mayday of a member; None without one."""
    alarm = m.report.alarm
    if alarm is None or alarm.kind != "mayday":
        return None
    return m.report.team, m.report.name, f"{m.report.run}-{alarm.number}"


def shown_shared(board: MarkBoard, plan: Plan, unix_s: float) -> Shared:
    """The commanders' shared state: marks on this plan, crews, and the notes of this operation, the newest first."""
    marks = (
        ShownMark(m.id, m.mark, m.x_m, m.y_m, m.level, m.by)
        for m in board.marks.values()
        if m.plan_sha256 == plan.digest
    )
    notes = sorted((n for n in board.log.values() if unix_s - n.unix_s < HOLDS_S), key=lambda n: -n.unix_s)
    return tuple(marks), tuple(board.crews.values()), tuple(ShownEvent(n.unix_s, f"{n.by}: {n.text}") for n in notes)


def shown_wearer(
    number: int, m: Member, plan: Plan, now_s: float, duplicates: set[tuple[str, str]], board: MarkBoard,
    exit_m: float | None = None,
) -> ShownWearer:  # fmt: skip
    """The row of a member: "2nd floor, near stairs B, within 0.4 m, 23 m to the exit, heard 2 s ago"."""
    state, out = m.state(now_s), "" if exit_m is None else f"{exit_m:.0f} m to the exit"
    parts = [STATES[state], *where_words(m, now_s), out, heard_words(m.silent_s(now_s))]
    words = ", ".join(filter(None, parts))
    remarks, key = notes(m, plan, now_s, duplicates), alarm_key(m)
    ack = board.acks.get(key) if key else None
    if ack:
        remarks.insert(0, f"acknowledged by {ack.by}")
    if errand := board.errands.get(m.key):
        remarks.insert(0, f"sent to {errand.to} by {errand.by}")
    remarks[:0] = order_notes(board, m)
    if crew := crew_of(m.report.name, board.crews.values()):
        remarks.insert(0, f"crew {crew.name}{' inside' * crew.is_inside}")
    is_open = key is not None and ack is None
    return ShownWearer(
        number, m.report.team, m.report.name, state.value, words, level_on(plan, m), tuple(remarks), is_open
    )


def where_words(m: Member, now_s: float) -> tuple[str, ...]:
    """How late a position is, its floor and place, and how sure that is: the protection radius, else that of 95 %; of a lost wearer the last one."""
    r = m.at(now_s)
    if p := r.position:
        sure = f"±{metres(p.radius95_m)}" if p.protection_m is None else f"within {metres(p.protection_m)}"
        return late_words(p.age_s), p.floor_name, p.where, sure
    return (f"last known {span_words(p.age_s)} ago", p.floor_name, p.where) if (p := r.last_place) else ()


def heard_words(silent_s: float) -> str:
    """Time since a member's last report, in words."""
    return "heard now" if silent_s < 1.5 else f"heard {span_words(silent_s)} ago"


def metres(m: float) -> str:
    """A length as text: 0.4 m, 12 m."""
    return f"{m:.1f} m" if m < 9.95 else f"{m:.0f} m"


def shown_details(
    number: int, m: Member, plan: Plan, now_s: float, history: tuple[ShownEvent, ...], duplicates: set[tuple[str, str]]
) -> ShownDetails:
    """All fields of the last report, in words."""
    r = m.at(now_s)
    p, where = r.last_known, ", ".join(filter(None, where_words(m, now_s)))
    rows = [("alarm", alarm_words(r.alarm))] if r.alarm else []
    rows += [("state", m.state(now_s).value), ("heard", heard_words(m.silent_s(now_s)).removeprefix("heard "))]
    if p and not r.position:
        rows += [("place", "not known"), ("last known", where)]
    elif p:
        rows += [("floor", f"{p.floor_name} ({100.0 * p.floor_probability:.0f} %)"), ("place", p.where or "not named")]
        rows += [("position", f"x {p.x_m:.1f}, y {p.y_m:.1f} m"), ("95 % within", metres(p.radius95_m))]
        rows += [("safe radius", metres(p.protection_m) if p.protection_m is not None else "none")]
        rows += [("heading", heading_on(plan, m))]
    if r.motion:
        rows += [("walked", f"{r.motion.walked_m:.0f} m"), ("last step", f"{span_words(r.motion.still_s)} ago")]
    if r.trunk_tilt_deg is not None:
        rows += [("trunk", tilt_words(r.trunk_tilt_deg))]
    if r.battery_percent is not None:
        rows += [("battery", f"{r.battery_percent} %")]
    if s := r.streams:
        rows += [("frames", f"{s.bad} bad frames, {s.lost} lost frames, {s.dropped} dropped frames")]
    rows += [("reports missed", str(m.missed)), ("source", r.source), ("run", r.run), ("version", r.version)]
    rows += [("note", note) for note in notes(m, plan, now_s, duplicates)]
    return ShownDetails(number, tuple(ShownFact(name, value) for name, value in rows), history)


def tilt_words(tilt_deg: float) -> str:
    """The trunk's tilt: upright (4°), bent (40°), lying (85°); the limits are in `wearer/falls.py`."""
    tilt_rad = math.radians(tilt_deg)
    posture = "upright" if tilt_rad < UPRIGHT_RAD else "lying" if tilt_rad > LYING_RAD else "bent"
    return f"{posture} ({tilt_deg:.0f}°)"
