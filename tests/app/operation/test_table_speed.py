# SPDX-License-Identifier: MIT
"""Measurements of the commander's page in Chromium (`make page-speed`): printed, not judged, since they depend on the machine's load."""

from __future__ import annotations

import fcntl
import os
import re
import signal
import struct
import subprocess
import sys
import termios
import time
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Self

import pytest

from command_line import PROGRAM
from operation.crowd import Crowd, Terminal, child_cpu_s, publishing
from operation.teams import STOREYS
from operation.test_table_page import table
from page.browser import wait_for
from team.team_broker import Broker, needs_broker
from waiting import until
from walks import DEMO

SPAN_S = 5.0
SLOWER = 4.0  # a main thread so many times slower: what Lighthouse takes for a phone of the middle class
PANNED = """() => {
    const move = (t_ms) => { echostep.view.pan(3 * Math.cos(t_ms / 300), 0); requestAnimationFrame(move); };
    requestAnimationFrame(move);
}"""  # moves the map with every animation frame
WEIGHED = """() => {
    const { link } = echostep, { parse } = link;
    echostep.bytes = 0;
    link.parse = (buffer) => { echostep.bytes += buffer.byteLength; return parse(buffer); };
}"""  # counts the bytes of frames


@pytest.mark.speed
@pytest.mark.parametrize("wearers", [5, 200])
def test_frame_rate(browser: Any, wearers: int) -> None:
    """Wearers report ten times a second each, spread evenly over time; their trails are as long as they get."""
    print()
    with Crowd(wearers) as crowd, table(browser, crowd.served.page.url, "wide") as page:
        page.evaluate(WEIGHED)
        console = page.context.new_cdp_session(page)
        console.send("Performance.enable", {"timeDomain": "threadTicks"})
        for floor in range(STOREYS):
            page.click(f"#floors button:nth-child({floor + 1})")
            wait_for(page, f"echostep.scene.level === {floor}")
            say(crowd, f"floor {floor}", page, console)
        console.send("Emulation.setCPUThrottlingRate", {"rate": SLOWER})
        say(crowd, f"CPU {SLOWER:g} times slower", page, console)
        console.send("Emulation.setCPUThrottlingRate", {"rate": 1.0})
        page.evaluate(PANNED)
        say(crowd, "map moved all the time", page, console)
        assert page.locator("#list li").count() == wearers
        assert not page.wrong


@dataclass(frozen=True, slots=True)
class Counts:
    """Sums since the beginning: scenes published, frames drawn and their bytes, seconds of CPU of the page's main thread, and of the server."""

    t_s: float
    scenes: float
    frames: float
    bytes: float
    main_s: float
    server_s: float

    @classmethod
    def of(cls, crowd: Crowd, page: Any, console: Any) -> Self:
        """The counts of now."""
        named = {m["name"]: m["value"] for m in console.send("Performance.getMetrics")["metrics"]}
        frames, received = page.evaluate("[echostep.frames, echostep.bytes]")
        return cls(time.monotonic(), crowd.scenes, frames, received, named["TaskDuration"], crowd.busy_s)

    def since(self, began: Self) -> Self:
        """The difference to earlier counts."""
        return type(self)(*(getattr(self, f.name) - getattr(began, f.name) for f in fields(self)))


def say(crowd: Crowd, name: str, page: Any, console: Any) -> None:
    """Measure for SPAN_S, and print."""
    began = Counts.of(crowd, page, console)
    time.sleep(SPAN_S)
    n = Counts.of(crowd, page, console).since(began)
    print(
        f"{crowd.wearers} wearers, {name}: {n.frames:.0f} frames drawn of {n.scenes:.0f} scenes, {n.frames / n.t_s:.1f}/s; "
        f"a frame takes {1e3 * n.main_s / max(n.frames, 1.0):.1f} ms of CPU of the page's thread and {n.bytes / max(n.frames, 1.0) / 1e3:.1f} kB; "
        f"reading and encoding {100.0 * n.server_s / n.t_s:.0f} % of a core"
    )


@pytest.mark.speed
@needs_broker
def test_frame_rate_of_the_command(browser: Any, tmp_path: Path) -> None:
    """The whole of it: a broker, `echostep command` with its table on a terminal of 50 lines, and 200 wearers, all on one floor."""
    ours, theirs = os.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 50, 140, 0, 0))
    with Broker(tmp_path) as broker, publishing(broker.url, 200):
        command = [
            *PROGRAM,
            "command",
            broker.url,
            "--plan",
            str(DEMO),
            "--port",
            "0",
            "--out",
            str(tmp_path / "a.mcap"),
        ]
        environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path), "TERM": "xterm", "COLUMNS": "140"}
        running = subprocess.Popen(command, stdout=theirs, stderr=theirs, env=environment)
        said = Terminal(ours)
        assert until(lambda: re.search(rb"http://127\.0\.0\.1:\d+/", said.text))
        found = re.search(rb"http://127\.0\.0\.1:\d+/", said.text)
        assert found
        page = table(browser, found[0].decode(), "wide")
        wait_for(page, "document.querySelectorAll('#list li').length === 200")
        for _ in range(3):
            frames, began_s, cpu_s = page.evaluate("echostep.frames"), time.monotonic(), child_cpu_s(running.pid)
            time.sleep(SPAN_S)
            drawn, span_s = page.evaluate("echostep.frames") - frames, time.monotonic() - began_s
            cpu = 100.0 * (child_cpu_s(running.pid) - cpu_s) / span_s
            print(
                f"echostep command, 200 wearers: {drawn} frames drawn, {drawn / span_s:.1f}/s; the command takes {cpu:.0f} % of a core"
            )
        assert not page.wrong
        page.context.close()
        running.send_signal(signal.SIGINT)
        assert until(lambda: running.poll() is not None)
