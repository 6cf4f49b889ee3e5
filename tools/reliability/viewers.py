# SPDX-License-Identifier: MIT
"""Browsers on the page of one replay, which they play and seek, and one on a commander's page, for minutes: memory, load, frames, answers.

In: a recording, minutes, number of browsers; Chromium and mosquitto. Out: figures on the terminal. Owns the processes. What is measured depends on
what else the computer does; its load is printed.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from echostep.arrays import Floats
from places import PLAN, ROOT
from reliability.broker import broker
from reliability.campaign import Figure, options, report
from reliability.soak import resident_mb

WALK = ROOT / "tests/captures/walk.mcap"
LOOK_S = 5.0  # between two looks
SETTLED = 0.2  # of the time, after which memory should not grow
ANSWER_MS = 10_000  # longest wait for the frame of a moment that was asked for
TICKS = os.sysconf("SC_CLK_TCK")
# The time from a request for another moment to the frame that shows it, ms; a request that is not answered counts as ANSWER_MS
SEEK = """([share, limit]) => new Promise((done) => {
    const bar = document.querySelector('#time'), { link, scene } = echostep;
    const asked = Number(bar.min) + share * (Number(bar.max) - Number(bar.min)), began = performance.now();
    link.send('play', { playing: true });
    link.send('seek', { t_s: asked });
    const look = () => {
        const spent = performance.now() - began, shown = scene.frame?.play?.t_s;
        if (Math.abs(shown - asked) < 2 || spent > limit) done(spent);
        else requestAnimationFrame(look);
    };
    look();
})"""


@contextmanager
def serving(words: list[str]) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A command that serves a page, and the page's address."""
    process = subprocess.Popen(
        [sys.executable, "-u", "-m", "echostep", *words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    assert process.stdout
    try:
        printed = ""
        for line in process.stdout:
            printed += line
            if found := re.search(r"http://\S+", line):
                yield process, found[0].rstrip(".")
                return
        sys.exit(printed)
    finally:
        process.terminate()
        process.communicate()


def busy_s(process: int) -> float:
    """CPU time of a process [proc(5)]."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS


def wait_for(page: Any, holds: str) -> None:
    """Wait until an expression holds; the page's policy refuses what Playwright's own waiting would evaluate there."""
    while not page.evaluate(holds):
        page.wait_for_timeout(100)


def watch(seconds: float, pages: list[Any], processes: list[int]) -> tuple[Floats, Floats, Floats]:
    """Rows of time and memory of the processes; answers in ms (looks, replay pages); frames drawn of each page. The last page is the commander's."""
    began, rows, answers = time.monotonic(), [], []
    frames = np.array([page.evaluate("echostep.frames") for page in pages])
    while (passed := time.monotonic() - began) < seconds:
        rows.append([passed, *(resident_mb(str(process)) for process in processes)])
        answers.append([page.evaluate(SEEK, [(0.1 * len(rows)) % 0.8, ANSWER_MS]) for page in pages[:-1]])
        pages[0].wait_for_timeout(1e3 * min(LOOK_S, seconds / 4.0))
    drawn = np.array([page.evaluate("echostep.frames") for page in pages]) - frames
    return np.array(rows), np.array(answers), drawn / (time.monotonic() - began)


def slope_mb_h(times_s: Floats, mb: Floats) -> float:
    """Growth of memory by a straight line through what was measured after SETTLED of the time."""
    late = times_s >= SETTLED * times_s[-1]
    return float(np.polyfit(times_s[late], mb[late], 1)[0]) * 3600.0 if late.sum() > 1 else 0.0


def run(minutes: float, browsers: int, walk: Path, folder: Path) -> list[Figure]:
    """Serve and look."""
    from playwright.sync_api import sync_playwright

    with ExitStack() as stack:
        url = stack.enter_context(broker())
        common = ["--plan", str(PLAN), "--port", "0"]
        shown = [*common, "--page", "--publish", url, "--name", "anna", "--out", str(folder)]
        replay, page_url = stack.enter_context(serving(["replay", str(walk), *shown]))
        table = ["command", url, *common, "--out", str(folder / "operation.mcap")]
        command, table_url = stack.enter_context(serving(table))
        playwright = stack.enter_context(sync_playwright())
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"), args=["--no-sandbox", "--disable-gpu"]
        )
        stack.callback(browser.close)
        pages, wrong = [browser.new_context().new_page() for _ in range(browsers + 1)], list[str]()
        for page, address in zip(pages, [page_url] * browsers + [table_url], strict=True):
            page.on("pageerror", lambda error: wrong.append(str(error)))
            page.goto(address)
            wait_for(page, "window.echostep?.frames > 0")
        wait_for(pages[0], "Number(document.querySelector('#time').max) > 1")
        processes = [replay.pid, command.pid]
        before, began = [busy_s(p) for p in processes], time.monotonic()
        rows, answers, rates_hz = watch(60.0 * minutes, pages, processes)
        spent = [busy_s(p) - b for p, b in zip(processes, before, strict=True)]
        return figures(rows, answers, rates_hz, [100.0 * s / (time.monotonic() - began) for s in spent], wrong)


def figures(rows: Floats, answers: Floats, rates_hz: Floats, cpu: list[float], wrong: list[str]) -> list[Figure]:
    """What was measured; only an error of a page and a request without an answer are judged."""
    made = []
    for k, name in enumerate(("replay", "command"), 1):
        grows = slope_mb_h(rows[:, 0], rows[:, k])
        text = f"{rows[0, k]:.0f} MB at first, {rows[:, k].max():.0f} MB at most, {grows:+.1f} MB/h after a fifth of the time"
        made += [Figure(f"memory of {name}", text), Figure(f"{name}, of a core", f"{cpu[k - 1]:.0f} %")]
    unanswered = int((answers >= ANSWER_MS).sum())
    return [
        *made,
        Figure("frames/s of each browser", ", ".join(f"{rate:.1f}" for rate in rates_hz[:-1])),
        Figure("frames/s of the commander's page", f"{rates_hz[-1]:.1f}"),
        Figure(
            "another moment is shown after", f"{np.median(answers):.0f} ms (median), {answers.max():.0f} ms at most"
        ),
        Figure("requests without an answer", f"{unanswered} of {answers.size}", "0", unanswered == 0),
        Figure("errors of pages", str(len(wrong)), "0", not wrong),
        Figure("load of the computer, last 5 min", f"{os.getloadavg()[1]:.1f} on {os.cpu_count()} cores"),
    ]


def main() -> int:
    """Run, and print the figures."""
    given = options(
        __doc__, minutes=(10.0, "how long"), browsers=(5, "on the replay"), walk=(str(WALK), "the recording")
    )
    with TemporaryDirectory() as folder:
        return report("viewers", run(given.minutes, given.browsers, Path(given.walk), Path(folder)))


if __name__ == "__main__":
    sys.exit(main())
