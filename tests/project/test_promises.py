# SPDX-License-Identifier: MIT
"""What the pages promise is shown by tests: each row of a table of promises names them, and they exist."""

from __future__ import annotations

import ast
import re
from functools import cache
from pathlib import Path

import pytest

from board_runs import ROOT

# Page, and the title of its table: | promise | shown by |
TABLES = {
    "host/docs/recordings.md": "What is promised",
}
SECURITY = "host/SECURITY.md"  # several tables, whose last column names the test; what is not defended has none
NAMED = re.compile(r"`(?:tests/)?([\w/]+\.py)::(\w+)`")  # a test, its file from tests/ on


@cache
def names_in(path: Path) -> frozenset[str]:
    """Names of the test functions of a file."""
    tree = ast.parse(path.read_text())
    return frozenset(f.name for f in tree.body if isinstance(f, ast.FunctionDef) and f.name.startswith("test_"))


def promises(page: str) -> list[tuple[str, str]]:
    """The rows of the page's table: promise, what it is shown by."""
    text = (ROOT / page).read_text()
    section = text.partition(f"## {TABLES[page]}\n")[2].partition("\n## ")[0]
    rows = [re.split(r"(?<!\\) \| ", line.strip("| \n")) for line in section.splitlines() if line.startswith("| ")]
    assert rows, f"{page}: no table under {TABLES[page]!r}"
    assert all(len(row) == 2 for row in rows), rows
    return [(promise, shown_by) for promise, shown_by in rows[1:]]


@pytest.mark.parametrize("page", TABLES)
def test_each_promise_names_its_tests(page: str) -> None:
    rows = promises(page)
    assert len(rows) >= 5
    assert not [promise for promise, shown_by in rows if not NAMED.search(shown_by)]


def test_each_promise_of_security_names_its_test() -> None:
    promised = (ROOT / SECURITY).read_text().partition("## Not defended")[0]
    rows = [line for line in promised.splitlines() if line.startswith("| ") and not line.endswith("| test |")]
    assert len(rows) > 30
    assert not [row for row in rows if not NAMED.search(row.rsplit(" | ", 1)[1])]


@pytest.mark.parametrize("page", [*TABLES, SECURITY])
def test_the_named_tests_exist(page: str) -> None:
    for file, name in NAMED.findall((ROOT / page).read_text()):
        path = ROOT / "tests" / file
        assert path.is_file(), f"{page}: no file tests/{file}"
        assert name in names_in(path), f"{page}: tests/{file} has no {name}"
