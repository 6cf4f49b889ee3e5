# SPDX-License-Identifier: MIT
"""Everybody out, and a note to one wearer: over a broker to the wearers' pages, and back who has understood; in Chromium."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import pytest

from echostep.ports.chunks import portion_of
from echostep_app.operation.requests import SetOrder, WriteNote, parse_request
from echostep_app.session.sinks import mark_sink
from echostep_app.team.inbox import ReceivedMessage
from echostep_app.team.messages.marks import MarkBoard
from echostep_app.team.messages.orders import (
    EVERYBODY,
    HOLDS_S,
    MOST_NOTES,
    OUT,
    Order,
    Receipt,
    note_message,
    order_message,
    receipt_message,
)
from echostep_app.team.messages.report import BadReportError, Presence, ReportedAlarm, encode
from operation.teams import TOWER, Team, place, whole_team
from operation.test_marks_and_alarms import Commander
from operation.test_sent import SPEAKS
from page.browser import HELD_MS, READY, Walk, loaded_page, overflow, wait_for
from page.web.test_page_sizes import SIZES, UNREACHED
from team.network import box_to, feed_of
from team.team_broker import Broker, needs_broker
from team.team_reports import report
from waiting import until

TEXT = "document.querySelector('#everybody-text').textContent"


def row(team: Team, name: str) -> Any:
    return next(row for row in team.scene().rows if row.name == name)


def test_who_has_understood_is_counted_and_stands_in_the_history() -> None:
    team = whole_team()
    assert not team.ask(SetOrder("Ann"))
    order = team.scene().order
    assert order
    assert (order.text, order.by, order.understood, order.of) == (OUT, "Ann", 0, 8)
    kim = ("everybody", "red", "Kim")
    team.put_bytes(*receipt_message(kim, Receipt(1, order.unix_s, "Kim", team.unix_s)))
    told = team.scene().order
    assert told
    assert (told.understood, "Kim" in told.missing, "Bo" in told.missing) == (1, False, True)
    team.pass_time(1.0)
    assert row(team, "Kim").notes[0] == f"understood: {OUT}"
    assert row(team, "Bo").notes[0] == f"not understood yet: {OUT}"
    assert not team.ask(SetOrder("Ben"))  # once more, with the clock of another commander: all are asked anew
    again = team.scene().order
    assert again
    assert (again.by, again.understood) == ("Ben", 0)
    bo = row(team, "Bo").id
    assert not team.ask(SetOrder("Ben", to=bo, text="Come to stairs B"))
    assert not team.ask(SetOrder("Ben", ended=True))
    assert team.scene().order is None
    team.pass_time(1.0)
    assert row(team, "Bo").notes[0] == "not understood yet: Come to stairs B"
    said = [event.text for event in team.details(bo)[1]]
    assert said[:4] == ["everybody out: ended", "Ben: Come to stairs B", f"Ben: {OUT}", f"Ann: {OUT}"]
    copied = team.operation.copy()
    assert set(copied.shared) == set(team.operation.shared)


def test_a_note_stays_in_the_log_and_in_the_table_at_the_end(tmp_path: Path) -> None:
    team, path = Team(), tmp_path / "crews.csv"
    assert not team.ask(WriteNote("stairs B are closed", "Ann"))
    ((identity, note),) = team.operation._board.log.items()
    topic, payload = note_message(identity, note)
    for other in (b"", payload, note_message(identity, Order(1, "nothing", "Ben", note.unix_s + 1.0))[1]):
        team.put_bytes(topic, other)  # a note is not taken back or overwritten
    team.pass_time(1.0)
    assert [event.text for event in team.scene().log] == ["Ann: stairs B are closed"]
    assert team.scene().log is team.scene().log  # a page gets it when it changes
    assert (topic, payload) in team.operation.copy().shared
    team.operation.crew_log.write(path)
    assert path.read_text().splitlines()[1:] == ["2027-01-15T08:00:00+00:00,,,note: stairs B are closed,,,,Ann"]
    team.pass_time(HOLDS_S)
    assert team.scene().log == ()  # that was another operation
    for k in range(MOST_NOTES - 1):
        team.put_bytes(*note_message(f"{k:08x}", Order(1, "x", "Ann", team.unix_s)))
    assert team.operation.act(WriteNote("one more", "Ann"), 0.0, 0.0) == "Not written: the log is full."


def test_hostile_orders_are_refused() -> None:
    board, (topic, payload) = MarkBoard(), order_message(EVERYBODY, Order(1, OUT, "Ann", 1.8e9))
    for wrong in (
        (topic, b"{"),
        (topic, payload.replace(b"Ann", b"A\\u0007n")),
        (topic.replace("everybody", "red/+"), payload),
        ("echostep-table/receipt/other/red/kim", payload),
        ("echostep-table/log/0123abcd", b""),
        ("echostep-table/log/x", payload),
        note_message("0123abcd", Order(1, "a\x07", "Ann", 1.8e9)),
        (topic, order_message(EVERYBODY, Order(1, "x" * 201, "Ann", 1.8e9))[1]),
    ):
        with pytest.raises(BadReportError):
            board.receive(*wrong)
    assert not board.orders
    assert not board.log
    assert parse_request('{"kind":"order","by":"Ann","text":"  "}') is None
    assert parse_request('{"kind":"order","by":"Ann"}') == SetOrder("Ann")


@needs_broker
def test_everybody_is_ordered_out_and_says_so(browser: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("echostep_app.session.team.subscription.LOOK_S", 0.0)
    with Broker(tmp_path) as broker, Commander(broker.url) as ben, Walk(1.0, 1.0, stands=True) as walk:
        subscription, feed = feed_of(broker.url, "bo")
        sink = mark_sink(feed, walk.page)
        subscription.open()
        box = box_to(broker.url, name="bo")
        box.offer(report("bo"))
        assert until(lambda: len(ben.look().rows) == 1)
        how = {"viewport": {"width": 360, "height": 740}}
        wearer = loaded_page(browser, walk.page.url, how, READY, SPEAKS)
        table = loaded_page(browser, ben.page.url, how, "document.querySelectorAll('#list li').length === 1")
        table.click("#out")
        wait_for(table, "document.querySelector('#hint').textContent === 'Hold Everybody out for a second.'")
        table.click("#out", delay=HELD_MS)

        def exchanged(page: Any, holds: str) -> bool:
            sink.take(portion_of([]), [])
            ben.look()
            return bool(page.evaluate(holds))

        assert until(lambda: exchanged(table, f"{TEXT}.endsWith('understood by 0 of 1. not understood yet: bo')"))
        assert until(lambda: exchanged(wearer, "!document.querySelector('#order').hidden"))
        assert wearer.inner_text("#order-text") == f"commander: {OUT}"
        assert wearer.evaluate("said").count(f"commander: {OUT}") == 1
        assert table.inner_text("#hint") == 'Signed "commander": enter your name.'
        table.fill("#me", "Ben")
        for page in (wearer, table):
            for width, height in SIZES:
                page.set_viewport_size({"width": width, "height": height})
                assert overflow(page) == (0, 0), width
                assert page.evaluate(UNREACHED) == [], (width, page is table)
        wearer.reload()  # what is not understood stays
        wait_for(wearer, f"{READY} && !document.querySelector('#order').hidden")
        wearer.click("#understood")
        assert until(lambda: exchanged(table, f"{TEXT}.endsWith('understood by 1 of 1')"))
        assert until(lambda: exchanged(wearer, "document.querySelector('#order').hidden"))
        table.click("#list li button")
        table.fill("#note", "Come to stairs B")
        table.keyboard.press("Enter")
        assert until(lambda: exchanged(wearer, "!document.querySelector('#order').hidden"))
        assert wearer.inner_text("#order-text") == "Ben: Come to stairs B"
        wearer.click("#understood")
        told = "document.querySelector('#history').innerText.includes('understood: Come to stairs B')"
        assert until(lambda: exchanged(table, told))
        table.click("#everybody-end")
        assert until(lambda: exchanged(table, "document.querySelector('#everybody').hidden"))
        box.close()
        subscription.close()


def test_yesterdays_order_is_no_order(monkeypatch: pytest.MonkeyPatch) -> None:
    """A broker keeps what nobody has ended."""
    _, feed = feed_of("mqtt://localhost", "bo")
    feed._receive(
        ReceivedMessage(*order_message(EVERYBODY, Order(1, OUT, "Ann", 1e9)), retained=True, received_s=0.0, unix_s=1e9)
    )
    for age_s, shown in ((30.0, ["Ann"]), (250.0, ["Ann, 4 min ago"]), (1.1 * HOLDS_S, [])):
        monkeypatch.setattr(time, "time", lambda now_s=1e9 + age_s: now_s)
        assert [order.text for order in feed.orders()] == [f"{by}: {OUT}" for by in shown]


def test_an_order_is_over_when_all_are_out() -> None:
    """A run that had ended before is not out by it; nor is a run that calls for help."""
    team, told = Team(now_s=0.0), list[tuple[str, bytes]]()

    def end(name: str) -> None:
        team.put_bytes(f"echostep/red/{name}/presence", encode(Presence(1, "0123abcd", "ended")))
        told.extend(team.operation.take_answers())

    for name in ("Kim", "Bo"):
        team.hear(name, place(TOWER, 1.0, 1.0, 0))
    end("Bo")
    team.pass_time(10.0)
    assert not team.ask(SetOrder("Ann"))
    team.pass_time(10.0)
    team.hear("Kim", place(TOWER, 1.0, 1.0, 0), alarm=ReportedAlarm("mayday", "help", 1, 0.0))
    end("Kim")
    assert [topic for topic, _ in told] == ["echostep-table/seen/red/Kim/0123abcd-1"]
    assert team.scene().order
    team.hear("Kim", place(TOWER, 1.0, 1.0, 0))
    end("Kim")
    assert [topic for topic, _ in told[1:]] == [f"echostep-table/order/{EVERYBODY}"]
    assert team.scene().order is None
