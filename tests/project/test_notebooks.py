# SPDX-License-Identifier: MIT
"""A researcher's visit: notebooks and examples run as they stand, in this process as in a notebook's kernel; the benchmark measures."""

from __future__ import annotations

import ast
import doctest
import json
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from packaging.requirements import Requirement

import echostep
from board_runs import ROOT
from echostep_app.extras import EXTRAS
from waiting import PATIENCE_S, ran
from walks import DEMO

FOLDER = ROOT / "host/docs/notebooks"


def cells(path: Path) -> list[dict[str, Any]]:
    """Cells of a notebook."""
    return list(json.loads(path.read_text())["cells"])


def prescribed() -> set[str]:
    """The optional packages that the page's one line installs."""
    (line,) = re.findall(r"`pip install (.*?)`", (FOLDER / "README.md").read_text())
    *names, app = shlex.split(line)
    extras = Requirement(f"app[{app.partition('[')[2]}").extras
    return {package for package, extra in EXTRAS.items() if extra in extras or package in names}


def run(name: str, monkeypatch: pytest.MonkeyPatch, folder: Path) -> tuple[dict[str, Any], list[Any]]:
    """What the cells of a notebook have named, and the values that it shows below them."""
    monkeypatch.chdir(folder)
    monkeypatch.setenv("MPLBACKEND", "agg")
    for package in (
        set(EXTRAS) - prescribed() - {"pyarrow"}
    ):  # pandas goes on with it where another test has imported both
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
    """The first cell fetches the recording; what is not installed stays so."""
    try:
        names, shown = run("foot_error", monkeypatch, tmp_path)
    except subprocess.CalledProcessError as error:
        if "pip" in error.cmd:
            pytest.skip("pip cannot fetch the source of gaitmap here")
        raise
    assert "</svg>" in (shown[1]._repr_svg_() or "")
    assert 0.0 < names["card"]["ce50_m"] < 0.1 < names["card"]["ce95_m"] < 0.4
    assert "motion capture" in (tmp_path / "foot.svg").read_text()


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


@pytest.mark.long
@pytest.mark.process
def test_a_tiny_benchmark(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "echostep_studies.speed.bench", "--tiny", "--out", str(tmp_path)]
    done = ran(command, timeout=10.0 * PATIENCE_S)
    assert done.returncode == 0, done.stderr
    rows = json.loads((tmp_path / "bench.json").read_text())
    assert len(rows) >= 8
    for row in rows:
        assert set(row) == {"name", "ratio", "median_s", "peer_s"}
        assert row["name"].split(";")[0] in done.stdout.replace("\n", " ")
        assert row["ratio"] > 0.0
        assert row["median_s"] > 0.0
        assert row["peer_s"] > 0.0
    assert (tmp_path / "bench.png").stat().st_size > 1000
