# SPDX-License-Identifier: MIT
"""A report of distress with a commander's data for help: place, time since, nearest stairs, nearest wearers; and the errand that sends one.

In: members of the team, the plan. Out: `ShownDistress`: plain data, whose field names are keys of the page's JSON; `Errand`s. Owns nothing.
Distances are straight, for a list that is made twice a second; the sent wearer's page finds the way.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import shapely

from echostep.plan import Plan
from echostep_app.operation.words import level_on, metres, where_words
from echostep_app.plan.routing import CLIMB
from echostep_app.team.cot import alarm_words
from echostep_app.team.messages.marks import Errand, MarkBoard
from echostep_app.team.messages.report import Position, printable
from echostep_app.team.roster import Member, MemberState

MOST_RESCUERS = 3  # shown; assumed
ON_DUTY = (MemberState.TRACKING, MemberState.UNCERTAIN)  # states of wearers who can be sent


@dataclass(frozen=True, slots=True)
class ShownRescuer:
    """A wearer who can be sent: the distance in words. `sent`: this is under way, and by whom; empty: it is not."""

    id: int
    name: str
    words: str
    sent: str


@dataclass(frozen=True, slots=True)
class ShownDistress:
    """A wearer in distress. `rescuers`: the nearest first."""

    place: str
    since: str
    stairs: str
    rescuers: tuple[ShownRescuer, ...]


def shown_distress(
    m: Member, members: Sequence[tuple[int, Member]], plan: Plan, now_s: float, board: MarkBoard
) -> ShownDistress | None:
    """Of a member with a mayday, or asked after a fall; None for others. `members`: all, with their numbers."""
    if m.state(now_s) not in (MemberState.MAYDAY, MemberState.ASKED):
        return None
    r = m.at(now_s)
    p, where = r.last_known, ", ".join(filter(None, where_words(m, now_s))) or "not known"
    since = alarm_words(r.alarm) if r.alarm else ""
    if p is None or level_on(plan, m) is None:
        return ShownDistress(where, since, "", ())
    ready = [(n, o) for n, o in members if o is not m and o.state(now_s) in ON_DUTY and level_on(plan, o) is not None]
    near = sorted((_away_m(plan, p, o.at(now_s).position), n, o) for n, o in ready)
    rescuers = tuple(
        ShownRescuer(n, o.report.name, _away_words(p, o.at(now_s).position), _sent_words(m, o, board))
        for _, n, o in near[:MOST_RESCUERS]
    )
    return ShownDistress(where, since, nearest_stairs(plan, p), rescuers)


def errand_to(m: Member, plan: Plan, now_s: float, by: str, unix_s: float) -> Errand | None:
    """The errand to a member's last known place; None while it is not known on this plan."""
    p = m.at(now_s).last_known
    if p is None or level_on(plan, m) is None:
        return None
    where = printable(", ".join(filter(None, (p.floor_name, p.where))), 200)
    return Errand(1, m.report.name, where, p.x_m, p.y_m, p.floor, by, unix_s, plan.digest)


def nearest_stairs(plan: Plan, p: Position) -> str:
    """The nearest stairs of a position's level, else the nearest lift or ramp, and how far they are; empty where the plan has none."""
    at = shapely.Point(p.x_m, p.y_m)
    ways = [
        (way.kind != "stairs", float(shapely.Polygon(way.outline_m).distance(at)), way.name or way.kind)
        for way in plan.connectors if p.floor in way.levels
    ]  # fmt: skip
    if not ways:
        return ""
    _, away_m, name = min(ways)
    return f"{name}, {metres(away_m)}" if away_m > 0.0 else f"on {name}"


def _away_m(plan: Plan, a: Position, b: Position | None) -> float:
    """Straight distance on the plan and the heights between, a metre of which costs as much as it does a route."""
    if b is None:
        return math.inf
    heights = [plan.levels[p.floor].height_m for p in (a, b)]
    return math.hypot(a.x_m - b.x_m, a.y_m - b.y_m) + CLIMB * abs(heights[0] - heights[1])


def _away_words(a: Position, b: Position | None) -> str:
    """How far away a wearer is: "12 m", on another floor "1 floor below, 12 m aside"."""
    if b is None:
        return ""
    floors = b.floor - a.floor
    aside = metres(math.hypot(a.x_m - b.x_m, a.y_m - b.y_m))
    if not floors:
        return aside
    return f"{abs(floors)} floor{'s' * (abs(floors) > 1)} {'above' if floors > 0 else 'below'}, {aside} aside"


def _sent_words(m: Member, o: Member, board: MarkBoard) -> str:
    errand = board.errands.get(o.key)
    return f"sent by {errand.by}" if errand and errand.to == m.report.name else ""
