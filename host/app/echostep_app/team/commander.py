# SPDX-License-Identifier: MIT
"""Remarks on the members of a team, and the roster as JSON.

In: a roster, a plan. Out: words, JSON objects. Owns nothing.
"""

from __future__ import annotations

from typing import Any

from echostep.plan import NO_PLAN, Plan
from echostep_app.plan.places.bearing import heading_words
from echostep_app.team.cot import alarm_words
from echostep_app.team.messages.report import WITHOUT_PLAN
from echostep_app.team.roster import CLOCK_OFF_S, NO_STEP_S, Member, Roster

LOW_BATTERY_PERCENT = 20


def rejected(roster: Roster) -> str:
    """Reasons of rejected payloads with counts, the most frequent first."""
    return ", ".join(f"{count} x {why}" for why, count in roster.rejected.most_common(6))


def heading_on(plan: Plan, m: Member) -> str:
    """The last heading of a member in words; one that was tracked on another plan has its own north."""
    p = m.report.last_known
    known = plan if m.report.plan_sha256 == plan.digest else NO_PLAN
    return heading_words(known, p.heading_rad if p else None)


def notes(m: Member, plan: Plan, now_s: float, duplicates: set[tuple[str, str]]) -> list[str]:
    """Remarks on a member: alarm, name used twice, broken connection, rest, other plan, clock, battery, faults."""
    remarks, r = [], m.at(now_s)
    if m.key[:2] in duplicates:
        remarks.append(f"name used twice (run {r.run})")
    if r.alarm:
        remarks.append(alarm_words(r.alarm))
    if m.presence == "broken":
        remarks.append("connection broke")
    if r.motion and r.motion.still_s > NO_STEP_S:
        remarks.append(f"still for {r.motion.still_s:.0f} s")
    if r.source != "live":
        remarks.append(r.source)
    if r.plan_sha256 == WITHOUT_PLAN:
        remarks.append("tracked without a plan")
    elif r.plan_sha256 != plan.digest:
        remarks.append(f"tracked on another plan ({r.plan})")
    if not m.retained and abs(m.clock_ahead_s) > CLOCK_OFF_S:
        remarks.append(f"clock {'ahead' if m.clock_ahead_s > 0 else 'behind'} by {abs(m.clock_ahead_s):.0f} s")
    if r.battery_percent is not None and r.battery_percent < LOW_BATTERY_PERCENT:
        remarks.append(f"battery {r.battery_percent} %")
    remarks += r.streams.findings if r.streams else ()
    remarks += [f"{event} {count} x" for event, count in m.notes.items()]
    return remarks


def as_tree(roster: Roster, plan: Plan, now_s: float) -> dict[str, Any]:
    """The roster as JSON objects."""
    members, duplicates = roster.members(now_s), roster.duplicates(now_s)
    return {
        "plan": plan.name,
        "heard": roster.received,
        "not_believed": dict(roster.rejected.most_common()),
        "members": [_member(m, plan, now_s, duplicates) for m in members],
    }


def _member(m: Member, plan: Plan, now_s: float, duplicates: set[tuple[str, str]]) -> dict[str, Any]:
    import msgspec

    r = m.at(now_s)
    return {
        "team": m.report.team,
        "name": m.report.name,
        "state": m.state(now_s).value,
        "silent_s": round(m.silent_s(now_s), 3),
        "stale": m.silent_s(now_s) > m.stale_after_s or m.presence == "broken",
        "presence": m.presence,
        "remembered": m.retained,
        "radius95_m": r.last_known and r.last_known.radius95_m,
        "clock_ahead_s": round(m.clock_ahead_s, 3),
        "missed": m.missed,
        "notes": notes(m, plan, now_s, duplicates),
        "report": msgspec.to_builtins(m.report),
    }
