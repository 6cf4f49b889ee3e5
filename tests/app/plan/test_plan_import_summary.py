# SPDX-License-Identifier: MIT
"""What `plan import` shows: a summary of at most twelve lines, a picture that covers no other one, advice for this format only."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

import command_line
from echostep.plan import Door, load_plan
from echostep_app.plan.importers.report import ImportReport
from echostep_app.plan.importers.summary import MOST_LINES, doors_in_gaps, summary
from plan.drawings.drawn_houses import write_house
from plan.imported_plans import seven_floors

PNG = b"\x89PNG\r\n\x1a\n"


@pytest.mark.process
def test_an_import_shows_what_came_in(tmp_path: Path) -> None:
    source = write_house(tmp_path / "house.dxf")
    done = command_line.echostep("plan", "import", source, "-o", tmp_path / "plan.json")
    assert done.stdout.splitlines() == [
        "house, 0 m: 10 x 8 m, 14 walls (84 m), 1 door (1 in a gap of a wall), 0 rooms",
        "units: m ($INSUNITS; sizes fit)",
        "layers: walls: A-WALL; doors: A-DOOR",
        f"{tmp_path / 'plan.json'}, {tmp_path / 'plan.png'}",
    ]
    assert (tmp_path / "plan.png").read_bytes().startswith(PNG)
    assert load_plan(tmp_path / "plan.json").levels[0].name == "house"


@pytest.mark.long
@pytest.mark.process
def test_the_picture_beside_the_plan(tmp_path: Path) -> None:
    """It replaces one that an import drew, and no other; --no-picture draws none."""
    source = write_house(tmp_path / "house.dxf")
    command = ["plan", "import", source, "-o", tmp_path / "plan.json"]
    assert command_line.echostep(*command, "--no-picture").returncode == 0
    assert not (tmp_path / "plan.png").exists()
    (tmp_path / "plan.png").write_bytes(b"a scan")
    done = command_line.echostep(*command)
    assert "plan.png is another picture and stays" in done.stdout
    assert (tmp_path / "plan.png").read_bytes() == b"a scan"
    (tmp_path / "plan.png").unlink()
    for _ in range(2):
        assert command_line.echostep(*command).stdout.endswith(f", {tmp_path / 'plan.png'}\n")


@pytest.mark.process
def test_options_of_drawings_are_refused_elsewhere(tmp_path: Path) -> None:
    for name in ("a.osm", "a.pdf"):
        (tmp_path / name).write_text("<osm/>")
    for option in (("--units", "mm"), ("--window", "0,0,1,1"), ("--align",), ("--scale", "1"), ("--level", "a")):
        done = command_line.echostep("plan", "import", tmp_path / "a.osm", "-o", tmp_path / "plan.json", *option)
        assert f"{option[0]} is for drawings (DXF) alone" in done.stderr
        assert done.returncode == 2
    done = command_line.echostep("plan", "import", tmp_path / "a.pdf", "-o", tmp_path / "p.json", "--scale", "1")
    assert "a.pdf: PDF: make a picture of its page" in done.stderr
    done = command_line.echostep("plan", "import", tmp_path / "a.dxf", "-o", tmp_path / "p.json", "--window", "1,1,0,2")
    assert "--window 1,1,0,2: expected X0 < X1" in done.stderr


def test_at_most_twelve_lines() -> None:
    report = ImportReport(units="mm", layers={kind: [f"{kind}-{k}" for k in range(50)] for kind in ("walls", "doors")})
    for k in range(40):
        report.leave_out(f"LINE on layer {k}", 40 - k)
        report.doubt(f"doubt {k}")
    lines = summary(seven_floors(), report)
    assert len(lines) <= MOST_LINES - 1  # the command adds the names of the files
    text = "\n".join(lines)
    assert "... and 2 levels more" in text
    assert "left out: 40 LINE on layer 0, 39 LINE on layer 1" in text
    assert "of 34 other kinds" in text
    assert "note: doubt 0" in text
    assert all(len(line) < 400 for line in lines)


def test_doors_in_gaps_are_counted() -> None:
    """The entrance of this building is drawn in a wall without a gap."""
    level = seven_floors().levels[1]
    assert (doors_in_gaps(level), len(level.doors)) == (6, 7)
    away = Door((4.5, 2.0, 5.5, 2.0))
    through = Door((17.0, 14.0, 18.0, 14.0))
    assert doors_in_gaps(replace(level, doors=(*level.doors, away, through))) == 6


def test_sizes_that_no_building_has_are_told() -> None:
    plan = seven_floors()
    assert not any("scale" in line for line in summary(plan, ImportReport()))
    small = tuple(
        replace(level, walls=level.walls / 20, windows=level.windows / 20, doors=(Door((0.0, 0.0, 0.05, 0.0)),))
        for level in plan.levels[:1]
    )
    lines = summary(replace(plan, levels=small, connectors=()), ImportReport())
    assert "note: Basement is 1.21 m long: is the scale right?" in lines
    assert "note: half of the doors are 0.05 m wide or less: is the scale right?" in lines


@pytest.mark.process
def test_walls_with_gaps_are_not_called_closed(tmp_path: Path) -> None:
    """Rooms that a gap leads to can be entered, doors or not."""
    from ezdxf.filemanagement import new

    doc = new("R2010")
    doc.header["$INSUNITS"] = 6
    space = doc.modelspace()
    for line in ((0, 0, 12, 0), (12, 0, 12, 8), (12, 8, 0, 8), (0, 8, 0, 0), (0, 5, 2, 5), (2.9, 5, 12, 5)):
        space.add_line(line[:2], line[2:], {"layer": "A-WALL"})
    space.add_text("Kitchen", dxfattribs={"layer": "ROOM", "height": 0.3, "insert": (3, 6.5)})
    doc.saveas(tmp_path / "a.dxf")
    done = command_line.echostep("plan", "import", tmp_path / "a.dxf", "-o", tmp_path / "p.json", "--no-picture")
    assert "0 doors, 1 gap that people can pass, 1 room" in done.stdout
    assert "cannot be entered" not in done.stdout
    assert json.loads((tmp_path / "p.json").read_text())["levels"][0]["rooms"][0]["name"] == "Kitchen"
