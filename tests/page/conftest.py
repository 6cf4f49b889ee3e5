"""One Chromium, and one short walk, for all tests of a module."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from typing import Any

import pytest

from echostep.ports.chunks import Chunk
from echostep.simulation.devices.board import PythonBoard
from echostep.simulation.scenario import Scenario
from page.frames import PLAN

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """Chromium, driven by Playwright; skips where one of them is missing."""
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed: no page is looked at")
    if CHROMIUM is None:
        pytest.skip("no chromium on this machine: no page is looked at")
    with playwright.sync_playwright() as running:
        chromium = running.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield chromium
        chromium.close()


@pytest.fixture(scope="module")
def chunks() -> list[Chunk]:
    """A simulated walk of 11 m on the demo's plan."""
    return list(Scenario(PLAN, ((2.0, 7.5), (9.5, 7.5), (9.5, 10.8)), 5, PythonBoard(seed=5)).chunks())
