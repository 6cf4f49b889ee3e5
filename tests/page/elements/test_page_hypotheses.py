# SPDX-License-Identifier: MIT
"""Several possible places on the page: rings, words, what to do, and the protection radius."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

from echostep.localization.estimate import TrackStatus
from echostep.localization.particles.places import LikelyPlace
from echostep.localization.particles.start import Start
from echostep.page.elements.scene import status_text
from page.browser import Walk, looking, picture, wait_for
from page.frames import scene, served, told

PLACES = (LikelyPlace(0.62, 5.0, 7.5, 0, 0.4, 0.0), LikelyPlace(0.31, 5.0, 2.0, 0, 0.4, 0.0))
SEARCHED_S = 6.0  # of the demo's walk: along one of two corridors that are alike
DRAWN = "document.querySelector('#places').textContent"


def test_words_for_places_for_a_plan_that_does_not_fit_and_for_neither() -> None:
    several = replace(told(status=TrackStatus.UNCERTAIN), hypotheses=PLACES)
    assert status_text(several) == "uncertain: 2 places fit; walk on, turn into a room or tap where you are"
    assert status_text(several, accepts_taps=False) == "uncertain: 2 places fit; walk on, turn into a room"
    assert status_text(replace(several, plan_fits=0.1)).startswith("this plan does not fit")
    assert status_text(replace(told(status=TrackStatus.TRACKING), hypotheses=PLACES)).startswith("tracking")


def test_places_that_fit_are_drawn_and_told(browser: Any, tmp_path: Path) -> None:
    estimate = replace(told(5.0, 7.5, status=TrackStatus.UNCERTAIN), protection_m=math.inf, hypotheses=PLACES)
    with served() as (server, mailbox):
        mailbox.publish(replace(scene(), estimate=estimate, status_text=status_text(estimate)))
        page = looking(browser, server.url, "bright")
        wait_for(page, f"{DRAWN}.includes('31 %')")
        assert page.evaluate(DRAWN) == "places that fit: 62 % in North corridor · 31 % in South corridor"
        assert "within" not in page.text_content("#place")
        page.screenshot(path=tmp_path / "places.png")
        mailbox.publish(replace(scene(2.0), estimate=replace(told(t_s=2.0), protection_m=0.4)))
        wait_for(page, "document.querySelector('#places').hidden")
        assert "within 0.40 m · heading E 090° ±1°" in page.text_content("#place")
        assert not page.wrong
        page.context.close()


def test_from_nowhere_two_corridors_fit_until_the_wearer_turns(browser: Any, tmp_path: Path) -> None:
    with Walk(SEARCHED_S, 0.1, start=Start()) as walk:  # so slow that the turn is far away however late the page is
        page = looking(browser, walk.page.url, "dark")
        wait_for(page, f"{DRAWN}.includes(' · ')")
        picture(page, "search", tmp_path)
        assert not page.wrong
        page.context.close()
