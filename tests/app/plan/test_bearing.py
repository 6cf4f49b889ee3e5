# SPDX-License-Identifier: MIT
"""Headings in words: clockwise from north, by the georeference, without a letter where there is no plan; the same wherever people read one."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from board_runs import ROOT
from echostep.plan import NO_PLAN, Georeference, load_plan
from echostep_app.operation.words import shown_details
from echostep_app.output.terminal import describe
from echostep_app.page.mailbox import Mailbox
from echostep_app.plan.georeference import EarthTransform
from echostep_app.plan.places.bearing import heading_words
from echostep_app.team.commander import table
from echostep_app.team.messages.report import encode
from echostep_app.team.roster import Roster
from page.frames import next_frame, opened, scene, served, told
from team.team_reports import POSITION, report

DEMO = ROOT / "host/core/echostep/plans/demo.json"
PLAN = replace(load_plan(DEMO), georeference=None)
QUARTER = 0.5 * math.pi


@pytest.mark.parametrize(
    ("heading_rad", "words"),
    [
        (0.0, "E 090°"), (QUARTER, "N 000°"), (math.pi, "W 270°"), (-math.pi, "W 270°"), (-QUARTER, "S 180°"), (0.25 * math.pi, "NE 045°"),
        (math.radians(90.4), "N 000°"), (math.radians(90.6), "N 359°"), (7.0, "NE 049°"), (math.radians(138.0), "NW 312°"),
    ],
)  # fmt: skip
def test_a_heading_is_clockwise_from_plan_north_in_three_digits(heading_rad: float, words: str) -> None:
    assert heading_words(PLAN, heading_rad) == f"{words}, plan north"


@pytest.mark.parametrize("rotation_deg", [0.0, 30.0, -100.0, 200.0])
def test_north_is_that_of_the_earth_where_the_plan_lies_on_it(rotation_deg: float) -> None:
    """The way from the origin along the map's x axis leads to where the words say, by longitude and latitude."""
    placed = replace(PLAN, georeference=Georeference(7.0, 50.0, math.radians(rotation_deg)))
    assert placed.georeference is not None
    ((lon, lat),) = EarthTransform(placed.georeference).degrees(np.array([[100.0, 0.0]]))
    east, north = (lon - 7.0) * math.cos(math.radians(50.0)), lat - 50.0
    shown = heading_words(placed, 0.0)
    assert int(shown.split()[1].rstrip("°")) == pytest.approx(math.degrees(math.atan2(east, north)) % 360.0, abs=1.0)
    assert "plan north" not in shown


def test_without_a_plan_there_is_no_letter_and_an_unknown_heading_has_no_number() -> None:
    assert heading_words(NO_PLAN, 0.0) == "090°"
    assert heading_words(PLAN, 0.0, 0.05) == "E 090° ±3°, plan north"
    assert heading_words(PLAN, 0.0, 1.1) == heading_words(PLAN, None) == "not known"


def test_page_terminal_and_commander_say_the_same() -> None:
    plan = replace(PLAN, georeference=Georeference(7.0, 50.0, math.radians(30.0)))
    west = replace(told(), heading_rad=math.pi)
    assert "heading SW 240° ±1°   step" in describe(west, plan)
    with served(Mailbox(plan, "test", replay=False)) as (server, mailbox), opened(server) as page:
        page.recv()  # hello
        mailbox.publish(replace(scene(), estimate=west))
        assert next_frame(page)["told"]["heading"] == "heading SW 240° ±1°"
    for digest, expected in ((plan.digest, "SW 240°"), ("0" * 64, "270°")):  # tracked on this plan, on another one
        roster = Roster()
        made = report(position=replace(POSITION, heading_rad=math.pi), plan_sha256=digest)
        assert roster.receive("echostep/red/anna/estimate", encode(made), False, 0.0, made.sent_s)
        (member,) = roster.members(0.0)
        facts = shown_details(1, member, plan, 0.0, (), set()).facts
        assert [fact.value for fact in facts if fact.name == "heading"] == [expected]
        (grid, *_) = table(roster, plan, 0.0, connected=True).renderables
        (looks,) = (column for column in grid.columns if column.header == "looks")  # type: ignore[union-attr]
        assert [str(cell) for cell in looks.cells] == [expected]
