# SPDX-License-Identifier: MIT
"""The georeference by two clicks in `plan edit`: degrees as people paste them, what follows is shown, refused where the distances disagree."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from board_runs import ROOT
from echostep.plan import Georeference, Plan, load_plan
from echostep_app.page.editor import EditServer
from echostep_app.plan.georeference import EarthTransform
from echostep_app.plan.writer import save_plan
from page.browser import violations, wait_for
from page.edit.drawing import PHONES, PICTURES, answer, answered, click, on_phone, opened, status, tap
from waiting import until

DEMO = ROOT / "host/core/echostep/plans/demo.json"
TRUE = Georeference(11.5755, 48.1374, 0.3)  # y points 17.2 degrees west of north
CORNERS = ((1.0, 1.0), (25.0, 13.0))  # of the demo's outer walls: 26.83 m apart


@pytest.fixture
def bare(tmp_path: Path) -> Iterator[EditServer]:
    """The demo's plan without its georeference."""
    save_plan(replace(load_plan(DEMO), georeference=None), tmp_path / "plan.json")
    with EditServer(tmp_path / "plan.json", port=0) as server:
        yield server


def pasted(factor: float = 1.0) -> list[str]:
    """Latitude and longitude of the two corners, as a map application gives them; `factor`: of their distance."""
    xy_m = np.array(CORNERS)
    degrees = EarthTransform(TRUE).degrees(xy_m[0] + factor * (xy_m - xy_m[0]))
    return [f"{lat:.7f}, {lon:.7f}" for lon, lat in degrees]


def written(page: Any, server: EditServer) -> Plan:
    page.click("#save")
    page.get_by_text("Saved plan.json").wait_for()
    return load_plan(server.file.path)


def mentions(page: Any, words: str) -> None:
    """These words come to be part of what the page says."""
    assert until(lambda: words in status(page)), status(page)


def test_two_corners_give_the_georeference(browser: Any, bare: EditServer, tmp_path: Path) -> None:
    page = opened(browser, bare)
    assert page.is_hidden("#north")
    page.click('[data-tool="earth"]')
    click(page, *CORNERS[0])
    page.fill("#answer", "the corner at the bakery")
    page.press("#answer", "Enter")
    assert "Not latitude, then longitude" in page.text_content("#ask-wrong")
    answer(page, pasted()[0])
    mentions(page, "First point 48.1374")
    page.click("#closer")  # the first point stays
    click(page, 20.0, 5.0)
    page.locator("#ask[open]").wait_for()
    page.click("#no")  # not there
    answered(page)
    page.click("#whole")
    click(page, *CORNERS[1])
    answer(page, pasted(1.01)[1])
    mentions(page, "Georeference: y points 342.8° from north; 26.83 m here are 27.10 m on Earth, 1.0 % longer")
    wait_for(page, "document.querySelector('#north-text').textContent === 'north; y points 342.8°'")  # it is drawn
    turned = page.get_attribute(
        "#north-arrow", "transform"
    )  # clockwise on the page, as x points counter-clockwise from east
    assert float(turned.removeprefix("rotate(").removesuffix(")")) == pytest.approx(
        np.degrees(TRUE.rotation_rad), abs=0.01
    )
    page.screenshot(path=(PICTURES or tmp_path) / "plan-edit-earth.png")
    found = written(page, bare).georeference
    assert found is not None
    assert found.rotation_rad == pytest.approx(TRUE.rotation_rad, abs=1e-3)
    assert EarthTransform(found).degrees(np.array([[13.0, 7.0]])) == pytest.approx(
        EarthTransform(TRUE).degrees(np.array([[13.0, 7.0]])), abs=2e-6
    )
    page.click("#step-back")
    assert status(page).startswith("Undone: Georeference")
    wait_for(page, "document.querySelector('#north').hidden")
    assert written(page, bare).georeference is None
    assert not page.wrong


@pytest.mark.parametrize(
    ("factor", "words"),
    [(1.08, "28.98 m on Earth, 8.0 % longer: more than 5 %"), (0.0, "0.00 m on Earth, 100.0 % shorter")],
)
def test_distances_that_disagree_are_refused(browser: Any, bare: EditServer, factor: float, words: str) -> None:
    page = opened(browser, bare)
    page.click('[data-tool="earth"]')
    for corner, text in zip(CORNERS, pasted(factor), strict=True):
        click(page, *corner)
        answer(page, text)
    mentions(page, "No georeference: the two points are 26.83 m apart on the plan and " + words)
    kept = "[echostep.sheet.past.length, echostep.tools.points.length, echostep.tools.known.length]"
    assert page.evaluate(kept) == [0, 0, 0]
    assert [text for text in page.wrong if "422" not in text] == []


def test_a_server_that_has_ended_is_told(browser: Any, bare: EditServer) -> None:
    page = opened(browser, bare)
    page.route("**/georeference", lambda route: route.abort())
    page.click('[data-tool="earth"]')
    for corner, text in zip(CORNERS, pasted(), strict=True):
        click(page, *corner)
        answer(page, text)
    mentions(page, "No georeference: echostep does not answer, is it still running?")


def test_keys_alone_give_the_georeference(browser: Any, bare: EditServer) -> None:
    page = opened(browser, bare)
    page.focus("#map")
    page.keyboard.press("e")
    for corner, text in zip(CORNERS, pasted(), strict=True):
        page.evaluate(f"echostep.tools.cross = {json.dumps(corner)}")
        page.keyboard.press("Enter")
        answer(page, text)
    mentions(page, "the same")
    assert not page.wrong


@pytest.mark.parametrize("held", PHONES)
def test_fingers_on_a_phone_held_either_way(browser: Any, bare: EditServer, held: str, tmp_path: Path) -> None:
    page = on_phone(browser, bare, held)
    page.tap('[data-tool="earth"]')
    for corner, text in zip(CORNERS, pasted(), strict=True):
        tap(page, *corner)
        page.locator("#ask[open]").wait_for()
        page.fill("#answer", "x")
        page.tap("#yes")
        wait_for(page, "document.querySelector('#ask-wrong').textContent")
        found = violations(page)
        page.screenshot(path=tmp_path / f"asked-{held}.png")
        assert found == []
        page.fill("#answer", text)
        page.tap("#yes")
        mentions(page, text[:8]) if corner == CORNERS[0] else mentions(page, "Georeference: y points 342.8°")
    found = violations(page)
    page.screenshot(path=tmp_path / f"earth-{held}.png")
    assert found == []
    assert page.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth") == 0
    assert not page.wrong


MUNICH = [48.137154, 11.576124]
READ = {
    "48.137154, 11.576124": MUNICH, "48.137154 11.576124": MUNICH, "48,137154 11,576124": MUNICH, " 48,137154;11,576124 ": MUNICH,
    "48.137154,11.576124": MUNICH, "geo:48.137154,11.576124;u=35": MUNICH, "11.576124 E, 48.137154 N": MUNICH, "N48.137154 E11.576124": MUNICH,
    "48°08'13.7544\"N 11°34'34.0464\"E": MUNICH, "48° 8′ 13.7544″ N, 11° 34′ 34.0464″ E": MUNICH, "N 48° 8.22924' E 11° 34.56744'": MUNICH,
    "https://www.google.com/maps/place/X/@48.137154,11.576124,17z": MUNICH, "https://www.openstreetmap.org/#map=18/48.137154/11.576124": MUNICH,
    "https://www.openstreetmap.org/?mlat=48.137154&mlon=11.576124#map=3/1.0/2.0": MUNICH, "https://x.example/?q=48.137154%2C11.576124": MUNICH,
    "33.4489 S, 70.6693 W": [-33.4489, -70.6693], "−33.4489, -70.6693": [-33.4489, -70.6693], "0, 0": [0, 0], "48, 11": [48, 11],
    **dict.fromkeys(("", "48.1", "north", "91, 10", "48.1, 181", "48.1 N 11.5 N", "48°61'0\"N 11°0'0\"E", "1e5 3", "NaN, NaN", "%", "48.1 N 11.5 O",
                     "https://x.example/", "1 2 3")),
}  # fmt: skip


def test_degrees_as_people_paste_them(browser: Any, bare: EditServer) -> None:
    page = opened(browser, bare)
    found = page.evaluate(
        "async (texts) => { const { readDegrees } = await import(location.href + 'static/degrees.js'); return texts.map(readDegrees); }",
        list(READ),
    )
    for (text, degrees), read in zip(READ.items(), found, strict=True):
        assert read == (degrees if degrees is None else pytest.approx(degrees, abs=1e-9)), text
