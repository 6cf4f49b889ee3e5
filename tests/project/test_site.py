# SPDX-License-Identifier: MIT
"""The manual as a site: built strictly, whole, readable without network, on a phone too, with a search that finds."""

from __future__ import annotations

import re
import subprocess
import sys
from html import unescape
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import pytest

from board_runs import ROOT
from page.browser import opened_page
from waiting import PATIENCE_S

pytestmark = [pytest.mark.process, pytest.mark.long]

LOADED = re.compile(r"<(?:script|img|source|iframe|link(?! rel=\"canonical\"))\b[^>]*?\b(?:src|href)=\"([^\"]+)\"")


def build(source: Path, out: Path, *more: str) -> subprocess.CompletedProcess[str]:
    """`make site` with other folders."""
    options = ["-q", "-n", "-W", "--keep-going", "-c", str(ROOT / "tools/docs/manual"), "-d", str(out.parent / "cache")]
    command = [sys.executable, "-m", "sphinx", *options, *more, str(source), str(out)]
    return subprocess.run(command, capture_output=True, text=True, timeout=5.0 * PATIENCE_S, check=False)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The built site."""
    pytest.importorskip("sphinx", reason="sphinx is not installed: no site is built")
    out = tmp_path_factory.mktemp("site") / "html"
    done = build(ROOT, out)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return out


def pages(site: Path) -> list[Path]:
    return [page for page in site.rglob("*.html") if "_static" not in page.parts]


@pytest.mark.long
def test_each_page_of_the_manual_is_in_the_contents(site: Path) -> None:
    contents = (site / "index.html").read_text()
    listed = re.findall(r"^\| \[[^]]+\]\(([^)]+)\.md\)", (ROOT / "host/docs/README.md").read_text(), flags=re.M)
    assert len(listed) > 15
    assert re.findall(r'class="caption-text">([^<]+)<', contents) == ["Use", "Results", "How it is built"]
    for name in listed:
        page = (site / "host/docs" / f"{name}.html").resolve().relative_to(site.resolve())
        assert re.search(rf'toctree-l1(?: has-children)?"><a class="reference internal" href="{page}"', contents), name


@pytest.mark.long
def test_links_lead_to_a_file_and_to_an_anchor_of_it(site: Path) -> None:
    anchors = {page: set(re.findall(r'\bid="([^"]+)"', page.read_text())) for page in pages(site)}
    checked = 0
    for page in anchors:
        for raw in re.findall(r'\b(?:href|src)="([^"]+)"', page.read_text()):
            target, _, anchor = unescape(raw).partition("#")
            if target.startswith(("http:", "https:", "data:", "mailto:")):
                continue
            path = (page.parent / unquote(target.partition("?")[0])).resolve() if target else page
            assert path.exists(), f"{page}: {raw}"
            assert not anchor or path not in anchors or unquote(anchor) in anchors[path], f"{page}: {raw}"
            checked += 1
    assert checked > 500


def test_nothing_is_loaded_from_the_network(site: Path) -> None:
    for page in pages(site):
        for source in LOADED.findall(page.read_text()):
            assert not source.startswith(("http:", "https:", "//")), f"{page}: {source}"
    for style in (site / "_static").rglob("*.css"):
        assert not re.search(r"(?:@import|url\()\s*['\"]?(?:https?:)?//", style.read_text()), style


@pytest.mark.long
def test_a_dead_link_fails(tmp_path: Path) -> None:
    pytest.importorskip("furo", reason="sphinx is not installed: no site is built")
    (tmp_path / "in").mkdir()
    (tmp_path / "in/page.md").write_text("# A page\n[a](gone-page.md) [b](#gone-anchor) ![c](gone-picture.png)\n")
    done = build(tmp_path / "in", tmp_path / "out", "-D", "root_doc=page", "-D", "include_patterns=page.md")
    assert done.returncode == 1
    for named in ("gone-page.md", "gone-anchor", "gone-picture.png"):
        assert re.search(rf"page\.md:\d+: .*{named}", done.stderr), done.stderr


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
