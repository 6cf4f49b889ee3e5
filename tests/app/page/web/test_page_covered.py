# SPDX-License-Identifier: MIT
"""What lies over the map hides neither the wearer's own mark nor the one in distress, in Chromium, with every message that can be there."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from board_runs import ROOT
from echostep.plan import load_plan
from echostep_app.page.elements.marks import ShownMark
from echostep_app.page.elements.undo_offer import UndoOffer
from echostep_app.page.mailbox import Mailbox
from echostep_app.plan.routing import RoutePlace
from echostep_app.team.messages.crews import Crew
from echostep_app.team.messages.report import ReportedAlarm
from operation.teams import TOWER, ServedTeam, Team, place
from page.browser import READY, TABLE_READY, wait_for
from page.frames import PLAN, scene, served, told
from page.web.test_page_sizes import RATES, RUNNING, moments, opened
from plan.imported_plans import seven_floors
from waiting import until

SIZES = ((360, 740), (740, 360), (320, 256))
ABOVE = """([x, y]) => {
    const box = document.querySelector('#map').getBoundingClientRect(), [sx, sy] = echostep.view.toScreen(x, y), names = [];
    for (const [dx, dy] of [[0, 0], [-10, 0], [10, 0], [0, -10], [0, 10]]) {
        const [px, py] = [box.left + sx + dx, box.top + sy + dy], hit = document.elementFromPoint(px, py);
        if (sx + dx < 0 || sy + dy < 0 || sx + dx > box.width || sy + dy > box.height) names.push('beyond the map');
        else if (!hit?.closest('#map')) names.push(hit?.closest('[id]')?.id ?? 'nothing');
    }
    return names;
}"""  # what lies over a sign of 20 px at a place of the map
EVERY_MESSAGE = """() => { for (const id of ['silence', 'outbox', 'fault', 'hint']) {
    const element = document.getElementById(id);
    element.textContent ||= 'No answer from echostep live since 12:34:56. Is it running, and in reach?';
    element.hidden = false;
} }"""


@pytest.mark.parametrize("size", SIZES)
def test_the_wearer_is_seen_under_every_message(browser: Any, size: tuple[int, int]) -> None:
    plan = seven_floors()
    with served(Mailbox(plan, "echostep live", replay=False)) as (server, mailbox):
        mailbox.publish(scene())
        page = opened(browser, server.url, size, READY)
        bad = moments()[-1]
        mailbox.set_marks((ShownMark("1", "hazard", 4.0, 8.0, 0, "Ann"),))
        mailbox.set_goal(RoutePlace(12.0, 7.0, 0), "Ben sends you to Finn, in distress: Ground floor, in Meeting")
        for t_s, x_m in ((6.0, 2.0), (7.0, 12.0), (8.0, 3.0)):
            estimate = replace(scene(t_s).estimate, x_m=x_m)  # type: ignore[type-var]
            mailbox.publish(
                replace(bad, t_s=t_s, estimate=estimate, streams=RATES, gait=RUNNING, undo=UndoOffer(1, 9.0, False))
            )
            wait_for(page, f"echostep.last.t_s === {t_s}")
            page.evaluate(EVERY_MESSAGE)
            mailbox.publish(replace(bad, t_s=t_s + 0.5, estimate=estimate, streams=RATES, gait=RUNNING))
            wait_for(page, f"echostep.last.t_s === {t_s + 0.5}")
            assert until(lambda x_m=x_m: page.evaluate(ABOVE, [x_m, 7.5]) == []), page.evaluate(ABOVE, [x_m, 7.5])  # type: ignore[misc]


@pytest.mark.parametrize("size", SIZES)
def test_who_has_fallen_is_seen_under_every_message(browser: Any, size: tuple[int, int]) -> None:
    team = Team()
    x_m, y_m = TOWER.levels[2].rooms[0].at_m
    for name in ("Anna", "Eve"):
        team.hear(name, place(TOWER, x_m, y_m, 0))
    with ServedTeam(team) as table, opened(browser, table.page.url, size, TABLE_READY) as page:
        for name, far_m in (("Gil", 12.0), ("Kim", -9.0)):
            team.hear(name, place(TOWER, x_m + far_m, y_m, 2), alarm=ReportedAlarm("mayday", "fall", 1, 14.0))
            table.show()
            wait_for(
                page,
                f"document.querySelector('#mayday-text').textContent.includes('{name}') && echostep.scene.level === 2",
            )
            crew = Crew(1, "c" * 8, "Attack 1", ("Anna",), 30.0, "Ann", team.unix_s, team.unix_s - 1300.0)
            team.put_bytes(*crew.message)
            page.evaluate(EVERY_MESSAGE)
            team.pass_time(0.6)
            table.show()
            wait_for(
                page,
                f"!document.querySelector('#crew-due').hidden && echostep.last?.unix_s === {json.dumps(team.unix_s)}",
            )
            assert page.evaluate(ABOVE, [x_m + far_m, y_m]) == [], name


def test_the_first_view_of_a_big_house_is_about_the_wearer(browser: Any, tmp_path: Path) -> None:
    drawn = json.loads((ROOT / "host/core/echostep/plans/demo.json").read_text())
    drawn["levels"][0]["walls"] += [[95, 1, 95, 60], [25, 60, 95, 60]]
    (tmp_path / "big.json").write_text(json.dumps(drawn))
    for plan, is_whole in ((PLAN, True), (load_plan(tmp_path / "big.json"), False)):
        with served(Mailbox(plan, "echostep live", replay=False)) as (server, mailbox):
            mailbox.publish(scene())
            page = opened(browser, server.url, (360, 740), READY)
            wait_for(page, "echostep.view.shows([2, 7.5, 2, 7.5])")
            assert page.evaluate("echostep.view.shows([1, 1, 25, 13])") is is_whole
            assert 20.0 < page.evaluate("echostep.view.width / echostep.view.scale") < 35.0


NAMES = """[...document.querySelectorAll('#rooms text')].filter((e) => e.getAttribute('visibility') === 'visible')
    .map((e) => [Number(e.getAttribute('x')), Number(e.getAttribute('y')), 4 * e.textContent.length])"""


def test_names_give_way_to_signs(browser: Any) -> None:
    """Those of the places that fit, the wearer's own, and on a commander's page those of wearers who move."""
    estimate = moments()[2].estimate
    with served(Mailbox(PLAN, "test", replay=False)) as (server, mailbox):
        spots = [room.at_m for room in PLAN.levels[0].rooms[:2]]
        assert estimate
        places = tuple(
            replace(h, x_m=x_m, y_m=y_m, level=0) for h, (x_m, y_m) in zip(estimate.hypotheses, spots, strict=True)
        )
        mailbox.publish(replace(moments()[2], estimate=replace(estimate, level=0, hypotheses=places)))
        page = opened(browser, server.url, (360, 740), READY)
        wait_for(page, "echostep.last.told.hypotheses.length === 2")
        assert not covered(page, spots)
        mailbox.publish(replace(scene(5.0), estimate=told(18.5, 7.5)))  # where North corridor is written
        wait_for(page, f"echostep.last.t_s === 5 && {NAMES}.length && echostep.view.shows([18.5, 7.5, 18.5, 7.5])")
        assert not covered(page, [(18.5, 7.5)])
        page.context.close()
    team = Team()
    spots = [TOWER.levels[0].rooms[0].at_m]
    team.hear("Anna", place(TOWER, *spots[0], 0))
    with ServedTeam(team) as table, opened(browser, table.page.url, (360, 740), TABLE_READY) as page:
        assert until(lambda: not covered(page, spots)), covered(page, spots)
        left, right = page.evaluate(NAME_AT_EDGE)
        assert 0 < left < right < 180  # on the other side of the sign, where the map's edge would cut it


NAME_AT_EDGE = """async () => {
    const { TeamPainter } = await import(new URL('static/commander/wearers.js', document.baseURI));
    const painter = new TeamPainter(document.createElement('canvas')), at = [];
    painter.sprite = (_name, x, _y, [half]) => at.push(x - half, x + half);
    painter.names({ width: 200 }, [{ id: 1, name: 'Anna', state: 'mayday', at: [180, 50] }], null);
    return at;
}"""


def covered(page: Any, spots: list[tuple[float, float]]) -> list[Any]:
    """Names over the signs at these places."""
    pixels = [page.evaluate("([x, y]) => echostep.view.toScreen(x, y)", at) for at in spots]
    return [
        name
        for name in page.evaluate(NAMES)
        for x, y in pixels
        if abs(name[0] - x) < name[2] + 8.0 and abs(name[1] - y) < 16.0
    ]
