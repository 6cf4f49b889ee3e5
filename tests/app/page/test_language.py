# SPDX-License-Identifier: MIT
"""The languages of the pages in Chromium: every text has an entry in the catalogue, none is cut off on a phone, and how a language is chosen."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from echostep.plan import Plan, load_plan
from echostep_app.commands.options import Language
from echostep_app.page.editor import EditServer
from echostep_app.page.elements.guidance import ShownGuidance
from echostep_app.page.elements.scene import PageScene
from echostep_app.page.mailbox import Mailbox
from echostep_app.page.server import LOCAL as HERE
from echostep_app.page.server import STATIC, Address, PageServer
from echostep_app.plan.importers.formats import import_plan
from echostep_app.plan.questions import with_questions
from echostep_app.plan.writer import save_plan
from echostep_app.team.messages.crews import Crew
from echostep_app.team.messages.report import ReportedAlarm
from operation.teams import BASE, NAMES, TOWER, ServedTeam, place, whole_team
from page.browser import READY, TABLE_READY, loaded_page, overflow, violations, wait_for
from page.edit.drawing import answers, click, drag, status
from page.edit.test_editor_questions import doubtful_house
from page.frames import scene, served
from page.web.test_page_sizes import RATES, UNREACHED, moments
from plan.imported_plans import seven_floors
from waiting import until

EDITOR_READY = "Boolean(window.echostep)"
LOCALES = {"en": "en-GB", "de": "de-DE"}
OTHERS = [name for name in LOCALES if name != "en"]
HOLE = re.compile(r"\{(\w+)\}")
MISSING = "[...echostep.missing]"
LANG = "document.documentElement.lang"
CUT = """(() => {
    const pen = document.createElement('canvas').getContext('2d'), wrong = [], ARROW = 24;
    for (const element of document.querySelectorAll('body *')) {
        if (!element.offsetParent || element.closest('.unseen, svg, h1, #map, #floors, #floor, #level, .name')) continue;  // names may be cut
        const style = getComputedStyle(element), { clientWidth: width, clientHeight: height } = element;
        const name = `${element.id || element.tagName}: ${element.innerText}`;
        if (style.clipPath === 'inset(50%)') continue;  // for screen readers alone
        pen.font = `${style.fontWeight} ${style.fontSize} ${style.fontFamily}`;
        if (element.tagName === 'SELECT' && pen.measureText(element.selectedOptions[0]?.text ?? '').width > width - ARROW) wrong.push(name);
        if (style.overflowX === 'hidden' || element.tagName === 'BUTTON') if (element.scrollWidth > width + 1) wrong.push(name);
        if (style.overflowY === 'hidden' && element.scrollHeight > height + 1) wrong.push(name);
        if (element.getBoundingClientRect().right > innerWidth + 1) wrong.push(name);
    }
    return wrong;
})()"""  # texts that do not fit where they stand
STATUSES = (
    "tap where you stand to start",
    "waiting for the foot to stand still",
    "preparing (kernels are compiled once on a computer): 12%",
    "tracking, outside the building, 0.4 m",
    "uncertain, 12 m above the start, 40 m",
    "lost: nothing from the foot for 120 s",
    "uncertain, 2 m, 3 % elsewhere",
    "uncertain: the pressure says another floor",
    "lost: 7 places fit, 24 % in all; walk on, turn into a room or tap where you are",
    "this plan does not fit: is it another building or floor, or mirrored?",
)
CUES = (
    "Stop. Your direction is not known: turn once around, slowly",
    "Your place is not known yet: walk slowly along the walls",
    "No beacon hears you. Go back to the last known place",
    "You left the way: it is 12 metres off",
)


def settles(page: Any) -> bool:
    """Whether nothing is cut once the page has laid itself out."""
    return until(lambda: page.evaluate(CUT) == [])


def catalogue(name: str) -> dict[str, Any]:
    """All entries of a language: texts, or texts by the category of a number (Unicode CLDR)."""
    parts = [json.loads(path.read_text("utf-8")) for path in sorted(STATIC.glob(f"{name}-*.json"))]
    return {key: text for part in parts for section in part.values() for key, text in section.items()}


def names(plan: Plan) -> set[str]:
    """The names on a plan, which are in no catalogue."""
    return {
        plan.name,
        *(level.name for level in plan.levels),
        *(room.name for level in plan.levels for room in level.rooms),
    }


def page_of(browser: Any, url: str, lang: str, ready: str, **how: Any) -> Any:
    """A page on a phone whose browser speaks a language."""
    return loaded_page(browser, url, {"viewport": {"width": 360, "height": 740}, "locale": LOCALES[lang]} | how, ready)


@pytest.fixture(scope="module")
def url() -> Iterator[str]:
    with served(Mailbox(seven_floors(), "A walk (simulated, 3 x real time)", replay=False)) as (server, mailbox):
        mailbox.publish(scene())
        yield server.url


@pytest.mark.parametrize("lang", OTHERS)
def test_entries_have_the_holes_of_their_texts(lang: str) -> None:
    entries = catalogue(lang)
    texts = [(key, text) for key, one in entries.items() for text in (one.values() if isinstance(one, dict) else [one])]
    assert [key for key, text in texts if set(HOLE.findall(key)) != set(HOLE.findall(text))] == []
    assert all(text.strip() for _, text in texts)
    assert all("other" in one for one in entries.values() if isinstance(one, dict))
    assert not [key for key in entries if key.endswith(".")]


def test_how_a_language_is_chosen(browser: Any, url: str) -> None:
    """The browser's, before it that of `--lang`, before it that of the list; English where a language is unknown."""
    page = loaded_page(browser, url, {"locale": "fr-FR"}, READY)
    assert page.evaluate(LANG) == "en"
    page.context.close()
    with PageServer(Mailbox(seven_floors(), "A walk", replay=False), Address(HERE, 0, "de")) as server:
        page = loaded_page(browser, server.url, {"locale": "en-GB"}, f"{LANG} === 'de'")
        wait_for(page, "document.querySelector('#help').textContent === 'Notruf'")
        page.click("#legend-button")
        with page.expect_navigation():  # it loads itself again
            page.select_option("#language", "en")
        wait_for(page, f"{LANG} === 'en' && document.querySelector('#help').textContent === 'Help!'")


def test_the_command_knows_the_languages_of_the_pages() -> None:
    listed = re.search(r"LANGUAGES = \{(.*?)\}", (STATIC / "language.js").read_text("utf-8"))
    assert listed
    assert re.findall(r"(\w+):", listed[1]) == [lang.value for lang in Language]


@pytest.mark.parametrize("lang", OTHERS)
def test_nothing_is_cut_off_on_the_wearers_page(browser: Any, lang: str) -> None:
    plan = seven_floors()
    with served(Mailbox(plan, "A walk", replay=False)) as (server, mailbox):
        mailbox.set_team(("Anna", "Christopher"))
        mailbox.publish(scene())
        page = page_of(browser, server.url, lang, READY)
        for moment in wearers_moments():
            mailbox.publish(moment)
            wait_for(page, f"echostep.last.t_s === {moment.t_s}")
            assert settles(page), (moment.status_text, page.evaluate(CUT))
            assert overflow(page) == (0, 0)
        assert violations(page) == []
        for button in ("#legend-button", "#tools-button"):
            page.click(button)
            assert settles(page), page.evaluate(CUT)
            assert violations(page) == []
            page.keyboard.press("Escape")
        assert page.evaluate(UNREACHED) == []
        assert page.evaluate(LANG) == lang
        left = set(page.evaluate(MISSING)) - names(plan)
        assert left <= {"echostep", "GeoJSON", "the board has no rangers", "look at its plug (docs/mistakes.md)"}
        assert not page.wrong


def wearers_moments() -> list[PageScene]:
    """A bad hour, then each status and each long cue."""
    *before, alarm = moments()
    known = replace(before[0], streams=replace(RATES, wrong=""))
    statuses = [replace(known, t_s=10.0 + k, status_text=text) for k, text in enumerate(STATUSES)]
    cues = [
        replace(known, t_s=30.0 + k, guidance=ShownGuidance("off", text, 0.4, 27.0, ())) for k, text in enumerate(CUES)
    ]
    return [*before, *statuses, *cues, alarm]


@pytest.mark.long
@pytest.mark.parametrize("lang", OTHERS)
def test_nothing_is_cut_off_on_the_commanders_page(browser: Any, lang: str) -> None:
    team = whole_team()
    team.hear("Dana", place(TOWER, 12.0, 2.0, 2), alarm=ReportedAlarm("mayday", "fall", 1, 14.0))
    crew = Crew(1, "c" * 8, "Attack 1", ("Anna",), 30.0, "Ann", team.unix_s, team.unix_s - 1300.0)
    team.put_bytes(*crew.message)
    with ServedTeam(team) as table, page_of(browser, table.page.url, lang, TABLE_READY) as page:
        # No click on the invitation: where a script was evaluated before it was made, that counted as a gesture
        page.keyboard.press("Shift")

        def check() -> None:
            assert settles(page), page.evaluate(CUT)
            assert overflow(page) == (0, 0)
            assert violations(page) == []

        check()
        for name in ("Dana", "Anna", "Kim"):
            page.click(f"#list li:has-text('{name}') button")
            wait_for(page, "document.querySelectorAll('#facts dt').length")
            page.evaluate("document.querySelector('#all').open = true")
            check()
            page.click("#close")
        for button in ("#legend-button", "#crews-button"):
            page.click(button)
            check()
            page.keyboard.press("Escape")
        table.show(connected=False)
        wait_for(page, "document.querySelector('#words').dataset.status === 'broken'")
        check()
        people = {"echostep", "echostep command", "Attack 1", "Ann", BASE.run, *NAMES}
        assert set(page.evaluate(MISSING)) - names(TOWER) - people == set()
        assert page.evaluate(LANG) == lang
        assert not page.wrong


@pytest.mark.long
@pytest.mark.parametrize("lang", OTHERS)
def test_nothing_is_cut_off_in_the_editor(browser: Any, lang: str, tmp_path: Path) -> None:
    doubtful = with_questions(import_plan(doubtful_house(tmp_path / "house.dxf")))
    save_plan(doubtful, tmp_path / "plan.json")
    with EditServer(tmp_path / "plan.json", port=0) as server, page_of(browser, server.url, lang, EDITOR_READY) as page:

        def check(*, axe: bool = True) -> None:
            assert settles(page), (status(page), page.evaluate(CUT))
            assert overflow(page) == (0, 0)
            assert not axe or violations(page) == [], status(page)

        check()
        for tool in page.query_selector_all("[data-tool]"):
            tool.click()
            check(axe=False)
        for _ in doubtful.levels[0].questions:
            page.click("#answer-next")
            check(axe=False)
        page.click("#answer-yes")
        page.click("#whole")
        page.click("[data-tool='room']")
        answers(page, "Attic")
        click(page, 3.0, 3.0)
        check()
        page.click("[data-tool='wall']")
        click(page, 3.0, 3.0)
        check()
        page.click("[data-tool='select']")
        drag(page, (0.0, 0.0), (9.0, 7.0))
        check()
        page.click("#delete")
        check()
        page.click("#step-back")
        check()
        page.click("#save")
        wait_for(page, "!echostep.sheet.unsaved")
        check()
        assert ("gesichert" in status(page)) == (lang == "de")
        people = names(load_plan(tmp_path / "plan.json"))
        assert set(page.evaluate(MISSING)) - people == set()
        assert page.evaluate(LANG) == lang
        assert not page.wrong
