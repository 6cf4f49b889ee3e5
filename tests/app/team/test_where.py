# SPDX-License-Identifier: MIT
"""A report says in words where the wearer is; a report of an older tracker says nothing there."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest
from rich.console import Console

from echostep.plan import NO_PLAN, load_plan
from echostep_app.operation.words import level_on
from echostep_app.team.commander import notes, table
from echostep_app.team.cot import remarks
from echostep_app.team.messages import report as reports
from echostep_app.team.messages.report import BadReportError, decode, encode
from echostep_app.team.roster import Roster
from page.frames import told
from team.team_reports import PLAN, POSITION, offered, report


def test_a_published_estimate_names_the_room() -> None:
    reports = offered(load_plan(PLAN), told(6.0, 9.0), told(6.3, 7.5))
    assert [made.position.where for made in reports if made.position] == ["in Office 1", "in North corridor"]


def test_the_commander_and_tak_see_it() -> None:
    made = report(position=replace(POSITION, where="in Office 1"))
    assert "; in Office 1, Ground floor; " in remarks(decode(encode(made)))
    roster = Roster()
    roster.receive("echostep/red/anna/estimate", encode(made), False, 0.0, made.sent_s)
    (grid, *_) = table(roster, load_plan(PLAN), 0.0, connected=True).renderables
    assert "where" in [column.header for column in grid.columns]  # type: ignore[union-attr]
    (narrow, *_) = table(roster, load_plan(PLAN), 0.0, connected=True, columns=80).renderables
    assert "where" not in [column.header for column in narrow.columns]  # type: ignore[union-attr]


def test_an_older_report_has_no_place_in_words_and_a_hostile_one_is_refused() -> None:
    tree = json.loads(encode(report()))
    del tree["position"]["where"]
    position = decode(json.dumps(tree).encode()).position
    assert position is not None
    assert position.where == ""
    with pytest.raises(BadReportError, match="unprintable"):
        decode(reports.encode(report(position=replace(POSITION, where="in \x1b[2J"))))


def test_a_wearer_without_a_plan_is_believed_and_meets_nobody_on_a_plan() -> None:
    """Its frame is its own: it is listed, and on no plan."""
    (own,) = offered(NO_PLAN, told(6.0, 9.0))
    made = replace(report(), position=own.position, plan=own.plan, plan_sha256=own.plan_sha256)
    roster, plan = Roster(), load_plan(PLAN)
    assert roster.receive("echostep/red/anna/estimate", encode(made), False, 0.0, made.sent_s)
    (member,) = roster.members(0.0)
    assert "tracked without a plan" in notes(member, plan, 0.0, set())
    assert level_on(plan, member) is None
    assert made.plan_sha256 not in (plan.digest, NO_PLAN.digest)


def test_the_name_of_a_plan_is_no_markup() -> None:
    (grid, *_) = table(Roster(), replace(load_plan(PLAN), name="[/wrong]"), 0.0, connected=True).renderables
    console = Console(width=80)
    with console.capture() as shown:
        console.print(grid)
    assert "[/wrong]: 0 trackers" in shown.get()
