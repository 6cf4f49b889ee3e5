# SPDX-License-Identifier: MIT
"""Several possible places on the page: rings, words, what to do, and the protection radius."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from echostep.localization import Estimate, LikelyPlace, Start, TrackStatus
from echostep.tracker import Tracker
from echostep_app.guidance.cues import Cue, CueKind
from echostep_app.page.elements.guidance import guidance_of_cue
from echostep_app.page.elements.likely_places import PlaceNumbers, shown_places
from echostep_app.page.elements.scene import status_text
from echostep_app.page.elements.taps import Taps
from echostep_app.page.live import LivePage
from echostep_app.plan.routing import Route, Stretch
from page.browser import READY, Walk, loaded_page, looking, painted, picture, wait_for
from page.frames import LOCAL, PLAN, scene, served, told
from page.test_page_browser import NEAR_PX, STILL

PLACES = (LikelyPlace(0.62, 5.0, 7.5, 0, 0.4, 0.0), LikelyPlace(0.31, 5.0, 2.0, 0, 0.4, 0.0))
SEARCHED_S = 9.0  # of the demo's walk: along one of two corridors that are alike
DRAWN = "document.querySelector('#places').textContent"
WAY = Route((Stretch(0, np.array([[2.0, 7.5], [9.5, 7.5]])),))
INK = """(places) => {
    const canvas = document.querySelector('#canvas'), style = getComputedStyle(document.documentElement);
    const { data, width } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
    const rings = places.map(([x, y]) => echostep.view.toScreen(x, y).map((v) => v * devicePixelRatio));
    const [here, left] = ['--here', '--left'].map((name) => [1, 3, 5].map((k) => parseInt(style.getPropertyValue(name).trim().slice(k, k + 2), 16)));
    const is = (k, ink) => data[k + 3] > 250 && ink.every((v, c) => Math.abs(data[k + c] - v) < 6);
    let away = 0, echo = 0;
    for (let k = 0; k < data.length; k += 4) {
        const x = (k / 4) % width, y = Math.floor(k / 4 / width);
        if (is(k, here) && rings.every(([u, v]) => Math.hypot(x - u, y - v) > 20 * devicePixelRatio)) away++;
        if (is(k, left)) echo++;
    }
    return [away, echo];
}"""  # pixels of two colours on the map


def test_words_for_places_for_a_plan_that_does_not_fit_and_for_neither() -> None:
    several = replace(told(status=TrackStatus.UNCERTAIN), hypotheses=PLACES)
    assert (
        status_text(several) == "uncertain: 2 places fit, 93 % in all; walk on, turn into a room or tap where you are"
    )
    assert status_text(several, accepts_taps=False) == "uncertain: 2 places fit, 93 % in all; walk on, turn into a room"
    assert status_text(replace(several, hypotheses=(), right=0.97)).endswith(" m, 3 % elsewhere")
    assert status_text(replace(several, plan_fits=0.1)).startswith("this plan does not fit")
    assert status_text(replace(several, levels=(0.1,))) == "uncertain: the pressure says another floor"
    assert status_text(replace(told(status=TrackStatus.TRACKING), hypotheses=PLACES)).startswith("tracking")


def test_places_that_fit_are_drawn_and_told(browser: Any) -> None:
    estimate = replace(told(5.0, 7.5, status=TrackStatus.UNCERTAIN), protection_m=math.inf, hypotheses=PLACES)
    with served() as (server, mailbox):
        mailbox.publish(replace(scene(), estimate=estimate, status_text=status_text(estimate)))
        page = looking(browser, server.url, "bright")
        wait_for(page, f"{DRAWN}.includes('31 %')")
        assert page.evaluate(DRAWN) == "places that fit: 1 in North corridor 62 % · 2 in South corridor 31 %"
        assert "within" not in page.text_content("#place")
        mailbox.publish(replace(scene(2.0), estimate=replace(told(t_s=2.0), protection_m=0.4)))
        wait_for(page, "document.querySelector('#places').hidden")
        assert "within 0.40 m · heading E 090° ±1°" in page.text_content("#place")
        assert not page.wrong


def test_the_sentence_names_each_place_once_with_the_numbers_of_its_rings() -> None:
    third = LikelyPlace(0.05, 9.0, 7.5, 0, 0.4, 0.0)
    taps = Taps(PLAN)
    assert taps.places(replace(told(), hypotheses=(*PLACES, third))) == (
        "places that fit: 1, 3 in North corridor 67 % · 2 in South corridor 31 %"
    )
    assert taps.places(told()) == ""


def test_a_place_keeps_its_number_while_it_stays() -> None:
    """However its rank changes, and while the cloud walks on; what comes later gets a number that none had of late."""
    numbers, a, b = PlaceNumbers(), *PLACES

    def at(t_s: float, *places: LikelyPlace) -> tuple[int, ...]:
        return numbers.of(replace(told(t_s=t_s, status=TrackStatus.UNCERTAIN), hypotheses=places))

    assert at(1.0, a, b) == (1, 2)
    assert at(1.3, replace(b, x_m=b.x_m + 0.5), a) == (2, 1)
    far = replace(a, x_m=a.x_m + 9.0)
    assert at(1.6, far, replace(a, level=1), b) == (3, 4, 2)
    assert at(5.0, a, far) == (1, 3)
    assert at(30.0, b, a) == (1, 2)
    estimate = replace(told(status=TrackStatus.UNCERTAIN), hypotheses=PLACES)
    assert Taps(PLAN).places(estimate, (7, 2)) == "places that fit: 2 in South corridor 31 % · 7 in North corridor 62 %"


@pytest.mark.parametrize(("status", "shown"), [(TrackStatus.UNCERTAIN, 0), (TrackStatus.LOST, 1)])
def test_a_single_place_is_listed_where_no_position_is_claimed(status: TrackStatus, shown: int) -> None:
    """As on a walk without a plan, whose position is uncertain after some minutes; of a search the likeliest place may be the only one."""
    estimate = replace(told(PLACES[0].x_m, PLACES[0].y_m, status=status), hypotheses=PLACES[:1])
    assert len(shown_places(estimate)) == shown
    assert len(shown_places(replace(estimate, hypotheses=PLACES))) == len(PLACES)


def test_without_a_place_nothing_on_the_map_looks_like_one(browser: Any) -> None:
    """Marks of the wearer's colour are those of the places that fit, and no echo is drawn; a tracked wearer has all of them at the position."""
    lost, echoes = replace(told(13.0, 5.0, status=TrackStatus.LOST, sd_m=4.0), hypotheses=PLACES), scene().echo_lines
    with served() as (server, mailbox):
        mailbox.publish(replace(scene(), estimate=lost))
        page = loaded_page(browser, server.url, {"viewport": {"width": 360, "height": 740}}, READY)

        def marks(estimate: Estimate, t_s: float) -> tuple[int, int]:
            """Pixels of the wearer's colour away from the places that fit, and of the left echo's."""
            mailbox.publish(replace(scene(t_s), estimate=replace(estimate, t_s=t_s), echo_lines=echoes))
            wait_for(page, f"echostep.last.t_s === {t_s} && {STILL}")
            away, echo = page.evaluate(INK, [[p.x_m, p.y_m] for p in estimate.hypotheses])
            return int(away), int(echo)

        assert marks(lost, 2.0) == (0, 0)
        assert page.evaluate("echostep.scene.frame.told.hypotheses.map((place) => place.number)") == [1, 2]
        assert "plan" not in page.text_content("#echoes")
        assert marks(replace(lost, hypotheses=()), 3.0) == (0, 0)
        away, echo = marks(told(13.0, 5.0), 4.0)
        assert min(away, echo) > 20
        assert not page.wrong


def test_the_way_is_hidden_while_no_place_is_claimed(browser: Any) -> None:
    way = guidance_of_cue(Cue(1.0, CueKind.AHEAD, "Straight ahead", 0.1, "", 7.5), WAY, 0, None)
    with served() as (server, mailbox):
        mailbox.publish(replace(scene(), guidance=way))
        page = loaded_page(browser, server.url, {"viewport": {"width": 1280, "height": 800}}, READY)
        for t_s, status, shown in ((2.0, TrackStatus.LOST, False), (3.0, TrackStatus.TRACKING, True)):
            mailbox.publish(replace(scene(t_s), estimate=told(13.0, 5.0, t_s, status), guidance=way))
            wait_for(page, f"echostep.last.t_s === {t_s} && {STILL}")
            assert page.evaluate("echostep.last.guidance.path.length") == 2
            assert [painted(page, "goal", 2.0 + 7.5 * share, 7.5, NEAR_PX) for share in (0.1, 0.5, 0.9)] == [shown] * 3
        assert not page.wrong


def test_the_view_does_not_follow_a_mean_that_is_no_place(browser: Any) -> None:
    with served() as (server, mailbox):
        mailbox.publish(scene())
        page = loaded_page(browser, server.url, {"viewport": {"width": 1280, "height": 800}}, READY)
        page.evaluate("echostep.view.zoom(8)")  # the building is larger than the screen: the view follows
        mailbox.publish(scene(1.5))
        wait_for(page, "echostep.last.t_s === 1.5 && echostep.view.toScreen(2, 7.5).every((pixel) => pixel > 0)")
        stands = page.evaluate("[echostep.view.x, echostep.view.y]")
        for k, status in enumerate((TrackStatus.LOST, TrackStatus.LOST, TrackStatus.TRACKING)):
            mailbox.publish(replace(scene(2.0 + k), estimate=told(20.0 + k, 2.0, 2.0 + k, status)))
            wait_for(page, f"echostep.last.t_s === {2.0 + k}")
            assert (page.evaluate("[echostep.view.x, echostep.view.y]") == stands) == (status is TrackStatus.LOST)
        assert page.get_attribute("#follow", "aria-pressed") == "true"
        assert not page.wrong


def test_the_track_has_a_gap_where_no_place_was_claimed() -> None:
    known, lost = TrackStatus.TRACKING, TrackStatus.LOST
    with LivePage(Tracker(PLAN), "test", LOCAL) as page:
        for k, status in enumerate((lost, known, known, lost, lost, known)):
            page._watch(None, told(2.0 + k, 7.5, 3.0 * k, status))
        rows = np.frombuffer(page.mailbox.trail.part(0, 9), "<f4").reshape(-1, 3)
    assert np.array_equal(rows[:, 0], [3.0, 4.0, math.nan, 7.0], equal_nan=True)


def test_from_nowhere_two_corridors_fit_until_the_wearer_turns(browser: Any, tmp_path: Path) -> None:
    with Walk(SEARCHED_S, 0.1, start=Start()) as walk:  # so slow that the turn is far away however late the page is
        page = looking(browser, walk.page.url, "dark")
        wait_for(page, f"{DRAWN}.includes(' · ')")
        picture(page, "search", tmp_path)
        assert not page.wrong
