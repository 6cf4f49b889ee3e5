# SPDX-License-Identifier: MIT
"""What the page has beside the map, in Chromium: layers, charts, measuring, links, pictures, GeoJSON, units, places on the Earth, keys."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from echostep.localization import TrackStatus
from echostep.plan import Georeference, Plan
from echostep_app.page.elements.alarm import ShownAlarm
from echostep_app.page.elements.echo_lines import EchoLine
from echostep_app.page.elements.scene import PageScene
from echostep_app.page.elements.stream_rates import StreamRates
from echostep_app.page.mailbox import Mailbox
from echostep_app.page.over_time import OverTime
from echostep_app.page.server import PageServer
from page.browser import READY, loaded_page, overflow, painted, picture, spot, violations, wait_for
from page.frames import LOCAL, PLAN, scene, told
from page.web.test_page_sizes import SIZES, UNREACHED
from waiting import until

DESK = {"viewport": {"width": 1280, "height": 800}}
HINT = "document.querySelector('#hint').textContent"
RATES = StreamRates(100.0, 30.0, 0, 0, 0, True, 0, "")
LOOSE = replace(PLAN, georeference=None, digest="9" * 64)
PLACED = replace(PLAN, georeference=Georeference(44.4, 33.3, 0.3), digest="8" * 64)
DONE = "echostep.scene.frame.play?.end_s === 120"


def moment(t_s: float) -> PageScene:
    """A scene of a walk along the corridor: ranges that grow, lost from 60 s to 80 s."""
    status = TrackStatus.LOST if 60.0 <= t_s < 80.0 else TrackStatus.TRACKING
    estimate = told(2.0 + 0.1 * t_s, 7.5, t_s, status)
    lines = tuple(EchoLine(t_s, side, estimate.x_m, 7.5, 1.6, 1.0 + 0.01 * t_s + side, 1.0) for side in (0, 1))
    return replace(
        scene(t_s),
        estimate=estimate,
        echo_lines=lines,
        streams=RATES,
        status_text="lost" if status is TrackStatus.LOST else "tracking, 0.2 m",
        trail_count=int(t_s),
    )


def walked(plan: Plan = LOOSE) -> Mailbox:
    """A replay of two minutes."""
    mailbox = Mailbox(plan, "A walk", replay=True)
    for t_s in np.arange(0.0, 121.0):
        mailbox.trail.add(2.0 + 0.1 * t_s, 7.5, 0)
        mailbox.publish(moment(float(t_s)))
        mailbox.keep(moment(float(t_s)))
    return mailbox


@pytest.fixture(scope="module")
def url() -> Iterator[str]:
    with PageServer(walked(), LOCAL) as server:
        yield server.url


def looking(browser: Any, url: str, how: dict[str, Any] = DESK) -> Any:
    page = loaded_page(browser, url, how, f"{READY} && {DONE}")
    page.click("#play")
    wait_for(page, "!echostep.last.play.playing")
    return page


def test_layers_are_left_out_and_stay_so(browser: Any, url: str) -> None:
    page = looking(browser, url)
    page.locator("#time").fill("50")
    wait_for(page, "Math.abs(echostep.last.play.t_s - 50) < 1")
    assert until(lambda: painted(page, "trail", 4.0, 7.5))
    page.click("#tools-button")
    page.uncheck("#layer-trail")
    page.uncheck("#layer-names")
    page.keyboard.press("Escape")
    assert until(lambda: not painted(page, "trail", 4.0, 7.5))
    wait_for(page, "document.querySelector('#rooms').hasAttribute('hidden')")
    page.reload()
    wait_for(page, f"{READY} && !echostep.scene.layers.shows('trail') && echostep.scene.layers.shows('cloud')")
    assert not page.wrong


def test_charts_show_the_walk_and_what_happened(browser: Any, url: str, tmp_path: Path) -> None:
    page = looking(browser, url)
    page.focus("#map")
    page.keyboard.press("c")
    wait_for(
        page, "document.querySelector('#charts').ariaLabel.includes('left 2.2, right 3.2, foot 100.0, pings 30.0')"
    )
    ticks = "[...document.querySelectorAll('#ticks span')].map((e) => [e.title, parseFloat(e.style.left)])"
    wait_for(page, f"{ticks}.length === 2")
    assert page.evaluate(ticks) == [["lost", 50.0], ["tracking", pytest.approx(66.67, abs=0.01)]]
    box = page.locator("#charts").bounding_box()
    page.mouse.click(box["x"] + 34 + 0.25 * (box["width"] - 34), box["y"] + 80)
    wait_for(page, "Math.abs(echostep.last.play.t_s - 30) < 0.5")
    near = "echostep.charts.near"
    page.mouse.move(box["x"] + 34 + 0.5 * (box["width"] - 40), box["y"] + 80)
    wait_for(page, f"{near}?.[0] === 60")
    page.mouse.wheel(0, -1000)
    wait_for(page, "echostep.charts.span[0] > 45 && echostep.charts.span[1] < 75")
    picture(page, "charts-zoomed", tmp_path)
    page.locator("#charts").dblclick()
    wait_for(page, "echostep.charts.span[1] === 120")
    page.mouse.move(5, 5)
    wait_for(page, f"{near} === null")
    fingers = page.context.new_cdp_session(page)
    at = {"x": box["x"] + 34 + 0.75 * (box["width"] - 40), "y": box["y"] + 80}
    fingers.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": [at]})
    wait_for(page, f"{near}?.[0] === 90")
    fingers.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    wait_for(page, f"{near} === null")
    page.focus("#map")
    page.keyboard.press("t")
    page.click("#events button:has-text('lost')")
    wait_for(page, "echostep.last.play.t_s === 60")
    picture(page, "charts", tmp_path)
    assert not page.wrong


@pytest.mark.long
def test_a_link_leads_to_its_view_and_moment(browser: Any, url: str) -> None:
    page = looking(browser, url)
    page.locator("#time").fill("77.5")
    wait_for(page, "Math.abs(echostep.last.play.t_s - 77.5) < 0.01")
    page.evaluate("echostep.view.grip([300, 200], [340, 230], 1.7, 0.4)")
    page.click("#tools-button")
    page.click("#tool-link")
    wait_for(page, f"{HINT}.startsWith('The link')")
    seen = "[echostep.view.x, echostep.view.y, echostep.view.scale, echostep.view.turn]"
    link, view = page.evaluate(f"[location.href, {seen}]")
    other = loaded_page(
        browser, link, DESK, f"{READY} && echostep.last.play.t_s === 77.5 && !echostep.last.play.playing"
    )
    assert other.evaluate(seen) == pytest.approx(view, abs=0.01)
    bad = loaded_page(browser, f"{url}#x=1e99&y=%00&zoom=-1&floor=zz&t=", DESK, READY)  # is no link
    bad.evaluate("location.hash = ''")
    far = loaded_page(browser, f"{url}#x=1&y=2&zoom=30&floor=900&t=1e8", DESK, READY)
    assert far.evaluate("echostep.scene.level") == 0
    for opened in (page, other, bad, far):
        assert not opened.wrong


def test_two_taps_measure(browser: Any, url: str) -> None:
    page = looking(browser, url)
    page.click("#tools-button")
    page.click("#tool-measure")
    for place in ((2.0, 7.5), (5.0, 11.5)):
        page.mouse.click(*spot(page, *place))
    wait_for(page, f"/^Distance: (4.9|5.0)\\d m/.test({HINT})")
    assert until(lambda: painted(page, "goal", 3.5, 9.5))
    assert page.is_hidden("#sheet")  # the taps did nothing else
    page.focus("#map")
    page.keyboard.press("Escape")
    assert until(lambda: not painted(page, "goal", 3.5, 9.5))
    page.keyboard.press("d")  # by keys alone
    page.keyboard.press("Enter")
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("Enter")
    wait_for(page, f"{HINT}.startsWith('Distance: ')")
    assert not page.wrong


def saved(page: Any, button: str, folder: Path) -> Path:
    """The file that a button of the dialog saves."""
    page.click("#tools-button")
    with page.expect_download() as download:
        page.click(button)
    path = folder / download.value.suggested_filename
    download.value.save_as(path)
    return path


def test_the_floor_is_saved_as_geojson(browser: Any, url: str, tmp_path: Path) -> None:
    page = looking(browser, url)
    page.locator("#time").fill("50")
    wait_for(page, "echostep.last.play.t_s === 50")
    made_of = json.loads(saved(page, "#tool-geojson", tmp_path).read_text())
    assert made_of["coordinates"].startswith("metres of the plan")
    kinds = {feature["properties"]["kind"] for feature in made_of["features"]}
    assert {"wall", "room", "track", "position"} <= kinds
    (position,) = (f for f in made_of["features"] if f["properties"]["kind"] == "position")
    assert position["geometry"]["coordinates"] == [7.0, 7.5]
    assert not page.wrong


def test_a_georeferenced_plan_gives_longitude_latitude_and_mgrs(browser: Any, tmp_path: Path) -> None:
    pytest.importorskip("pyproj")
    from echostep_app.team.publish import GroundPlane

    with PageServer(walked(PLACED), LOCAL) as server, looking(browser, server.url) as page:
        page.mouse.click(*spot(page, 4.0, 7.5))
        wait_for(page, "/38S MB \\d{5} \\d{5}/.test(document.querySelector('#sheet-text').textContent)")
        said = page.inner_text("#sheet-text")
        place = GroundPlane(PLACED).place(4.0, 7.5, 0.0, None)
        lat, lon = (float(part.strip(" °")) for part in said.split("·")[0].split(","))
        assert [lat, lon] == pytest.approx([place.lat_deg, place.lon_deg], abs=2e-6)
        features = json.loads(saved(page, "#tool-geojson", tmp_path).read_text())
        assert "coordinates" not in features
        (position,) = (f for f in features["features"] if f["properties"]["kind"] == "position")
        assert position["geometry"]["coordinates"] == pytest.approx([place.lon_deg, place.lat_deg], abs=2e-4)
        for zone, band, easting, northing, wanted in MGRS:
            found = page.evaluate(
                "async (a) => (await import(new URL('static/tools/globe.js', document.baseURI))).mgrs(...a)",
                [zone, band, easting, northing],
            )
            assert found == wanted
        assert not page.wrong


MGRS = (  # the first: 38SMB4488 of the manual of GeoConvert; easting and northing of the others by the rule of the lettering
    (38, "S", 444500.0, 3688500.0, "38S MB 44500 88500"),
    (31, "N", 166021.4, 0.0, "31N AA 66021 00000"),
    (32, "V", 500000.0, 6651411.2, "32V NM 00000 51411"),
    (60, "", 500000.0, 9e6, ""),
)


def test_lengths_in_feet_and_a_page_that_remembers(browser: Any, url: str) -> None:
    page = looking(browser, url)
    wait_for(page, "document.querySelector('#place').textContent.includes(' m')")
    page.click("#legend-button")
    page.select_option("#unit", "ft")
    page.keyboard.press("Escape")
    for selector in ("#place", "#echoes", "#status-text", "#bar-text"):
        wait_for(page, f"/\\d (ft|in)\\b/.test(document.querySelector('{selector}').textContent)")
        assert not page.evaluate(f"/\\d (m|cm)\\b/.test(document.querySelector('{selector}').textContent)")
    said = page.evaluate(
        "async (a) => { const { inUnits } = await import(new URL('static/tools/units.js', document.baseURI)); return a.map(inUnits); }",
        ["tracking, 0.2 m", "x 1.0, y -2.0 m", "12 m to go", "to 5 cm", "in 3 min, 4 metres", "2 minutes at 5 m/s"],
    )
    feet = "tracking, 0.7 ft; x 3.3, y -6.6 ft; 39 ft to go; to 2 in; in 3 min, 13 feet; 2 minutes at 16 ft/s"
    assert "; ".join(said) == feet
    page.reload()
    wait_for(page, f"{READY} && document.querySelector('#unit').value === 'ft'")


def test_keys_titles_and_what_was_said(browser: Any, url: str) -> None:
    page = looking(browser, url)
    page.focus("#map")
    page.keyboard.press("?")
    assert page.is_visible("#keys-title")
    page.keyboard.press("Escape")
    nameless = "[...document.querySelectorAll('button, select, input')].filter((e) => e.offsetParent && !e.title).map((e) => e.id)"
    assert page.evaluate(nameless) == []
    assert page.get_attribute("#north", "title") == "North up (N)"
    page.keyboard.press("g")
    wait_for(page, "!document.querySelector('#hint').hidden")
    page.click("#tools-button")
    wait_for(page, "document.querySelector('#heard').textContent.includes('Tap where you want to go.')")
    assert page.evaluate("document.querySelectorAll('#heard li').length") == 1
    assert not page.wrong


@pytest.mark.parametrize("size", SIZES[::3])
def test_the_tools_and_the_charts_keep_nobody_out(browser: Any, url: str, size: tuple[int, int]) -> None:
    page = looking(browser, url, {"viewport": {"width": size[0], "height": size[1]}})
    page.focus("#map")
    page.keyboard.press("c")
    wait_for(page, "document.querySelector('#charts').ariaLabel.includes('foot 100.0')")
    assert page.evaluate(UNREACHED) == []
    found = violations(page)
    page.click("#tools-button")
    again = violations(page)
    assert overflow(page) == (0, 0)
    assert page.evaluate(
        "[...document.querySelectorAll('#tools *')].every((e) => e.getBoundingClientRect().right <= innerWidth)"
    )
    assert found == again == []


def test_it_can_be_installed_as_an_app(browser: Any, url: str) -> None:
    """Chromium reads the manifest and finds no reason against it but that this window is in incognito mode; nothing is fetched from elsewhere."""
    asked: list[str] = []
    page = loaded_page(browser, url, DESK, READY)
    page.on("request", lambda request: asked.append(request.url))
    page.reload()
    wait_for(page, READY)
    devtools = page.context.new_cdp_session(page)
    manifest = devtools.send("Page.getAppManifest")
    assert manifest["errors"] == []
    assert json.loads(manifest["data"])["name"] == "echostep"
    why = [error["errorId"] for error in devtools.send("Page.getInstallabilityErrors")["installabilityErrors"]]
    assert set(why) <= {"in-incognito"}
    assert asked
    assert all(address.startswith(url) for address in asked)  # it works without the internet


def test_the_keys_act_wherever_the_focus_is(browser: Any, url: str) -> None:
    """`?` shows the keys, Space holds and plays; a control that takes a key itself keeps it."""
    page = looking(browser, url)
    page.evaluate("document.activeElement.blur()")
    page.keyboard.press("Space")
    wait_for(page, "echostep.last.play.playing")
    page.focus("#time")
    page.keyboard.press("Space")
    wait_for(page, "!echostep.last.play.playing")
    page.focus("#north")
    page.keyboard.press("Space")  # presses that button
    page.keyboard.press("?")
    wait_for(page, "document.querySelector('#legend').open")
    page.evaluate("echostep.link.send('seek', { t_s: 77 })")  # answered after what was sent before
    wait_for(page, "echostep.last.play.t_s === 77 && !echostep.last.play.playing")
    page.keyboard.press("Escape")
    assert not page.wrong


def test_what_happened_between_two_estimates_is_listed_too() -> None:
    """A walk that begins lost; a position set by hand and undone; a mayday that comes and goes while the wearer stands."""
    lost = moment(70.0)
    run = OverTime(("Ground floor",), 0.0)
    mayday = ShownAlarm("mayday", "Mayday", "Mayday", 1)
    rates = (RATES, replace(RATES, check_ins=1), replace(RATES, check_ins=1, undone=1))
    for seen in (*(replace(lost, streams=one) for one in rates), lost):
        run.note(seen)
    run.note(replace(lost, alarm=mayday))
    run.note(lost)
    by_hand = "position set by hand"
    assert [event.text for event in run.events] == ["lost", by_hand, f"{by_hand}: undone", "mayday"]
    assert not len(run)
