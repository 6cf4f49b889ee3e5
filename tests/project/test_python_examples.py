# SPDX-License-Identifier: MIT
"""The examples in the docstrings of the public names run as they stand in docs/python.md."""

from __future__ import annotations

import doctest
import shutil
from pathlib import Path

import pytest

import echostep
from board_runs import ROOT
from walks import DEMO

WITH_EXAMPLE = ("Chunk", "Estimate", "Settings", "Start", "Walk", "replay")


@pytest.mark.slow
@pytest.mark.parametrize("name", WITH_EXAMPLE)
def test_an_example_gives_what_it_says(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copy(DEMO, tmp_path / "demo.json")
    shutil.copy(ROOT / "tests/captures/walk.mcap", tmp_path)
    monkeypatch.chdir(tmp_path)
    (example, *_) = [
        test for test in doctest.DocTestFinder(recurse=False).find(getattr(echostep, name), name) if test.examples
    ]
    said: list[str] = []
    failed, _ = doctest.DocTestRunner().run(example, out=said.append)
    assert not failed, "".join(said)


def test_the_page_shows_them_as_code() -> None:
    page = (ROOT / "host/docs/python.md").read_text()
    for name in WITH_EXAMPLE:
        section = page.partition(f"### {name}\n")[2].partition("\n### ")[0]
        assert "```python\n>>> import echostep\n" in section, name
