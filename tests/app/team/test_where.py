# SPDX-License-Identifier: MIT
"""Where a wearer is in words, for the commander and TAK; a lost wearer is nowhere, and what was known before is told with its age."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import pytest
from rich.console import Console

from echostep.localization import Estimate, LikelyPlace, TrackStatus
from echostep.plan import NO_PLAN
from echostep.tracker import Tracker
from echostep.walk.table import columns_of
from echostep_app.operation.operation import Operation
from echostep_app.operation.terminal import listed
from echostep_app.operation.words import level_on, shown_wearer
from echostep_app.output.map_files import TrackOnPlan
from echostep_app.output.terminal import describe
from echostep_app.page.elements.taps import Taps
from echostep_app.printing.console import console
from echostep_app.session.results import Result, write_results
from echostep_app.team.commander import notes
from echostep_app.team.cot import events, remarks
from echostep_app.team.messages import report as reports
from echostep_app.team.messages.marks import MarkBoard
from echostep_app.team.messages.report import BadReportError, Report, ReportedAlarm, decode, encode
from echostep_app.team.outbox import stamped
from echostep_app.team.roster import Roster
from page.frames import told
from team.team_reports import POSITION, UNIX, offered, report
from walks import PLAN


def test_a_published_estimate_names_the_room() -> None:
    reports = offered(PLAN, told(6.0, 9.0), told(6.3, 7.5))
    assert [made.position.where for made in reports if made.position] == ["in Office 1", "in North corridor"]


def test_the_commander_and_tak_see_it() -> None:
    made = report(position=replace(POSITION, where="in Office 1"))
    assert "; in Office 1, Ground floor; " in remarks(decode(encode(made)))
    roster = Roster()
    roster.receive("echostep/red/anna/estimate", encode(made), False, 0.0, made.sent_s)
    (member,) = roster.members(0.0)
    assert ", in Office 1, " in shown_wearer(1, member, PLAN, 0.0, set(), MarkBoard()).words


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
    roster = Roster()
    assert roster.receive("echostep/red/anna/estimate", encode(made), False, 0.0, made.sent_s)
    (member,) = roster.members(0.0)
    assert "tracked without a plan" in notes(member, PLAN, 0.0, set())
    assert level_on(PLAN, member) is None
    assert made.plan_sha256 not in (PLAN.digest, NO_PLAN.digest)


def test_the_name_of_a_plan_is_no_markup() -> None:
    console = Console(width=80)
    with console.capture() as shown:
        console.print(listed(Operation(PLAN).scene(0.0, 0.0), "[/wrong]"))
    assert "[/wrong]: 0 wearers" in shown.get()


OFFICE, CORRIDOR = (6.0, 9.0), (6.3, 7.5)  # of the demo's building
PLACES = tuple(LikelyPlace(0.5, x, y, 0, 0.1, 0.0) for x, y in (OFFICE, CORRIDOR))


def lost(t_s: float) -> Estimate:
    return replace(told(*CORRIDOR), t_s=t_s, status=TrackStatus.LOST, hypotheses=PLACES)


@pytest.fixture
def published() -> list[Report]:
    """Lost from the start; then known in an office; then lost for 40 s."""
    reports = offered(PLAN, lost(10.0), replace(told(*OFFICE), t_s=20.0), lost(60.0))
    return [decode(encode(stamped(made, k, UNIX, 0.0, 0))) for k, made in enumerate(reports)]


def test_its_report_has_no_position_and_the_last_known_one_with_its_age(published: list[Report]) -> None:
    first, known, last = published
    assert [made.status for made in published] == ["lost", "tracking", "lost"]
    assert (first.position, first.place, first.last_place) == (None, None, None)
    assert known.position
    assert known.position.where == "in Office 1"
    assert (last.position, last.place) == (None, None)
    assert last.last_place
    assert (last.last_place.where, last.last_place.age_s) == ("in Office 1", 40.0)
    assert last.last_place.radius95_m > 60.0  # 40 s at 1.5 m/s


def test_the_commander_reads_where_it_was_and_how_long_ago(published: list[Report]) -> None:
    roster = Roster()
    for k, made in enumerate(published):
        assert roster.receive("echostep/red/anna/estimate", encode(made), False, float(k), UNIX)
    (member,) = roster.members(2.0)
    words = shown_wearer(1, member, PLAN, 2.0, set(), MarkBoard()).words
    assert words == "lost, last known 40 s ago, Ground floor, in Office 1, heard now"


def test_tak_has_no_point_of_it(published: list[Report]) -> None:
    assert [len(events(made)) for made in published] == [0, 1, 0]
    made = report(status="lost", position=None, place=None, last_place=published[2].last_place)
    assert not events(made)
    (mayday,) = events(replace(made, alarm=ReportedAlarm("mayday", "help", 1, 3.0)))
    event = ElementTree.fromstring(mayday)
    assert event.find("point").get("ce") == "9999999.0"  # type: ignore[union-attr]
    assert "place not known; last known 40 s ago, in Office 1, Ground floor" in (event.findtext("detail/remarks") or "")


def test_the_terminal_and_the_page_name_no_place() -> None:
    assert describe(lost(10.0), PLAN).startswith("lost: place not known, 2 places fit, 100 % in all")
    taps = Taps(PLAN)
    assert (taps.where(lost(10.0)), taps.where(told(*OFFICE))) == ("", "in Office 1")
    assert taps.places(lost(10.0)) == "places that fit: 1 in Office 1 50 % · 2 in North corridor 50 %"


def test_the_last_line_of_a_run_says_so(tmp_path: Path) -> None:
    with console.capture() as printed:
        write_results(tmp_path, Tracker(PLAN), None, Result("a walk", [told(*OFFICE), lost(10.0)]))
    assert "end: place not known" in printed.get()
    assert "corridor" not in printed.get()


def test_files_for_maps_have_no_point_of_it() -> None:
    track = TrackOnPlan([told(*OFFICE), lost(10.0), replace(told(*CORRIDOR), t_s=11.0)], PLAN, [])
    assert track.stretches == [[0], [2]]
    assert columns_of(track.estimates, PLAN)["status"][1] == "lost"
