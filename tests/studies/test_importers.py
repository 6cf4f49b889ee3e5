# SPDX-License-Identifier: MIT
"""The study `importers`: which files of a folder it reads, what it counts of each, what a refusal and an empty folder give."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from command_line import echostep
from echostep.errors import EchostepError
from echostep_studies.importers.study import buildings_in, importers_study
from plan.drawings.drawn_houses import write_house
from plan.test_plan_importer_imdf import files
from plan.test_plan_importer_imdf import folder as write_venue


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A drawing, one in wrong units, a format that is not read, a building of several files, and what is none."""
    drawings = tmp_path / "drawings"
    drawings.mkdir()
    write_house(drawings / "house.dxf")
    (drawings / "plan.dwg").write_bytes(b"AC1032")
    (drawings / "notes.txt").write_text("x")
    wrong = (drawings / "house.dxf").read_text().replace("$INSUNITS\n 70\n6\n", "$INSUNITS\n 70\n4\n")
    (drawings / "wrong.dxf").write_text(wrong)
    write_venue(tmp_path / "venue", files(levels=3))
    return tmp_path


def test_buildings_are_files_and_folders(folder: Path) -> None:
    names = [str(path.relative_to(folder)) for path in buildings_in(folder)]
    assert names == ["drawings/house.dxf", "drawings/plan.dwg", "drawings/wrong.dxf", "venue"]


@pytest.mark.process
def test_the_command(folder: Path) -> None:
    done = echostep("evaluate", "importers", "--data", folder, "--json", folder / "rows.json", ends=0)
    rows = {row["file"]: row for row in json.loads((folder / "rows.json").read_text())["rows"]}
    house = rows["drawings/house.dxf"]
    assert (house["outcome"], house["levels"], house["walls"], house["doors"], house["in_gaps"]) == (
        "imported",
        1,
        14,
        1,
        1,
    )
    assert (house["long_m"], house["wide_m"], house["enclosed"]) == (10.0, 8.0, None)
    assert rows["drawings/wrong.dxf"]["outcome"] == "refused"
    assert "is it in metres? give --units m" in rows["drawings/wrong.dxf"]["says"]
    assert "save it as DXF" in rows["drawings/plan.dwg"]["says"]
    venue = rows["venue"]
    assert (venue["levels"], venue["rooms"], venue["enclosed"]) == (3, 3, 1.0)
    assert "2 refused" in done.stdout
    assert "in a gap of a wall" in done.stdout


def test_a_folder_without_buildings(tmp_path: Path) -> None:
    with pytest.raises(EchostepError, match="no drawings, models or maps in it"):
        importers_study(tmp_path)
    with pytest.raises(EchostepError, match="cannot be read"):
        importers_study(tmp_path / "none")
