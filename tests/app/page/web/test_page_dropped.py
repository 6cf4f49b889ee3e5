# SPDX-License-Identifier: MIT
"""`echostep page` in Chromium: recordings and plans that are dropped onto it, and files that are neither."""

from __future__ import annotations

import base64
import json
import queue
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from echostep.plan import Plan
from echostep_app.page.mailbox import Mailbox
from echostep_app.page.server import Address
from echostep_app.page.web import uploads
from echostep_app.plan.writer import plan_json
from echostep_app.session.metadata import run_metadata
from echostep_app.session.runs import dropped
from page.browser import loaded_page, overflow, violations, wait_for
from page.frames import PLAN, scene, served
from page.web.test_page_sizes import SIZES, UNREACHED
from recording.damages import write_recording
from waiting import PATIENCE_S
from walks import walk_chunks

WAITS = "document.querySelector('#status-text').textContent === 'drop a recording and its plan here'"
PLAYS = "echostep.last?.play && document.querySelector('#title').textContent.startsWith('{}')"
SAID = "document.querySelector('#drop-text').textContent"
HINT = "document.querySelector('#hint').textContent"
DROP = """([files]) => {
    const data = new DataTransfer();
    for (const [name, text] of files) data.items.add(new File([Uint8Array.from(atob(text), (c) => c.charCodeAt(0))], name));
    document.body.dispatchEvent(new DragEvent('drop', { dataTransfer: data, bubbles: true, cancelable: true }));
}"""
DESK = {"viewport": {"width": 1100, "height": 640}}
OTHER = replace(PLAN, name="Other building")


def recording(folder: Path, plan: Plan, name: str = "walk.mcap") -> Path:
    """A short walk on a plan, recorded."""
    path = folder / name
    write_recording(path, walk_chunks(6.0), run_metadata(plan, plan.start, 1, "", source="simulated"))
    return path


def drop(page: Any, *paths: Path) -> None:
    """Drop files onto the page."""
    page.evaluate(DROP, [[[path.name, base64.b64encode(path.read_bytes()).decode()] for path in paths]])


@contextmanager
def dropping(monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """The URL of `echostep page`, which runs in a thread."""
    urls: queue.Queue[str] = queue.Queue()
    ended = threading.Event()
    monkeypatch.setattr(dropped, "is_asked", ended.is_set)
    monkeypatch.setattr(dropped, "print_page", lambda _, served_at: urls.put(served_at[0]))
    run = threading.Thread(target=dropped.serve_drops, args=[Address(port=0)], kwargs={"browser": False})
    run.start()
    try:
        yield urls.get(timeout=PATIENCE_S)
    finally:
        ended.set()
        run.join()


def test_a_dropped_recording_plays_and_another_one_after_it(
    browser: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    with dropping(monkeypatch) as url, loaded_page(browser, url, DESK, WAITS) as page:
        assert page.is_hidden("#here")
        drop(page, recording(tmp_path, PLAN))  # the demo's plan is known
        wait_for(page, PLAYS.format("walk.mcap (simulated)"))
        assert page.is_hidden("#drop")
        page.click("#play")
        drop(page, recording(tmp_path, PLAN, "second.mcap"))
        wait_for(page, PLAYS.format("second.mcap (simulated)"))
        wait_for(page, "echostep.last.play.playing")  # from its beginning, not as the first one was left
        bad = tmp_path / "bad.mcap"
        bad.write_bytes(b"\x89MCAP0\r\n" + bytes(100))
        drop(page, bad)
        wait_for(page, f"{HINT} === 'bad.mcap: no recorded bytes in it: is this an echostep recording (.mcap)?'")
        assert page.evaluate(PLAYS.format("second.mcap"))  # it plays on
        assert [text for text in page.wrong if "422" not in text] == []


def test_a_recording_of_another_building_waits_for_its_plan(
    browser: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    plan = tmp_path / "other.json"
    plan.write_text(plan_json(OTHER))
    walk = recording(tmp_path, replace(OTHER, digest="7" * 64))
    with dropping(monkeypatch) as url, loaded_page(browser, url, DESK, WAITS) as page:
        drop(page, walk)
        wait_for(page, f"{SAID} === 'walk.mcap: now drop its plan (Other building).'")
        page.set_input_files("#drop-file", plan)  # by the button
        wait_for(page, f"{HINT} === 'Note: Other building is not the plan that walk.mcap was tracked on.'")
        wait_for(page, PLAYS.format("walk.mcap (simulated): Other building"))
        assert not page.wrong
        page.reload()
        wait_for(page, PLAYS.format("walk.mcap (simulated): Other building"))
    with dropping(monkeypatch) as url, loaded_page(browser, url, DESK, WAITS) as page:
        drop(page, walk)
        page.click("#drop-without")
        wait_for(page, PLAYS.format("walk.mcap (simulated): no plan"))


NEITHER = (
    ("walk.json", b"{", "walk.json: not a plan: "),
    ("../../etc/passwd", b"\xff\xfe\x00", "_.._etc_passwd: "),
    ("deep.json", b"[" * 100_000, "deep.json: "),
    ("plan.json", json.dumps({"name": 3}).encode(), "plan.json: "),
    ("empty.mcap", b"", "empty.mcap: "),
    ("long.json", b"x" * 200_000, "long.json: larger than 0 GiB"),
)


def test_a_file_that_is_neither_is_answered_by_one_sentence(browser: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(uploads, "MOST_FILE", 150_000)
    with dropping(monkeypatch) as url, loaded_page(browser, url, DESK, WAITS) as page:
        for name, contents, said in NEITHER:
            page.evaluate(DROP, [[[name, base64.b64encode(contents).decode()]]])
            wait_for(page, f"{SAID}.startsWith({json.dumps(said)})")
            sentence = page.inner_text("#drop-text")
            assert "\n" not in sentence
            assert "echostep-page-" not in sentence  # nothing of the temporary folder
            assert page.evaluate("document.querySelector('#drop-text').dataset.wrong") == "true"


@pytest.mark.parametrize("size", SIZES[1::2])
def test_the_waiting_page_keeps_nobody_out(
    browser: Any, monkeypatch: pytest.MonkeyPatch, size: tuple[int, int]
) -> None:
    with dropping(monkeypatch) as url:
        page = loaded_page(browser, url, {"viewport": {"width": size[0], "height": size[1]}}, WAITS)
        assert violations(page) == []
        assert overflow(page) == (0, 0)
        assert page.evaluate(UNREACHED) == []


def test_other_pages_take_no_files(browser: Any, tmp_path: Path) -> None:
    with served(Mailbox(PLAN, "test", replay=False)) as (server, mailbox):
        mailbox.publish(scene())
        page = loaded_page(browser, server.url, DESK, "echostep.last")
        path = tmp_path / "a.mcap"
        path.write_bytes(b"")
        drop(page, path)
        wait_for(page, f"{HINT}.includes('plays on the page of: echostep page')")
        assert not page.wrong
