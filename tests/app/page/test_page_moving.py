# SPDX-License-Identifier: MIT
"""README's moving picture: the page of the demo's replay in Chromium, a frame a second of the walk (simulated).

With ECHOSTEP_PICTURES=1 the whole walk is recorded, and `host/pictures/page.webp` is made anew.
"""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image, ImageChops

from board_runs import ROOT
from echostep.ports.chunks import portion_of
from echostep.tracker import Tracker
from echostep_app.page.elements.scene import TruePath
from echostep_app.page.live import LivePage
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.scenario import demo_scenario
from page.browser import FRAMED, PICTURES, READY, loaded_page, wait_for
from page.frames import LOCAL, PLAN

NAME = "page.webp"
TITLE = "A simulated walk"
SIZE = (860, 520)
# Of the walk between two frames, for which each is shown: 6.7 times as fast as it was walked
STEP_S, SHOWN_MS = (1.0, 150)
SMALL_S = 8.0  # of the walk, where the picture is not kept
PORTION = 16  # chunks, as in a run
MOST_BYTES = 1_500_000
IMAGE_DESCRIPTION = 0x010E  # Exif tag


@contextmanager
def replayed(seconds: float) -> Iterator[LivePage]:
    """The page of a replay of so much of the demo's walk, with its true positions."""
    scenario = demo_scenario(PLAN, 1, PythonBoard(seed=1))
    tracker = Tracker(PLAN, scenario.start, seed=1)
    chunks = list(scenario.chunks())
    first_ns = chunks[0].t_arrival_ns
    chunks = [chunk for chunk in chunks if chunk.t_arrival_ns - first_ns < seconds * 1e9]
    with LivePage(tracker, TITLE, LOCAL, replay=True) as page:
        page.truth = TruePath(np.insert(scenario.truth[:, :3], 3, 0.0, axis=1))
        for begin in range(0, len(chunks), PORTION):
            portion = portion_of(chunks[begin : begin + PORTION])
            tracker.take(portion)
            page.publish(portion)
        yield page


def recorded(page: Any) -> list[Image.Image]:
    """What the paused page shows at each second."""
    page.click("#play")
    wait_for(page, "!echostep.scene.frame.play.playing")
    begin_s, end_s = page.evaluate("[echostep.scene.frame.play.begin_s, echostep.scene.frame.play.end_s]")
    frames = []
    for t_s in np.arange(begin_s + 1.0, end_s, STEP_S):
        page.locator("#time").fill(f"{t_s:.1f}")
        wait_for(page, f"Math.abs(echostep.scene.frame.play.t_s - {t_s:.1f}) < 0.1")
        page.evaluate(FRAMED)
        frames.append(Image.open(io.BytesIO(page.screenshot())).convert("RGB"))
    return frames


def write(path: Path, frames: list[Image.Image]) -> None:
    """The animation, repeated for ever; the last frame stays longer."""
    exif = Image.Exif()
    exif[IMAGE_DESCRIPTION] = f"{TITLE} on the page of echostep, in Chromium"
    lasting_ms = [SHOWN_MS] * (len(frames) - 1) + [1500]
    frames[0].save(
        path, save_all=True, append_images=frames[1:], duration=lasting_ms, loop=0, quality=70, method=4, exif=exif
    )


@pytest.mark.long
def test_the_moving_picture_is_the_page_while_a_walk_goes_on(browser: Any, tmp_path: Path) -> None:
    with replayed(1e3 if PICTURES else SMALL_S) as served:
        size = {"width": SIZE[0], "height": SIZE[1]}
        page = loaded_page(browser, served.url, {"viewport": size, "color_scheme": "light"}, READY)
        assert TITLE in page.inner_text("#title")
        frames = recorded(page)
        assert not page.wrong
    assert len(frames) > 4
    assert all(ImageChops.difference(*pair).getbbox() for pair in zip(frames, frames[1:], strict=False))
    write((PICTURES or tmp_path) / NAME, frames)
    moves((PICTURES or tmp_path) / NAME, len(frames))


def moves(path: Path, least: int) -> None:
    """Whether the file is an animation of so many frames that says that it is simulated and is small enough for a first screen."""
    with Image.open(path) as picture:
        assert picture.size == SIZE
        assert getattr(picture, "n_frames", 1) >= least
        assert "simulated" in picture.getexif()[IMAGE_DESCRIPTION]
    assert path.stat().st_size < MOST_BYTES


def test_the_kept_picture_moves_and_is_small() -> None:
    moves(ROOT / "host/pictures" / NAME, 60)
