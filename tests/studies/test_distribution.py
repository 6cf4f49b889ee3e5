# SPDX-License-Identifier: MIT
"""The studies as a distribution of their own: what its wheel holds, and what is said where it is not installed."""

from __future__ import annotations

import configparser
import re
import subprocess
import sys
import zipfile

import pytest
import typer
from typer.testing import CliRunner

from board_runs import ROOT
from echostep.errors import EchostepError
from echostep_app.cli import app
from echostep_app.commands import studies
from echostep_app.commands.actions import offline as profiles
from echostep_studies.commands import OURS, PAPERS, REAL, STUDIES, StudyCommand

PACKAGE = ROOT / "host/studies/echostep_studies"


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> zipfile.ZipFile:
    pytest.importorskip("hatchling")
    folder = tmp_path_factory.mktemp("wheel")
    words = ["wheel", "--quiet", "--no-deps", "--no-build-isolation", "-w", str(folder), str(ROOT / "host/studies")]
    done = subprocess.run([sys.executable, "-m", "pip", *words], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    (built,) = folder.glob("echostep_studies-*.whl")
    return zipfile.ZipFile(built)


def test_the_wheel_holds_every_module_and_nothing_else(wheel: zipfile.ZipFile) -> None:
    modules = {str(path.relative_to(PACKAGE.parent)) for path in PACKAGE.rglob("*.py")}
    held = {name for name in wheel.namelist() if ".dist-info/" not in name}
    assert held == modules | {"echostep_studies/py.typed"}


def test_each_entry_point_leads_into_the_wheel(wheel: zipfile.ZipFile) -> None:
    (name,) = (name for name in wheel.namelist() if name.endswith(".dist-info/entry_points.txt"))
    points = configparser.ConfigParser()
    points.read_string(wheel.read(name).decode())
    found = {group: dict(points[group]) for group in points.sections()}
    assert set(found) == {studies.GROUP, profiles.GROUP}
    assert set(found[studies.GROUP]) == set(studies.NAMES)
    assert set(found[profiles.GROUP]) == {"foot.fischer2008", "legs.lee2010"}
    modules = [point.split(":")[0] for group in found.values() for point in group.values()]
    assert {f"{module.replace('.', '/')}.py" for module in modules} <= set(wheel.namelist())


@pytest.mark.parametrize("name", studies.NAMES)
def test_without_the_distribution_a_command_says_how_to_get_it(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(studies, "entry_points", lambda **_: ())
    alone_app = typer.Typer()
    studies.add_studies(alone_app)
    words = name, "girard2011", "--runs", "1"
    alone, asked = (CliRunner().invoke(alone_app, given) for given in (words[:1], words))
    assert "pip install echostep-studies" in alone.output
    assert isinstance(asked.exception, EchostepError)
    assert "pip install echostep-studies" in str(asked.exception)


@pytest.mark.parametrize(("part", "name"), [("foot", "fischer2008"), ("legs", "lee2010")])
def test_without_the_distribution_a_profile_says_how_to_get_it(
    part: str, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert profiles.method(part, name, None) is not None
    monkeypatch.setattr(profiles, "entry_points", lambda **_: ())
    with pytest.raises(EchostepError, match="pip install echostep-studies"):
        profiles.method(part, name, None)


@pytest.mark.parametrize("row", STUDIES, ids=lambda row: row.name)
def test_each_command_has_its_help(row: StudyCommand) -> None:
    done = CliRunner().invoke(app, ["evaluate", row.name, "--help"], env={"COLUMNS": "150"})
    assert done.exit_code == 0, done.output
    assert all(f"--{option.name.replace('_', '-')}" in done.output for option in row.options)


def test_the_help_lists_every_study_once_in_its_group_with_its_runs_and_duration() -> None:
    done = CliRunner().invoke(app, ["evaluate", "--help"], env={"COLUMNS": "100"})
    assert [group for group in (PAPERS, OURS, REAL) if f"\n{group}:\n" not in done.output] == []
    listed = re.findall(r"^  (\w+)  +\S", done.output.partition(f"{PAPERS}:")[2], flags=re.M)
    assert listed == [row.name for group in (PAPERS, OURS, REAL) for row in STUDIES if row.group == group]
    assert sorted(listed) == sorted(row.name for row in STUDIES)
    words = " ".join(done.output.split())
    assert "what they could not handle (simulated). 200 runs: minutes." in words
    assert "as an order of magnitude on two cores" in words
    assert all(row.described in words for row in STUDIES)


def test_without_a_command_run_nothing_heavy_is_imported() -> None:
    code = "import sys, echostep_studies.commands; print([m for m in ('numpy', 'rich.table', 'scipy') if m in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"
