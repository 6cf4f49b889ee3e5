# SPDX-License-Identifier: MIT
"""A researcher's visit: the notebooks of the manual run as they stand, and show tables, pictures and small errors.

The cells run in this process, one after the other, as a notebook's kernel runs them.
"""

from __future__ import annotations

import ast
import json
import re
import sys
from pathlib import Path
from typing import Any

import pytest

import echostep
from board_runs import ROOT
from echostep_app.extras import EXTRAS
from needs_data import data_or_skip

FOLDER = ROOT / "host/docs/notebooks"
INSTALLED = re.findall(r"\w+", re.findall(r"pip install ([^`]+)`", (FOLDER / "README.md").read_text())[0])
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))


def cells(path: Path) -> list[dict[str, Any]]:
    """Cells of a notebook."""
    return list(json.loads(path.read_text())["cells"])


def run(name: str, monkeypatch: pytest.MonkeyPatch, folder: Path) -> tuple[dict[str, Any], list[Any]]:
    """What the cells of a notebook have named, and the values that it shows below them."""
    monkeypatch.chdir(folder)
    monkeypatch.setenv("MPLBACKEND", "agg")
    for package, extra in EXTRAS.items():  # as after what the README installs
        if not {package, extra} & set(INSTALLED):
            monkeypatch.setitem(sys.modules, package, None)
    names: dict[str, Any] = {"__name__": "__main__"}
    shown = []
    for number, cell in enumerate(cells(FOLDER / f"{name}.ipynb")):
        if cell["cell_type"] != "code":
            continue
        tree = ast.parse("".join(cell["source"]))
        last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
        exec(compile(tree, f"{name}.ipynb, cell {number}", "exec"), names)
        if isinstance(last, ast.Expr):
            shown.append(eval(compile(ast.Expression(last.value), f"{name}.ipynb, cell {number}", "eval"), names))
    return names, shown


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_is_kept_without_outputs(path: Path) -> None:
    tree = json.loads(path.read_text())
    assert (tree["nbformat"], tree["nbformat_minor"]) == (4, 4)
    assert cells(path)[0]["source"][0].startswith("# ")
    for cell in cells(path):
        assert set(cell) == {"cell_type", "metadata", "source"} | (
            {"execution_count", "outputs"} if cell["cell_type"] == "code" else set()
        )
        assert not cell.get("outputs")
        assert cell.get("execution_count") is None


def test_the_page_lists_them() -> None:
    assert len(NOTEBOOKS) == 3
    assert re.findall(r"\((\w+\.ipynb)\)", (FOLDER / "README.md").read_text()) == [
        "first_track.ipynb",
        "foot_error.ipynb",
        "inside.ipynb",
    ]


@pytest.mark.process
@pytest.mark.long
def test_a_first_track(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    names, shown = run("first_track", monkeypatch, tmp_path)
    (walk,) = [value for value in shown if isinstance(value, echostep.Walk)]
    (plan,) = [value for value in shown if isinstance(value, echostep.plan.Plan)]
    for pictured in (plan, walk):
        assert "</svg>" in (pictured._repr_svg_() or "")
    assert repr(walk).startswith("<Walk 'walk.mcap (simulated)': ")
    assert len(names["table"]) == len(walk.estimates) > 100
    assert float(names["error_m"].max()) < 0.5
    assert (tmp_path / "track.pdf").read_bytes().startswith(b"%PDF")
    assert "(simulated)" in capsys.readouterr().out


@pytest.mark.process
@pytest.mark.long
def test_settings_and_pings(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    names, shown = run("inside", monkeypatch, tmp_path)
    assert repr(shown[0]) == "Settings(cloud=CloudSettings(size=100))"
    assert list(shown[1].columns) == ["usual", "100 particles", "echoes not believed"]
    assert float(shown[1]["usual"]["max"]) < 0.5
    assert float((abs(names["off_m"]) < 0.2).mean()) > 0.5
    assert "measured / m" in (tmp_path / "pings.svg").read_text()


@pytest.mark.process
@pytest.mark.long
def test_a_foot_with_its_error(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("ECHOSTEP_DATA", str(data_or_skip("vicon_pyshoe").parent))
    names, shown = run("foot_error", monkeypatch, tmp_path)
    assert "</svg>" in (shown[1]._repr_svg_() or "")
    assert 0.0 < names["card"]["ce50_m"] < names["card"]["ce95_m"] < 0.3
    assert "motion capture" in (tmp_path / "foot.svg").read_text()


@pytest.mark.process
def test_without_the_recordings_the_notebook_says_which_and_where(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("ECHOSTEP_DATA", str(tmp_path))
    with pytest.raises(FileNotFoundError, match="set ECHOSTEP_DATA to the folder that holds vicon_pyshoe"):
        run("foot_error", monkeypatch, tmp_path)
