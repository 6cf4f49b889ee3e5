# SPDX-License-Identifier: MIT
"""The end of a simulated run in the browser: nothing stays green, how well it went, the truth beside the estimate, and the time bar."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from echostep.errors import EchostepError
from echostep.ports.chunks import Portion, portion_of
from echostep.tracker import Tracker
from echostep_app import cli
from echostep_app.page.elements.scene import TruePath
from echostep_app.page.live import LivePage
from echostep_app.session.options import OutputOptions
from echostep_app.session.session import Session
from page.browser import SETTLED, loaded_page, opened_page, wait_for
from page.frames import LOCAL, PLAN, scene, served
from walks import walk_chunks

ENDED = "ended: mean error 0.06 m, at most 0.16 m. ▶ plays it again"
FITS = "echostep.view.shows([1, 1, 25, 13])"
STATUS = "document.getElementById('words').dataset.status"
SAYS = "document.getElementById('status-text').textContent"
PHONE = {"width": 360, "height": 640}


def test_a_page_says_that_the_run_has_ended_and_plays_it_again(browser: Any) -> None:
    t_s = np.arange(0.0, 20.0, 0.1)
    tracker, chunks = Tracker(PLAN, seed=1), walk_chunks()
    with LivePage(tracker, "echostep demo (simulated, 4 x real time)", LOCAL, keeps=True) as live:
        live.truth = TruePath(np.column_stack([t_s, 2.0 + 0.5 * t_s, 7.5 + 0.0 * t_s, 0.0 * t_s]))
        page = opened_page(browser, viewport=PHONE)
        page.goto(live.url)
        for k in range(0, len(chunks), 20):
            portion = portion_of(chunks[k : k + 20])
            tracker.take(portion)
            live.publish(portion)
        wait_for(page, "echostep.last && echostep.last.truth")
        assert "4 x real time" in page.inner_text("#title")
        assert page.is_hidden("#replay")
        live.mailbox.end("mean error 0.06 m, at most 0.16 m")
        wait_for(page, f"{SAYS} === '{ENDED}'")
        wait_for(page, f"!document.getElementById('replay').hidden && {SETTLED} && {FITS}")  # beside the time bar
        assert page.get_attribute("#words", "data-status") == "ended"
        green = page.evaluate("getComputedStyle(document.documentElement).getPropertyValue('--good')")
        assert page.evaluate("getComputedStyle(document.getElementById('mark')).color") != rgb(green)
        assert page.is_hidden("#here")
        for _ in range(2):  # the second time it is still playing when it comes to the end
            wait_for(page, "document.querySelector('#play').textContent === '▶'")
            page.click("#play")
            wait_for(page, f"{STATUS} === 'tracking' && echostep.last.play.playing && !echostep.last.ended")
            page.evaluate("echostep.link.send('seek', { t_s: 1e6 })")


@pytest.mark.long
@pytest.mark.parametrize(
    "error",
    [
        EchostepError("/dev/ttyACM0: the firmware is older than this program: echostep flash writes it"),
        OSError(28, "No space left on device", "out/live/walk.mcap"),
    ],
)
def test_an_error_that_ends_the_run_is_on_the_page_in_the_words_of_the_terminal(
    browser: Any,
    tmp_path: Path,
    error: Exception,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pages: list[Any] = []

    def portions(url: str) -> Iterator[Portion]:
        pages.append(opened_page(browser, viewport=PHONE))
        pages[0].goto(url)
        chunks = walk_chunks()
        for k in range(0, len(chunks), 500):
            yield portion_of(chunks[k : k + 500])
        wait_for(pages[0], "echostep.last?.told")
        raise error

    def run() -> None:
        output = OutputOptions(tmp_path, terminal=False, page=LOCAL)
        with Session(Tracker(PLAN, seed=1), "echostep live", "live", output) as session:
            assert session.page
            session.track(portions(session.page.url))

    monkeypatch.setattr(cli, "app", run)
    with pytest.raises(SystemExit):
        cli.main()
    said = capsys.readouterr().err.removeprefix("echostep: ").strip()
    (page,) = pages
    wait_for(page, f"{STATUS} === 'ended' && {SAYS} === 'ended by an error'")
    assert page.inner_text("#fault") == said
    page.evaluate("echostep.link.wait = 50")
    wait_for(page, "echostep.link.failures > 4")  # the server is away; that it does not answer is no other error
    assert page.inner_text("#fault") == said


def test_a_frame_before_the_connection_ends_hides_no_error(browser: Any) -> None:
    with served() as (server, mailbox):
        mailbox.publish(scene())
        page = loaded_page(browser, server.url, {}, "window.echostep?.last")
        page.evaluate("echostep.link.onFailed('No space left on device', true)")
        mailbox.publish(scene(2.0))
        wait_for(page, "echostep.last.t_s === 2")
        page.evaluate("(echostep.link.wait = 1e9, echostep.link.socket.close())")
        wait_for(page, "!echostep.link.isOpen")
        assert page.evaluate(SAYS) == "ended by an error"


def rgb(colour: str) -> str:
    """#00734f as a browser gives it."""
    numbers = [int(colour.strip()[k : k + 2], 16) for k in (1, 3, 5)]
    return f"rgb({', '.join(map(str, numbers))})"
