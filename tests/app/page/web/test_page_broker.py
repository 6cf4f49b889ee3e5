# SPDX-License-Identifier: MIT
"""A broker that dies or freezes between a wearer and a commander, both programs: both pages say so, and what is asked for arrives once."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from command_line import PROGRAM
from page.browser import HELD_MS, READY, TABLE_READY, loaded_page, overflow, wait_for
from page.web.test_page_silence import OUTBOX, STATUS, WITHIN_S
from page.web.test_page_sizes import SIZES, UNREACHED
from team.team_broker import Broker, needs_broker
from waiting import PATIENCE_S
from walks import DEMO

ROW = "document.querySelector('#list li .said').textContent"
WAITING = "Requests that wait for the broker: 1"
LOST = "no broker: the last known state"


@contextmanager
def program(*arguments: object) -> Iterator[str]:
    """A program until the end of the test; its page's address."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path), "PYTHONUNBUFFERED": "1"}
    command = [*PROGRAM, *map(str, arguments)]
    running = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment)
    assert running.stdout
    try:
        found = next(filter(None, (re.search(r"http://127\.0\.0\.1:\d+/\S*", line) for line in running.stdout)))
        yield found[0]
    finally:
        running.terminate()
        running.communicate(timeout=PATIENCE_S)


def outage(wearer: Any, table: Any, begin: Callable[[], None], end: Callable[[], None]) -> None:
    """Both pages say that the broker is gone, take what is asked for, and say what has become of it."""
    begin()
    began_s = time.monotonic()
    wait_for(table, f"{STATUS} === '{LOST}'")
    wait_for(wearer, "!document.querySelector('#wrong').hidden")
    assert time.monotonic() - began_s < WITHIN_S
    wearer.click("#help", delay=HELD_MS)
    wait_for(wearer, "document.querySelector('#alarm').textContent.includes('It has not gone out: ')")
    table.focus("#map")
    table.keyboard.press("m")
    table.click("#mark-hazard")
    wait_for(table, f"{OUTBOX}.includes('{WAITING}')")
    wait_for(table, f"!{ROW}.includes('heard now')")
    for page in (wearer, table):
        assert overflow(page) == (0, 0)
        assert page.evaluate(UNREACHED) == []
    assert table.evaluate("echostep.scene.marks.length") == 0  # what is shown is what all commanders have
    end()
    wait_for(table, f"{STATUS} === 'connected' && {ROW}.startsWith('mayday')")
    wait_for(table, f"echostep.scene.marks.length === 1 && !{OUTBOX}.includes('broker')")


@pytest.mark.long
@needs_broker
@pytest.mark.parametrize(("begin", "end"), [("stop", "start"), ("freeze", "thaw")])
def test_a_dead_or_frozen_broker_is_told(browser: Any, tmp_path: Path, begin: str, end: str) -> None:
    with Broker(tmp_path) as broker:
        walk = f"demo --speed 0.5 --port 0 --publish {broker.url} --name anna --out {tmp_path / 'demo'}".split()
        follow = ("command", broker.url, "--plan", DEMO, "--port", 0, "--out", tmp_path / "operation.mcap")
        with program(*follow) as table_url, program(*walk, "--page", "--no-open") as wearer_url:
            how = {"viewport": dict(zip(("width", "height"), SIZES[1], strict=True))}
            wearer = loaded_page(browser, wearer_url, how, READY)
            table = loaded_page(browser, table_url, how, TABLE_READY)
            table.fill("#me", "Ben")
            outage(wearer, table, getattr(broker, begin), getattr(broker, end))
            table.click("#list li:first-child button")
            table.click("#acknowledge")
            wait_for(wearer, "document.querySelector('#alarm').textContent.includes('Ben has acknowledged it')")
            wearer.click("#fine")
            wait_for(table, f"!{ROW}.startsWith('mayday')")
            table.evaluate("echostep.link.send('unmark', { id: echostep.scene.marks[0].id })")
            wait_for(table, "!echostep.scene.marks.length")
            assert [*wearer.wrong, *table.wrong] == []
