# SPDX-License-Identifier: MIT
"""The manual as a site (`make site`): the same pages as in the source tree, with search, for Sphinx.

In: the Markdown files named in `include_patterns`, at their places, so that their links hold in both. Out: HTML that needs no network. The order
of the contents is that of the table in host/docs/README.md; below design, decisions and notebook stand their pages. Owns nothing.
"""

from __future__ import annotations

import re
import shutil
import tomllib
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[3]
MANUAL = Path("host/docs")
# Folders whose README lists the other pages
SERIES = ("host/docs/design", "host/docs/decisions", "host/studies/notebook")

project = "echostep"
version = release = tomllib.loads((ROOT / "host/core/pyproject.toml").read_text())["project"]["version"]
copyright = "the echostep authors"  # noqa: A001 (Sphinx' name)
extensions = ["myst_parser"]
smartquotes = False  # else the dashes of an option become one that no terminal takes
highlight_language = "none"  # of blocks that name no language
root_doc = "README"
include_patterns = [
    "README.md",
    "host/*.md",
    "host/core/*.md",
    "host/docs/*.md",
    "host/docs/*/*.md",
    "host/studies/*.md",
    "host/studies/notebook/*.md",
    "firmware/*.md",
    "firmware/hardware/*.md",
    "protocol/*.md",
    "tools/twin/*.md",
]
exclude_patterns = [".?*", "out", "tests", "host/core/echostep", "host/app", "**/build", "**/__pycache__"]
myst_heading_anchors = 4
suppress_warnings = ["myst.header"]  # a page may begin below its title's level

html_theme = "furo"
html_title = f"echostep {version}"
html_favicon = str(ROOT / "host/app/echostep_app/page/static/icon.svg")
html_static_path = ["static"]
html_search_scorer = str(Path(__file__).with_name("scorer.js"))
html_css_files = ["site.css"]
html_copy_source = html_show_sphinx = False


def contents(manual: str) -> dict[str, list[str]]:
    """Documents that the manual's tables list, by their headings, in their order, as paths from the root without suffix."""
    parts = [part.partition("\n") for part in manual.split("\n## ")[1:]]
    rows = {heading: re.findall(r"^\| \[[^]]+\]\(([^)]+)\.md\)", table, flags=re.M) for heading, _, table in parts}
    return {
        heading: [(ROOT / MANUAL / row).resolve().relative_to(ROOT).as_posix() for row in listed]
        for heading, listed in rows.items()
    }


def add_contents(_app: Any, document: str, source: list[str]) -> None:
    """Append the contents to the first page's text, and to that of each series; they are seen in the sidebar only."""
    folder, _, name = document.rpartition("/")
    if document == root_doc:
        pages = {"": [f"{MANUAL}/README"]} | contents((ROOT / MANUAL / "README.md").read_text())
    elif folder in SERIES and name == "README":
        pages = {"": sorted(page.stem for page in (ROOT / folder).glob("*.md") if page.stem != name)}
    else:
        return
    for heading, listed in pages.items():
        caption = f":caption: {heading}\n" if heading else ""
        source[0] += f"\n```{{toctree}}\n:hidden:\n{caption}\n" + "\n".join(listed) + "\n```\n"


def copy_first_page(app: Any, failure: Exception | None) -> None:
    """index.html, where servers look for it."""
    if failure is None and app.builder.format == "html":
        shutil.copy(Path(app.outdir) / f"{app.config.root_doc}.html", Path(app.outdir) / "index.html")


def setup(app: Any) -> None:
    """Called by Sphinx."""
    app.connect("source-read", add_contents)
    app.connect("build-finished", copy_first_page)
