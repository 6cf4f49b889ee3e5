# SPDX-License-Identifier: MIT
"""A plan on the Earth: zones and bands, headings by the Earth's north wherever people read one."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from echostep.plan import NO_PLAN, Georeference
from echostep_app.operation.words import shown_details
from echostep_app.output.terminal import describe
from echostep_app.page.mailbox import Mailbox
from echostep_app.plan.georeference import EarthTransform
from echostep_app.plan.places.bearing import heading_words
from echostep_app.plan.places.globe import globe_of, utm_band, utm_zone
from echostep_app.team.messages.report import encode
from echostep_app.team.roster import Roster
from page.frames import next_frame, opened, scene, served, told
from team.team_reports import POSITION, report
from walks import PLAN

DEGREE_M = 111_320.0  # along a meridian


@pytest.mark.parametrize(
    ("lon_deg", "lat_deg", "zone"),
    [(44.4, 33.3, "38S"), (5.3, 60.4, "32V"), (2.9, 60.4, "31V"), (8.0, 78.0, "31X"), (10.0, 78.0, "33X"), (22.0, 78.0, "35X"),
     (34.0, 78.0, "37X"),
     (-180.0, 0.0, "1N"), (179.9, -80.0, "60C"), (180.0, 83.9, "1X"),
     (0.0, 84.0, "31X"),
     (16.4, -0.1, "33M"), (16.4, 84.1, "33"), (0.0, -80.1, "31")],
)  # fmt: skip
def test_zones_and_bands(lon_deg: float, lat_deg: float, zone: str) -> None:
    assert f"{utm_zone(lon_deg, lat_deg)}{utm_band(lat_deg)}" == zone


@pytest.mark.parametrize("lat_deg", [-33.9, 0.0, 48.2, 69.6])
def test_linear_within_a_kilometre(lat_deg: float) -> None:
    pyproj = pytest.importorskip("pyproj")
    georeference = Georeference(16.41, lat_deg, 0.4)
    globe = globe_of(replace(PLAN, georeference=georeference))
    assert globe is not None
    turn = np.linspace(0.0, 2.0 * np.pi, 16)
    places = np.array([[globe.x_m, globe.y_m]]) + 1000.0 * np.column_stack((np.cos(turn), np.sin(turn)))
    away = places - [globe.x_m, globe.y_m]
    exact = EarthTransform(georeference).degrees(places)
    linear = np.column_stack([value + away @ [by_x, by_y] for value, by_x, by_y in globe.degrees])
    metres = DEGREE_M * (linear - exact) * [np.cos(np.radians(lat_deg)), 1.0]
    assert np.abs(metres).max() < BENDS_M
    crs = f"EPSG:{326 if lat_deg >= 0.0 else 327}{globe.zone:02d}"
    utm_m = np.column_stack(pyproj.Transformer.from_crs("EPSG:4326", crs, always_xy=True).transform(*exact.T))
    found = np.column_stack([value + away @ [by_x, by_y] for value, by_x, by_y in globe.utm_m])
    assert np.abs(found - utm_m).max() < BENDS_M


BENDS_M = 0.22  # 0.09 m at Vienna, 0.21 m at Tromsø


def test_no_georeference_no_globe() -> None:
    assert globe_of(replace(PLAN, georeference=None)) is None


PLACELESS = replace(PLAN, georeference=None)
QUARTER = 0.5 * math.pi


@pytest.mark.parametrize(
    ("heading_rad", "words"),
    [
        (0.0, "E 090°"), (QUARTER, "N 000°"), (math.pi, "W 270°"), (-math.pi, "W 270°"), (-QUARTER, "S 180°"), (0.25 * math.pi, "NE 045°"),
        (math.radians(90.4), "N 000°"), (math.radians(90.6), "N 359°"), (7.0, "NE 049°"), (math.radians(138.0), "NW 312°"),
    ],
)  # fmt: skip
def test_a_heading_is_clockwise_from_plan_north_in_three_digits(heading_rad: float, words: str) -> None:
    assert heading_words(PLACELESS, heading_rad) == f"{words}, plan north"


@pytest.mark.parametrize("rotation_deg", [0.0, 30.0, -100.0, 200.0])
def test_north_is_that_of_the_earth_where_the_plan_lies_on_it(rotation_deg: float) -> None:
    """The way from the origin along the map's x axis leads to where the words say, by longitude and latitude."""
    placed = replace(PLACELESS, georeference=Georeference(7.0, 50.0, math.radians(rotation_deg)))
    assert placed.georeference is not None
    ((lon, lat),) = EarthTransform(placed.georeference).degrees(np.array([[100.0, 0.0]]))
    east, north = (lon - 7.0) * math.cos(math.radians(50.0)), lat - 50.0
    shown = heading_words(placed, 0.0)
    assert int(shown.split()[1].rstrip("°")) == pytest.approx(math.degrees(math.atan2(east, north)) % 360.0, abs=1.0)
    assert "plan north" not in shown


def test_without_a_plan_there_is_no_letter_and_an_unknown_heading_has_no_number() -> None:
    assert heading_words(NO_PLAN, 0.0) == "090°"
    assert heading_words(PLACELESS, 0.0, 0.05) == "E 090° ±3°, plan north"
    assert heading_words(PLACELESS, 0.0, 1.1) == heading_words(PLACELESS, None) == "not known"


def test_page_terminal_and_commander_say_the_same() -> None:
    plan = replace(PLACELESS, georeference=Georeference(7.0, 50.0, math.radians(30.0)))
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
