# SPDX-License-Identifier: MIT
"""Several commanders and a wearer on one broker: marks and acknowledgements are one state, in Chromium."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import Any, Self

import pytest

from echostep_app.operation.command import Restorer, restore
from echostep_app.operation.operation import Operation
from echostep_app.operation.page import TablePage
from echostep_app.operation.requests import Acknowledge, SetMark, Unmark
from echostep_app.page.elements.marks import ShownMark
from echostep_app.page.mailbox import Mailbox
from echostep_app.page.server import Address, PageServer
from echostep_app.team.endpoint import parse_endpoint
from echostep_app.team.inbox import Inbox, ListenerThread
from echostep_app.team.messages.marks import ALL
from echostep_app.team.messages.report import ReportedAlarm
from echostep_app.team.mqtt.publisher import Listener
from operation.teams import TOWER, ServedTeam, whole_team
from operation.test_table_page import shot, table
from page.browser import looking, spot, violations, wait_for
from page.frames import LOCAL, scene
from team.network import box_to, feed_of
from team.team_broker import Broker, needs_broker
from team.team_reports import report
from waiting import until
from walks import PLAN


class Commander:
    """A commander as `echostep command` is one, without a terminal."""

    def __init__(self, url: str) -> None:
        self.operation, self._inbox = Operation(PLAN), Inbox()
        self.page = TablePage(self.operation, "Simulated operation", Address(port=0))
        self.receiver = ListenerThread(Listener(parse_endpoint(url), ["echostep/+/+/+", ALL], self._inbox.put), print)
        self.page.feed.send = self.receiver.send
        self._restorer = Restorer()

    def __enter__(self) -> Self:
        self.page.__enter__()
        return self

    def __exit__(self, *_: object) -> None:
        self.page.__exit__(None, None, None)
        self.receiver.close()

    def look(self) -> Any:
        now_s = time.monotonic()
        believed = self.operation.receive(*self._inbox.take_all(), now_s, time.time())
        restore(self._restorer, self.operation, self.receiver, believed, now_s)
        made = self.operation.scene(now_s, time.time(), connected=self.receiver.connected)
        self.page.feed.publish(made)
        return made


@needs_broker
def test_two_commanders_and_a_wearer_have_one_state(browser: Any, tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.setattr("echostep_app.session.team.subscription.LOOK_S", 0.0)
    with Broker(tmp_path) as broker, Commander(broker.url) as ann, Commander(broker.url) as ben:
        subscription, wearer = feed_of(broker.url, "anna")
        subscription.open()
        box = box_to(broker.url)
        box.offer(report("anna", alarm=ReportedAlarm("mayday", "no motion", 1, 31.0)))
        assert until(lambda: ann.look().rows and ben.look().rows)
        page = table(browser, ann.page.url, "wide")
        page.mouse.click(*spot(page, 20.0, 7.5))
        page.click("#mark-hazard")
        wait_for(page, "document.querySelector('#hint').textContent.startsWith('Signed \"commander\"')")
        page.fill("#me", "Ann")
        assert until(lambda: ann.look().marks and ben.look().marks)
        (mark,) = ben.look().marks
        assert (mark.mark, mark.by, mark.level) == ("hazard", "commander", 0)
        assert abs(mark.x_m - 20.0) < 0.2
        heard: list[tuple[ShownMark, ...]] = []

        def is_heard() -> bool:
            if news := wearer.news():
                heard.append(news)
            return bool(heard)

        assert until(is_heard)
        assert heard == [(mark,)]
        page.click("#list li:nth-child(1) button")
        page.click("#acknowledge")
        assert until(lambda: not ann.look().rows[0].open_alarm and not ben.look().rows[0].open_alarm)
        assert ben.look().rows[0].notes[0] == "acknowledged by Ann"
        wait_for(page, "document.querySelector('#acknowledge').hidden")

        def is_told() -> bool:
            wearer.news()
            return wearer.answer_to(1) == "Ann has acknowledged it."

        assert until(is_told)
        assert wearer.answer_to(2) == ""
        with Commander(broker.url) as late:  # a third one has the same state at once
            assert until(
                lambda: late.look().marks == (mark,) and late.look().rows and not late.look().rows[0].open_alarm
            )
        page.click("#close")
        page.mouse.click(*spot(page, 20.0, 7.5))
        page.click("#mark-remove")
        assert until(lambda: not ann.look().marks and not ben.look().marks)
        assert until(lambda: wearer.news() == ())
        assert not page.wrong
        box.close()
        subscription.close()


@pytest.mark.long
@needs_broker
def test_a_broker_that_dies_and_has_lost_its_memory_gets_it_back(tmp_path: Path) -> None:
    with Broker(tmp_path) as broker, Commander(broker.url) as ann, Commander(broker.url) as ben:
        box = box_to(broker.url)
        box.offer(report("anna", alarm=ReportedAlarm("mayday", "no motion", 1, 31.0)))
        for x_m in (3.0, 9.0):
            assert not ann.page.feed.act(SetMark("hazard", x_m, 7.5, 0, "Ann"))
        assert until(lambda: len(ben.look().marks) == 2 and ben.look().rows)
        assert not ben.page.feed.act(Acknowledge(ben.look().rows[0].id, "Ben"))
        assert until(lambda: ann.look().rows and not ann.look().rows[0].open_alarm)
        assert until(lambda: len(ann.look().marks) == 2)
        first, second = (mark.id for mark in ann.look().marks)
        broker.stop()
        assert until(lambda: not ann.look().connected and not ben.look().connected)
        broker.start()
        assert not ben.page.feed.act(Unmark(first))  # sent when the connection is back
        assert until(lambda: [mark.id for mark in ann.look().marks] == [second] and ben.look().connected)
        with Commander(broker.url) as late:  # knows only what the broker has

            def has_all() -> bool:
                _, _, now = ann.look(), ben.look(), late.look()
                return bool([m.id for m in now.marks] == [second] and now.rows and not now.rows[0].open_alarm)

            assert until(has_all)
        box.close()


def test_marks_are_on_the_table_and_without_a_broker_it_is_said(browser: Any, tmp_path: Path) -> None:
    team = whole_team()
    with ServedTeam(team) as served:
        x_m, y_m = TOWER.levels[0].rooms[0].at_m
        marks = tuple(
            ShownMark(f"{k:08x}", kind, x_m - 6.0 + 3.0 * k, y_m + 3.0, 0, "Ann") for k, kind in enumerate(KINDS)
        )
        served.page.feed.publish(replace(team.scene(), marks=marks))
        page = table(browser, served.page.url, "phone")
        wait_for(page, "echostep.scene.marks.length === 3")
        page.fill("#me", "Ben")
        page.mouse.click(*spot(page, x_m + 9.0, y_m + 3.0))
        found = violations(page)
        shot(page, "marks", tmp_path)
        page.click("#mark-cleared")
        wait_for(page, "document.querySelector('#hint').textContent.startsWith('Not sent')")
        assert not page.wrong
    assert found == []


KINDS = ("cleared", "hazard", "meeting")


def test_a_wearer_sees_the_marks_of_the_commanders(browser: Any) -> None:
    mailbox = Mailbox(PLAN, "test", replay=False)
    with PageServer(mailbox, LOCAL) as server:
        mailbox.publish(scene())
        page = looking(browser, server.url, "bright")
        assert page.locator("#marks").is_hidden()
        mailbox.set_marks(tuple(ShownMark(f"{k:08x}", kind, 5.0 + k, 7.5, 0, "Ann") for k, kind in enumerate(KINDS)))
        wait_for(page, "document.querySelector('#marks').textContent === 'marks: 1 cleared, 1 hazard, 1 meeting point'")
        mailbox.publish(scene(2.0))
        wait_for(page, "echostep.last.marks === null && echostep.scene.marks.length === 3")  # they are sent once
        mailbox.set_marks(())
        wait_for(page, "document.querySelector('#marks').hidden")
        assert not page.wrong
