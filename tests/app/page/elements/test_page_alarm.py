# SPDX-License-Identifier: MIT
"""The wearer's alarm on the live page: it asks, it can be answered, and help can be called for, in Chromium."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from echostep.odometry import Alarm, AlarmKind, AlarmReason, WearerWatch
from echostep.ports.people.check_in import Call
from echostep_app.page.elements.alarm import ShownAlarm, shown_alarm
from echostep_app.page.mailbox import popped
from page.browser import looking, picture, violations, wait_for
from page.frames import scene, served
from waiting import until

TEXT = "document.querySelector('#alarm-text').textContent"


@pytest.mark.parametrize(
    ("kind", "reason", "age_s", "has_team", "words"),
    [
        (AlarmKind.ASKING, AlarmReason.STILL, 21.4, True, "In 9 s it is a mayday."),
        (AlarmKind.MAYDAY, AlarmReason.STILL, 40.0, True, "no motion for 40 s. It is being sent."),
        (
            AlarmKind.ASKING,
            AlarmReason.FALL,
            4.0,
            True,
            "A fall: are you all right? Walk, or tap. In 26 s it is a mayday.",
        ),
        (AlarmKind.MAYDAY, AlarmReason.FALL, 14.0, True, "Mayday: a fall 14 s ago. It is being sent."),
        (AlarmKind.MAYDAY, AlarmReason.HELP, 1.0, False, "you asked for help. No team is connected"),
        (AlarmKind.OVER, AlarmReason.HELP, 1.0, True, "The mayday is over."),
    ],
)
def test_an_alarm_in_words(kind: AlarmKind, reason: AlarmReason, age_s: float, has_team: bool, words: str) -> None:
    watch = WearerWatch()
    receipt_of = (lambda _: "It is being sent.") if has_team else None
    assert shown_alarm(watch, 100.0, receipt_of=receipt_of) is None
    watch.alarm = Alarm(kind, reason, 1, 100.0 - age_s, 130.0 - age_s)
    shown = shown_alarm(watch, 100.0, receipt_of=receipt_of)
    assert shown
    assert words in shown.text
    assert shown.spoken


def test_who_is_in_distress_is_told_who_knows_of_it() -> None:
    watch = WearerWatch()
    watch.alarm = Alarm(AlarmKind.MAYDAY, AlarmReason.HELP, 2, 90.0)
    shown = shown_alarm(
        watch, 100.0, receipt_of=lambda _: "It is being sent.", answer_to=lambda _: "Ann has acknowledged it."
    )
    assert shown
    assert shown.text == "Mayday: you asked for help. Ann has acknowledged it."
    assert "Ann has acknowledged it." in shown.spoken


@pytest.mark.parametrize("look", ["bright", "dark"])
def test_the_page_asks_and_nothing_keeps_anybody_from_answering(browser: Any, look: str, tmp_path: Path) -> None:
    asking = ShownAlarm("asking", "Are you all right? Move, or tap. In 9 s it is a mayday.", "Are you all right?", 1)
    with served() as (server, mailbox):
        mailbox.publish(replace(scene(), alarm=asking))
        page = looking(browser, server.url, look)
        wait_for(page, f"{TEXT}.startsWith('Are you all right?')")
        found = violations(page)
        if look == "bright":
            picture(page, "alarm", tmp_path)
        page.click("#fine")
        calls: list[Any] = []

        def is_answered() -> bool:
            calls.extend(popped(mailbox.check_ins))
            return bool(calls)

        assert until(is_answered)
        mailbox.publish(replace(scene(), alarm=None))
        wait_for(page, "document.querySelector('#alarm').hidden")
        assert calls == [Call(help=False)]
        assert not page.wrong
    assert found == []


UNSPOKEN = "document.querySelector('#unspoken')"


def test_a_page_that_was_not_tapped_says_that_it_cannot_speak(browser: Any) -> None:
    """The browser's own answer: it speaks, or the page says that it did not; in Chromium without a tap or a voice it does not."""
    asking = ShownAlarm("asking", "Are you all right? Move, or tap.", "Are you all right?", 1)
    with served() as (server, mailbox):
        mailbox.publish(scene())
        page = looking(browser, server.url, "bright")
        assert page.inner_text("#invitation") == "This page cannot speak before it is tapped: tap here"
        mailbox.publish(replace(scene(), alarm=asking))
        wait_for(page, f"{UNSPOKEN}.textContent.startsWith('Not spoken: ') || speechSynthesis.speaking")
        page.click("#fine")
        assert page.locator("#invitation").is_hidden()


def test_a_sentence_that_does_not_begin_is_reported_and_one_that_does_is_not(browser: Any) -> None:
    """The engine is played: each sentence is begun, left alone, or ended with an error by the test."""
    with served() as (server, mailbox):
        mailbox.publish(scene())
        page = looking(browser, server.url, "bright")
        page.evaluate("() => { window.said = []; speechSynthesis.speak = (sentence) => said.push(sentence); }")

        def alarm(times: int) -> None:
            mailbox.publish(replace(scene(), alarm=ShownAlarm("mayday", "Mayday.", f"Mayday {times}.", times)))
            wait_for(page, f"said.at(-1)?.text === 'Mayday {times}.'")

        alarm(1)
        wait_for(page, f"{UNSPOKEN}.textContent.startsWith('Not spoken: the browser has not begun.')")
        alarm(2)
        page.evaluate("() => said.at(-1).onstart()")
        assert page.locator("#unspoken").is_hidden()
        alarm(3)
        page.evaluate("() => said.at(-1).onerror({ error: 'synthesis-failed' })")
        assert page.inner_text("#unspoken").startswith("Not spoken: the browser says synthesis-failed.")
        page.evaluate("() => said.at(-1).onerror({ error: 'not-allowed' })")
        assert page.inner_text("#unspoken").startswith("Not spoken: the browser forbids it before the first tap.")
        page.evaluate("() => said[0].onerror({ error: 'interrupted' })")
        alarm(4)
        page.evaluate("() => said.at(-1).onstart()")
        assert page.locator("#unspoken").is_hidden()
