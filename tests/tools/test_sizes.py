# SPDX-License-Identifier: MIT
"""What outgrows its limit, and a limit that has risen, fail `make check`."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from release import sizes

pytestmark = pytest.mark.process

LIMITS = """
"files of a folder" = 1
"lines of a file" = 4
"lines of a function" = 2
[parts]
"host/core" = 4
"host/app" = 0
"host/studies" = 0
"tools" = 0
"all code" = 10
"words of pages" = 3
"""


@pytest.fixture
def tree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A repository with one file of four lines and a page of three words, and limits that both keep."""
    subprocess.run(["git", "init", "--quiet", tmp_path], check=True)
    (tmp_path / "host/core").mkdir(parents=True)
    (tmp_path / "host/core/a.py").write_text("def f():\n    pass\n\n\n")
    (tmp_path / "a.md").write_text("one two three")
    (tmp_path / "limits").write_text(LIMITS)
    monkeypatch.setattr("sys.argv", ["sizes"])
    monkeypatch.setattr(sizes, "ROOT", tmp_path)
    monkeypatch.setattr(sizes, "LIMITS", tmp_path / "limits")
    return tmp_path


def commit(tree: Path) -> None:
    subprocess.run(["git", "add", "."], cwd=tree, check=True)
    who = ["-c", "user.name=a", "-c", "user.email=a@b"]
    subprocess.run(["git", *who, "commit", "--quiet", "--message", "x"], cwd=tree, check=True)


@pytest.mark.parametrize(("path", "text", "words"), [
    ("a.md", "one two three four", "words of pages: 4 is above 3"),
    ("host/core/a.py", "x = 1\n" * 5, "host/core/a.py: lines of a file: 5 is above 4"),
    ("host/core/a.py", "def f():\n    pass\n    pass\n", "host/core/a.py: f: lines of a function: 3 is above 2"),
    ("host/simulation/b.py", "x = 1\n", "host/app: 1 is above 0"),
])  # fmt: skip
def test_what_outgrows_its_limit_is_named(
    tree: Path, capsys: pytest.CaptureFixture[str], path: str, text: str, words: str
) -> None:
    assert sizes.main() == 0
    (tree / path).parent.mkdir(exist_ok=True)
    (tree / path).write_text(text)
    assert sizes.main() == 1
    assert words in capsys.readouterr().out


@pytest.mark.parametrize("committed", [False, True])
def test_a_limit_that_rose_is_named_whatever_has_been_committed_since(
    tree: Path, capsys: pytest.CaptureFixture[str], committed: bool
) -> None:
    commit(tree)
    (tree / "limits").write_text(LIMITS.replace('"tools" = 0', '"tools" = 1'))
    if committed:
        commit(tree)
        (tree / "a.md").write_text("one")
        commit(tree)
    assert sizes.main() == 1
    assert capsys.readouterr().out.endswith("tools: its limit rose from 0 to 1: limits only fall\n")
