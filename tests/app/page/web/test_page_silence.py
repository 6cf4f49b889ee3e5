# SPDX-License-Identifier: MIT
"""What feeds a page stands still, or the wire to it does: both pages say so, date what they show, and lose no request, in Chromium."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from websockets.sync.client import ClientConnection

from echostep.ports.people.check_in import Call
from echostep_app.page.mailbox import Mailbox, popped
from page.browser import HELD_MS, TABLE_READY, loaded_page, overflow, wait_for
from page.frames import BEAT, PLAN, opened_url, scene, served
from page.outage import Feeder, Wire, outage
from page.web.test_page_sizes import SIZES, UNREACHED
from waiting import PATIENCE_S, until

READY = {
    "wearer": "window.echostep?.last?.told && echostep.scene.frame.guidance && document.querySelector('#walls path')",
    "commander": TABLE_READY,
}
FRESH = {"wearer": "tracking, 0.2 m", "commander": "connected"}
STATUS = "document.querySelector('#status-text').textContent"
SLEPT_S = 3600
TOLD = """new MutationObserver(() => { window.age_s ??= echostep.link.pulse.age_s; })
    .observe(document.body, { attributeFilter: ['data-silent'] })"""  # keeps how old what is shown was when the page said so
SLEEPS = f"(() => {{ const now = Date.now; Date.now = () => now() + {1000 * SLEPT_S}; window.age_s = undefined; }})()"  # a computer slept
WITHIN_S = 5.0  # of which the tick of the page has its share
DATED = """(id) => getComputedStyle(document.querySelector(id), '::before').content"""
BEATS = "echostep.link.pulse.heard"
BACKGROUND = """(() => { const { pulse } = echostep.link, tick = pulse.tick; let last = 0;
    pulse.tick = function () { const now = performance.now(); if (now - last > 1600) { last = now; tick.call(this); } };
})()"""  # a browser's timers come late in a tab that is not seen
OUTBOX = "document.querySelector('#outbox').textContent"


@pytest.fixture(scope="module")
def wearer() -> Iterator[Feeder]:
    """A wearer's process for all tests; a commander's, whose mayday is acknowledged once, is one of each test."""
    with Feeder("wearer") as feeder:
        yield feeder


@contextmanager
def feeding(role: str, wearer: Feeder) -> Iterator[Feeder]:
    """The process of a role, which has carried out nothing yet."""
    if role == "wearer":
        wearer.lines.clear()
        yield wearer
        return
    with Feeder(role) as feeder:
        yield feeder


def shown(page: Any, role: str) -> str:
    """What a page says that gets nothing any more, and how long it says so."""
    wait_for(page, "document.body.dataset.silent === 'present'")
    words = {"wearer": "no position for ", "commander": "no news for "}[role]
    said = str(page.evaluate(STATUS))
    assert said.startswith(words)
    assert page.inner_text("#silence").startswith("No answer from ")
    return said


def dated(page: Any, role: str) -> None:
    """Nothing is shown as of now, and what cannot act is off and says why."""
    for part in {"wearer": ("#place",), "commander": ("#summary", "#list li:nth-child(5) .said")}[role]:
        assert " ago: " in page.evaluate(DATED, part), part
    off = {"wearer": "#here", "commander": "#floors button"}[role]
    assert page.evaluate(f"document.querySelector('{off}').disabled")
    assert page.get_attribute(off, "title") == "Off while the program does not answer"
    if role == "wearer":
        assert page.inner_text("#cue") == "Stop. There is nothing from the tracker."
        assert page.evaluate("document.querySelector('#words').dataset.status") == "lost"
    else:
        assert "heard now" not in page.inner_text("#list")
        assert not page.locator("#list [data-state='tracking']").count()


def ask(page: Any, role: str) -> None:
    """A call for help, or the acknowledgement of a mayday."""
    if role == "wearer":
        page.click("#help", delay=HELD_MS)
        wait_for(page, f"{OUTBOX}.startsWith('Help!: sending for ')")
        return
    page.fill("#me", "Ben")
    page.click("#list li:first-child button")
    page.click("#acknowledge")
    wait_for(page, f"{OUTBOX}.startsWith('Acknowledge: sending for ')")


CARRIED_OUT = {"wearer": "Call(help=True)", "commander": "/ack/"}  # what the feeder prints of it
LATER = {"wearer": "'call', { help: false }", "commander": "'log', { text: 'seen', by: 'Ben' }"}  # another request
LATER_OUT = {"wearer": "Call(help=False)", "commander": "/log/"}


def printed(feeder: Feeder, words: str) -> int:
    """How many requests with these words have been carried out."""
    return sum(words in line for line in feeder.lines)


def check(browser: Any, wearer: Feeder, role: str, kind: str, size: tuple[int, int], *, reloads: bool = True) -> None:
    with feeding(role, wearer) as feeder, Wire(feeder.url) as wire:
        page = loaded_page(browser, wire.url, {"viewport": {"width": size[0], "height": size[1]}}, READY[role])
        wait_for(page, f"{STATUS} === '{FRESH[role]}' && document.querySelector('#silence').hidden")
        page.evaluate(TOLD)
        before_s = 0.0
        with outage(kind, feeder, wire):
            if kind == "asleep":
                wait_for(page, "echostep.link.pulse.since_s > 1.5")  # no beat is on its way
                before_s = SLEPT_S + page.evaluate("echostep.link.pulse.age_s")
                page.evaluate(SLEEPS)
                wait_for(page, f"{STATUS}.includes(' for {SLEPT_S // 60} min')")
            said = shown(page, role)
            late_s = page.evaluate("age_s") - before_s
            assert (f"for {SLEPT_S // 60} min" in said) == (kind == "asleep")
            dated(page, role)
            ask(page, role)
            assert overflow(page) == (0, 0)
            assert page.evaluate(UNREACHED) == []
        wait_for(page, f"{STATUS} === '{FRESH[role]}' && !document.body.dataset.silent")
        wait_for(page, f"!{OUTBOX}.includes('sending') && !echostep.link.outbox.kept.length")
        assert until(lambda: printed(feeder, CARRIED_OUT[role]))
        if reloads:  # what was answered does not come again
            page.reload()
            wait_for(page, f"{READY[role]} && echostep.link.isOpen")
        page.evaluate(f"echostep.link.send({LATER[role]})")
        assert until(lambda: printed(feeder, LATER_OUT[role]))
        assert printed(feeder, CARRIED_OUT[role]) == 1
        assert not [wrong for wrong in page.wrong if "WebSocket" not in wrong and "net::" not in wrong]
    assert late_s < WITHIN_S


@pytest.mark.parametrize("role", READY)
def test_a_program_that_stands_still_is_told_and_a_request_arrives_once(
    browser: Any, wearer: Feeder, role: str
) -> None:
    check(browser, wearer, role, "stopped", (360, 740), reloads=False)


@pytest.mark.long
@pytest.mark.parametrize("role", READY)
@pytest.mark.parametrize(
    ("kind", "size"), [(k, SIZES[1]) for k in ("frozen", "cut", "asleep")] + [("stopped", size) for size in SIZES]
)
def test_every_outage_and_one_at_every_size(
    browser: Any, wearer: Feeder, role: str, kind: str, size: tuple[int, int]
) -> None:
    check(browser, wearer, role, kind, size)


@pytest.mark.long
def test_a_call_survives_a_reload_and_the_end_of_the_program(browser: Any) -> None:
    """The page is loaded again from its own computer while nothing answers; what answers then is another run."""
    with Feeder("wearer") as feeder, Feeder("wearer") as other, Wire(feeder.url) as wire:
        page = loaded_page(browser, wire.url, {"viewport": {"width": 360, "height": 740}}, READY["wearer"])
        with outage("stopped", feeder, wire):
            shown(page, "wearer")
            page.select_option("#goal", "map")
            page.keyboard.press("Escape")
            ask(page, "wearer")
            page.select_option("#goal", label="Meeting")
            for damaged in ("null", '{"kind": "go_to"', '{"kind": "none", "request": "1", "at_ms": 9e12}'):
                page.evaluate(
                    "([key, text]) => { localStorage[`request ${location.pathname} ${key}`] = text; }",
                    [len(damaged), damaged],
                )
            page.evaluate("echostep.link.wait = 1e9")  # the page that is left does not come back
            wire.cut()
            wire.lead_to(other.url)
            wire.mend()
            page.reload()
            wait_for(page, READY["wearer"])
            assert until(lambda: other.lines)
            wait_for(page, f"{OUTBOX}.includes('Go here: not sent: the program has been started anew')")
            assert other.lines == ["Call(help=True)"]
        wait_for(page, "Object.keys(localStorage).filter((key) => key.startsWith('request')).length <= 3")


def test_no_call_is_lost_by_a_clock_that_is_set_nor_in_one_of_two_tabs(browser: Any, wearer: Feeder) -> None:
    with feeding("wearer", wearer) as feeder, Wire(feeder.url) as wire:
        page = loaded_page(browser, wire.url, {"viewport": {"width": 360, "height": 740}}, READY["wearer"])
        tab = page.context.new_page()
        tab.goto(wire.url)
        wait_for(tab, READY["wearer"])
        with outage("stopped", feeder, wire):
            shown(page, "wearer")
            ask(page, "wearer")
            wait_for(tab, f"{OUTBOX}.startsWith('Help!: sending for ')")
            page.evaluate("(() => { const { now } = Date; Date.now = () => now() - 3600e3; })()")
            wait_for(page, f"/sending for [1-9]\\d* s/.test({OUTBOX})")
        for each in (page, tab):
            wait_for(each, f"!{OUTBOX}.includes('sending') && !echostep.link.outbox.kept.length")
        assert until(lambda: feeder.lines)
        tab.close()
        old = "{ kind: 'call', help: true, request: '1-2-3-4', at_ms: Date.now() - 3600e3 }"  # of another day
        page.evaluate(f"localStorage['request / 1-2-3-4'] = JSON.stringify({old})")
        page.reload()
        wait_for(page, f"{OUTBOX} === 'Help!: not sent: too late by now, do it again'")
        assert feeder.lines == ["Call(help=True)"]


def test_a_run_that_hangs_behind_its_server_is_told_and_what_has_nothing_to_say_is_not_silent(browser: Any) -> None:
    with served(Mailbox(PLAN, "echostep live", replay=False)) as (server, mailbox):
        page = loaded_page(browser, server.url, {}, "window.echostep?.link.isOpen")
        wait_for(page, f"{BEATS} > 3 && document.querySelector('#silence').hidden")  # no estimate yet
        page.evaluate(BACKGROUND)
        mailbox.publish(scene())
        mailbox.exchange.note_alive()
        wait_for(page, "document.body.dataset.silent === 'present' && document.querySelector('#here').disabled")
        mailbox.end("mean error 0.06 m")  # after which nothing new is expected
        wait_for(page, "!document.body.dataset.silent && echostep.last.ended")
        assert page.is_hidden("#silence")
        assert page.is_enabled("#here")
        assert not page.wrong


def test_a_beat_comes_at_once_and_a_request_is_carried_out_once() -> None:
    with served() as (server, mailbox), opened_url(server.url) as page:
        page.recv(timeout=PATIENCE_S)  # hello
        assert BEAT in str(ClientConnection.recv(page, PATIENCE_S))
        call = {"kind": "call", "help": True, "request": "12-34-56-78"}
        for _ in range(2):
            page.send(json.dumps(call))
            answer = {"kind": "answered", "request": "12-34-56-78", "reason": ""}
            assert json.loads(page.recv(timeout=PATIENCE_S)) == answer
        with opened_url(server.url) as again:  # after a new connection
            again.recv(timeout=PATIENCE_S)
            again.send(json.dumps(call))
            assert json.loads(again.recv(timeout=PATIENCE_S))["reason"] == ""
        assert list(popped(mailbox.check_ins)) == [Call(help=True)]
        page.send(json.dumps(call | {"help": "please", "request": "12-34-56-79"}))
        assert "another version" in json.loads(page.recv(timeout=PATIENCE_S))["reason"]
        here = {"kind": "check_in", "x_m": 2, "y_m": 7.5, "sd_m": 0.5}
        page.send(json.dumps(here | {"request": "12-34-56-81", "until_s": time.monotonic() - 0.1}))
        assert json.loads(page.recv(timeout=PATIENCE_S))["reason"].startswith("It came too late")
        page.send(json.dumps(here | {"request": "12-34-56-82", "until_s": time.monotonic() + PATIENCE_S}))
        assert not json.loads(page.recv(timeout=PATIENCE_S))["reason"]
        assert len(list(popped(mailbox.check_ins))) == 1
        late = {"request": "12-34-56-82", "until_s": time.monotonic() - 0.1}
        page.send(json.dumps(here | late))  # again, later: it was carried out
        assert not json.loads(page.recv(timeout=PATIENCE_S))["reason"]
        page.send(json.dumps(here | {"y_m": 8.5, "request": "12-34-56-80"}))
        assert "inside a wall" in json.loads(page.recv(timeout=PATIENCE_S))["reason"]


SETTLED_CALLS = "echostep.link.outbox.kept.length === 0"
HELD = """() => {
    const help = document.querySelector('#help'), begun = performance.now();
    const point = (kind) => help.dispatchEvent(new PointerEvent(kind, { pointerId: 1 }));
    help.setPointerCapture = () => {};
    point('pointerdown');
    while (performance.now() < begun + 1100);
    point('pointerup');
}"""  # while the page is too busy for its timer


@pytest.mark.parametrize("how", ["key", "busy", "brush"])
def test_help_is_held_and_a_brush_is_none(browser: Any, how: str) -> None:
    with served() as (server, mailbox):
        mailbox.publish(scene())
        page = loaded_page(browser, server.url, {}, "window.echostep?.last?.told")
        if how == "brush":
            page.click("#help")
            wait_for(page, "document.querySelector('#hint').textContent === 'Hold Help! for a second.'")
        elif how == "busy":
            page.evaluate(HELD)
        else:
            page.press("#help", "Enter")  # no glove presses a key
        if how != "brush":
            wait_for(page, SETTLED_CALLS)
        page.evaluate("echostep.link.send('call', { help: false })")  # after which nothing of before can come
        wait_for(page, SETTLED_CALLS)
        assert page.is_hidden("#outbox")  # how far a call has come is said by the alarm alone
        assert list(popped(mailbox.check_ins)) == [Call(help=True)] * (how != "brush") + [Call(help=False)]
