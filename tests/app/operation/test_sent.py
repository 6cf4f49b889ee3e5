# SPDX-License-Identifier: MIT
"""From the mayday to the way there: a commander sends who is nearest, over a broker, and the sent wearer's page shows and speaks it; in Chromium."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from echostep.ports.chunks import portion_of
from echostep_app.session.sinks import mark_sink
from echostep_app.team.messages.report import ReportedAlarm
from operation.test_marks_and_alarms import Commander
from page.browser import READY, Walk, loaded_page, wait_for
from team.network import box_to, feed_of
from team.team_broker import Broker, needs_broker
from team.team_reports import POSITION, report
from waiting import until

SPEAKS = "window.said = []; speechSynthesis.speak = (sentence) => window.said.push(sentence.text);"
MEETING_M = (20.0, 4.5)
WORDS = "Ben sends you to anna, in distress: Ground floor, in Meeting"


@pytest.mark.long
@needs_broker
def test_who_is_sent_gets_the_way(browser: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("echostep_app.session.team.subscription.LOOK_S", 0.0)
    with Broker(tmp_path) as broker, Commander(broker.url) as ben, Walk(10.0, 1.0, stands=True) as walk:
        subscription, feed = feed_of(broker.url, "bo")
        sink = mark_sink(feed, walk.page)
        subscription.open()
        boxes = [box_to(broker.url, name=name) for name in ("anna", "bo")]
        lying = replace(POSITION, x_m=MEETING_M[0], y_m=MEETING_M[1], where="in Meeting")
        boxes[0].offer(report("anna", position=lying, alarm=ReportedAlarm("mayday", "fall", 1, 31.0)))
        boxes[1].offer(report("bo"))
        assert until(lambda: len(ben.look().rows) == 2)
        how = {"viewport": {"width": 360, "height": 740}}
        rescuer = loaded_page(browser, walk.page.url, how, READY, SPEAKS)
        assert rescuer.is_hidden("#errand")
        how = {"viewport": {"width": 1280, "height": 800}}
        table = loaded_page(browser, ben.page.url, how, "document.querySelectorAll('#list li').length === 2")
        table.click("#list li:first-child button")
        wait_for(table, "document.querySelectorAll('#rescuers li').length === 1")
        table.fill("#me", "Ben")
        table.click("#rescuers button")

        def is_guided() -> bool:
            sink.take(portion_of([]), [])
            return bool(rescuer.evaluate("echostep.last.guidance?.own && echostep.last.guidance.path.length > 1"))

        assert until(is_guided)
        assert rescuer.inner_text("#errand") == WORDS
        assert rescuer.evaluate("echostep.last.guidance.path.at(-1)") == list(MEETING_M)
        assert rescuer.evaluate("said").count(f"{WORDS}.") == 1
        later = replace(POSITION, t_s=POSITION.t_s + 60.0)  # the first report may be outdated by now
        boxes[1].offer(report("bo", sequence=2, position=later))
        assert until(lambda: "sent to anna by Ben" in ben.look().rows[1].notes)

        def is_told() -> bool:
            ben.look()
            return bool(table.evaluate("document.querySelector('#rescuers li')?.innerText.includes('sent by Ben')"))

        assert until(is_told)
        rescuer.click("#end-guidance")
        wait_for(rescuer, "document.querySelector('#errand').hidden && !echostep.last.guidance")
        sink.take(portion_of([]), [])
        assert walk.page.mailbox.goal is None  # it does not return by itself
        wait_for(rescuer, "document.querySelector('#errand').hidden")
        for box in boxes:
            box.close()
        subscription.close()
