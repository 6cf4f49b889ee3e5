# SPDX-License-Identifier: MIT
"""The manual as a site: built strictly, whole, readable without network, on a phone too, with a search that finds."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from board_runs import ROOT
from page.browser import opened_page
from waiting import PATIENCE_S, ran

pytestmark = [pytest.mark.process, pytest.mark.long]


def build(source: Path, out: Path, *more: str) -> subprocess.CompletedProcess[str]:
    """`make site` with other folders."""
    options = ["-q", "-n", "-W", "--keep-going", "-c", str(ROOT / "tools/docs/manual"), "-d", str(out.parent / "cache")]
    command = [sys.executable, "-m", "sphinx", *options, *more, str(source), str(out)]
    return ran(command, timeout=5.0 * PATIENCE_S)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The built site."""
    pytest.importorskip("sphinx", reason="sphinx is not installed: no site is built")
    out = tmp_path_factory.mktemp("site") / "html"
    done = build(ROOT, out)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return out


@pytest.mark.parametrize("width", [360, 1280])
def test_the_search_finds_without_a_server_or_a_network(site: Path, browser: Any, width: int) -> None:
    page = opened_page(browser, viewport={"width": width, "height": 800})
    requests: list[str] = []
    page.on("request", lambda request: requests.append(request.url))
    page.goto((site / "search.html").as_uri() + "?q=resampling")
    page.wait_for_selector("#search-results li a[href*='design/cloud']")
    for word in ("stairs", "language", "notebook"):  # the manual before decisions and what was tried
        page.goto((site / "search.html").as_uri() + f"?q={word}")
        found = page.locator("#search-results li a").first.get_attribute("href")
        assert not re.search("/(decisions|notebook)/", str(found)), (word, found)
    page.goto((site / "index.html").as_uri())
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.evaluate("[...document.images].every(image => image.complete && image.naturalWidth > 0)")
    assert all(url.startswith(("file:", "data:")) for url in requests), requests
    page.close()
