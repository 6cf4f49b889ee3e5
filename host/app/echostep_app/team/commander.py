# SPDX-License-Identifier: MIT
"""The commander's view on a terminal: a team on one plan, the most urgent states first.

In: a roster, a plan. Out: a table, or the roster as JSON. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.cells import cell_len, set_cell_size
from rich.console import Group
from rich.table import Table
from rich.text import Text

from echostep.plan import NO_PLAN, Plan
from echostep_app.plan.places.bearing import heading_words
from echostep_app.team.cot import alarm_words
from echostep_app.team.messages.report import WITHOUT_PLAN
from echostep_app.team.roster import CLOCK_OFF_S, NO_STEP_S, Member, MemberState, Roster, nearest

ALL_COLUMNS_WIDTH = 136  # characters; a narrower terminal shows fewer columns
MAX_COLUMN_WIDTH = 24  # characters, of words
LEAST_NOTE = 8  # characters
EDGES, APART = 2, 2  # characters beside the table and between its columns [rich.box.SIMPLE_HEAD]
TABLE_LINES = 8  # of a table beside its members: title, head, and what is below it
LOW_BATTERY_PERCENT = 20
NO_ESTIMATE_S = 3.0  # an older estimate is mentioned in the state
COLUMNS = {
    "name": "left", "state": "left", "x, y m": "right", "±95% m": "right", "floor": "left", "where": "left",
    "looks": "right", "nearest m": "left", "walked m": "right", "note": "left",
}  # fmt: skip
# In this order where the terminal is too narrow
DROPPED = ("where", "walked m", "looks", "nearest m", "floor", "±95% m", "x, y m", "note")
WORDS = ("name", "floor", "where", "nearest m")  # may be cut short at their end; a cut number would be another number
NOTHING_HEARD = (
    "nothing heard yet: does a tracker publish there, and does the broker's access list let this user read echostep/#?"
)
STYLES = {
    MemberState.MAYDAY: "bold blink white on red", MemberState.ASKED: "bold white on red", MemberState.LOST: "bold white on red",
    MemberState.STALE: "bold red", MemberState.UNCERTAIN: "yellow",
    MemberState.WAITING: "cyan", MemberState.TRACKING: "green", MemberState.ENDED: "grey62",
}  # fmt: skip


def table(
    roster: Roster,
    plan: Plan,
    now_s: float,
    *,
    connected: bool,
    columns: int = ALL_COLUMNS_WIDTH,
    lines: int | None = None,
) -> Group:
    """The roster as a table, a line per member, `columns` characters wide; `lines`: of the most urgent members only, as many as there is room for."""
    members = roster.members(now_s)
    grid = Table(
        title=Text(f"{plan.name}: {summary(members, now_s)}"),
        title_justify="left",
        box=SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
    )
    duplicates = roster.duplicates(now_s)
    shown = members if lines is None else members[: max(lines - TABLE_LINES, 1)]
    rows = [_cells(m, members, plan, now_s, duplicates) for m in shown]
    widths = _widths(rows, columns)
    for name, width in widths.items():
        grid.add_column(name, justify=COLUMNS[name], no_wrap=True, width=width)  # type: ignore[arg-type]
    for m, row in zip(shown, rows, strict=True):
        grid.add_row(
            *(Text(_shortened(row[name], width)) for name, width in widths.items()), style=STYLES[m.state(now_s)]
        )
    below = [Text(f"and {len(members) - len(shown)} more", style="grey62")] if len(shown) < len(members) else []
    if not connected:
        below.append(Text("no connection to the broker", style="bold red"))
    elif not roster.received:
        below.append(Text(NOTHING_HEARD, style="yellow"))
    if roster.rejected:
        below.append(Text(f"rejected: {rejected(roster)}", style="grey62"))
    return Group(grid, *below)


def _widths(rows: Sequence[Mapping[str, str]], columns: int) -> dict[str, int]:
    """Width of each column that fits into `columns` characters; the note takes the rest."""
    widths = {name: max([len(name), *(cell_len(row[name]) for row in rows)]) for name in COLUMNS}
    widths |= {name: min(widths[name], MAX_COLUMN_WIDTH) for name in WORDS} | {"note": LEAST_NOTE}

    def left() -> int:
        return columns - EDGES - sum(width + APART for width in widths.values())

    for name in DROPPED:
        if left() < 0:
            del widths[name]
    last = "note" if "note" in widths else "name"
    widths[last] = max(widths[last] + left(), LEAST_NOTE)
    return widths


def _shortened(text: str, width: int) -> str:
    """The text, or as much of it as fits; a word with a number in it is left out rather than cut."""
    if cell_len(text) <= width:
        return text
    head = set_cell_size(text, width - 1).rstrip()
    begun, _, cut = head.rpartition(" ")
    whole = text[len(begun) + 1 :].split(" ", maxsplit=1)[0] if begun else ""
    return f"{begun if cut != whole and any(map(str.isdigit, whole)) else head}…"


def summary(members: Sequence[Member], now_s: float) -> str:
    """Number of members, and of those in each state."""
    states = [m.state(now_s) for m in members]
    return f"{len(members)} tracker{'s' * (len(members) != 1)}" + "".join(
        f", {states.count(s)} {s}" for s in MemberState if s in states
    )


def rejected(roster: Roster) -> str:
    """Reasons of rejected payloads with counts, the most frequent first."""
    return ", ".join(f"{count} x {why}" for why, count in roster.rejected.most_common(6))


def _cells(
    m: Member, members: Sequence[Member], plan: Plan, now_s: float, duplicates: set[tuple[str, str]]
) -> dict[str, str]:
    r, p, near = m.report, m.position(now_s), nearest(m, members)
    return {
        "name": f"{r.team}/{r.name}",
        "state": _state(m, now_s),
        "x, y m": f"{p.x_m:.1f}, {p.y_m:.1f}" if p else "",
        "±95% m": f"{p.radius95_m:.1f}" if p else "",
        "floor": p.floor_name if p else "",
        "where": "" if p is None else p.where if r.position else f"last: {p.where}" if p.where else "last",
        "looks": "" if p is None or p.heading_rad is None else heading_on(plan, m),
        "nearest m": f"{near[0]:.1f} {near[1].report.name}" if near else "",
        "walked m": f"{r.motion.walked_m:.0f}" if r.motion else "",
        "note": "; ".join(notes(m, plan, now_s, duplicates)),
    }


def heading_on(plan: Plan, m: Member) -> str:
    """The last heading of a member in words; one that was tracked on another plan has its own north."""
    p = m.report.last_known
    known = plan if m.report.plan_sha256 == plan.digest else NO_PLAN
    return heading_words(known, p.heading_rad if p else None)


def _state(m: Member, now_s: float) -> str:
    """State, and for how long no report or no estimate has come."""
    state, silent_s, p = m.state(now_s), m.silent_s(now_s), m.report.last_known
    is_current = state not in (MemberState.STALE, MemberState.ENDED) and silent_s <= m.stale_after_s
    if is_current:
        return f"{state}, no estimate {p.age_s:.0f} s" if p and p.age_s > NO_ESTIMATE_S else state.value
    return f"{state} {silent_s:.0f} s" if state is MemberState.STALE else f"{state}, silent {silent_s:.0f} s"


def notes(m: Member, plan: Plan, now_s: float, duplicates: set[tuple[str, str]]) -> list[str]:
    """Remarks on a member: alarm, name used twice, broken connection, rest, other plan, clock, battery, faults."""
    remarks, r = [], m.report
    if m.key[:2] in duplicates:
        remarks.append(f"name used twice (run {r.run})")
    if r.alarm:
        remarks.append(alarm_words(replace(r.alarm, age_s=r.alarm.age_s + m.silent_s(now_s))))
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
        "members": [_member(m, members, plan, now_s, duplicates) for m in members],
    }


def _member(
    m: Member, members: Sequence[Member], plan: Plan, now_s: float, duplicates: set[tuple[str, str]]
) -> dict[str, Any]:
    import msgspec

    near = nearest(m, members)
    return {
        "team": m.report.team,
        "name": m.report.name,
        "state": m.state(now_s).value,
        "silent_s": round(m.silent_s(now_s), 3),
        "stale": m.silent_s(now_s) > m.stale_after_s or m.presence == "broken",
        "presence": m.presence,
        "remembered": m.retained,
        "radius95_m": p.radius95_m if (p := m.position(now_s)) else None,
        "clock_ahead_s": round(m.clock_ahead_s, 3),
        "missed": m.missed,
        "nearest": {"name": near[1].report.name, "distance_m": near[0]} if near else None,
        "notes": notes(m, plan, now_s, duplicates),
        "report": msgspec.to_builtins(m.report),
    }
