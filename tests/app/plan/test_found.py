# SPDX-License-Identifier: MIT
"""What other programs really write, each by its right result; and what `plan import` shows of it: a summary, a picture, advice."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ezdxf.filemanagement import new
from ezdxf.xclip import XClip

import command_line
from echostep.errors import EchostepError
from echostep.plan import Door, Plan, load_plan, parse_plan
from echostep_app.plan.check import check_plan
from echostep_app.plan.georeference import EarthTransform
from echostep_app.plan.importers.report import ImportReport
from echostep_app.plan.importers.summary import doors_in_gaps, size_m, summary
from plan.drawings.drawn_houses import write_house
from plan.imported_plans import imported_file, seven_floors

DEG = 1e-5  # degrees of the small houses on the Earth


@pytest.mark.parametrize(("crs", "lon", "lat", "east", "north"), [
    ("EPSG:4314", 13.4, 52.5, 13.39825048, 52.49859207), ("EPSG:4258", 13.4, 52.5, 13.4, 52.5), ("EPSG:4326", 13.4, 52.5, 13.4, 52.5),
])  # fmt: skip
def test_a_stated_datum_is_that_of_the_origin(crs: str, lon: float, lat: float, east: float, north: float) -> None:
    earth = EarthTransform(plan_of([], {"origin": [lon, lat], "crs": crs}).georeference)  # type: ignore[arg-type]
    assert earth.degrees(np.zeros((1, 2))).tolist() == [pytest.approx([east, north], abs=1e-7)]
    assert earth.metres(np.array([[east, north]])) == pytest.approx(np.zeros((1, 2)), abs=0.02)


def plan_of(walls: list[list[float]], georeference: dict[str, Any] | None = None, **level: Any) -> Plan:
    tree: dict[str, Any] = {
        "echostep_plan": 1,
        "name": "t",
        "levels": [{"name": "EG", "height_m": 0, "walls": walls, **level}],
    }
    return parse_plan(json.dumps(tree | ({"georeference": georeference} if georeference else {})).encode())


def thick_house(t: float, x: float, y: float) -> list[list[float]]:
    """A house of 8 m by 6 m of walls of this thickness, with an open doorway of 0.9 m in the east."""
    outside: list[list[float]] = [[0, 6, 8, 6], [8, 0, 0, 0], [0, 0, 0, 6], [8, 6, 8, 3.4], [8, 2.5, 8, 0]]
    inside = [
        [8 - t, 6 - t, t, 6 - t],
        [t, t, 8 - t, t],
        [t, 6 - t, t, t],
        [8 - t, 3.4, 8 - t, 6 - t],
        [8 - t, t, 8 - t, 2.5],
    ]
    walls = [*outside, *inside, [8, 3.4, 8 - t, 3.4], [8 - t, 2.5, 8, 2.5]]
    return [[round(a + x, 9), round(b + y, 9), round(c + x, 9), round(d + y, 9)] for a, b, c, d in walls]


@pytest.mark.parametrize(
    ("t", "moved"), [*product((0.1, 0.24, 0.3, 0.365, 0.6, 0.9), ((0.0, 0.0), (1.0, 0.0), (500.0, 300.0)))]
)
def test_an_open_doorway_in_a_thick_wall_is_a_way_wherever_the_house_lies(t: float, moved: tuple[float, float]) -> None:
    walls = thick_house(t, *moved)
    for listed in (walls, walls[::-1]):
        plan = plan_of(listed, rooms=[{"name": "Hall", "at": [moved[0] + 4, moved[1] + 3]}])
        assert [str(finding) for finding in check_plan(plan)] == []


def test_a_narrow_closet_is_no_end_of_a_thick_wall() -> None:
    closet: list[list[float]] = [
        [0.0, 0, 0, 2],
        [0.6, 0, 0.6, 2],
        [0, 0, 0.6, 0],
        [-3, -1, 3, -1],
        [-3, -1, -3, 2],
        [3, -1, 3, 2],
        [-3, 2, 0, 2],
        [0.6, 2, 3, 2],
    ]
    plan = plan_of(closet, rooms=[{"name": "Hall", "at": [-2, 1]}])
    assert [str(finding) for finding in check_plan(plan)] == []


def ring(x: float = 0.0) -> list[list[float]]:
    return [[8.0 + (x + a) * DEG, 53.0 + b * DEG] for a, b in ((0, 0), (20, 0), (20, 10), (0, 10), (0, 0))]


def osm(ways: str) -> str:
    nodes = "".join(f'<node id="{k}" lon="{lon!r}" lat="{lat!r}"/>' for k, (lon, lat) in enumerate(ring()[:4], 1))
    return f'<osm version="0.6">{nodes}{ways}</osm>'


ROOM = '<way id="5">{}<tag k="indoor" v="room"/><tag k="level" v="0"/></way>'
REFS = "".join(f'<nd ref="{k}"/>' for k in (1, 2, 3, 4, 1))


def test_elements_without_a_level_are_told(tmp_path: Path) -> None:
    more = "".join(
        f'<way id="{k}">{REFS}<tag k="indoor" v="{v}"/></way>'
        for k, v in ((6, "no"), (7, "no"), (8, "yes"), (10, "yes"))
    )
    (tmp_path / "a.osm").write_text(osm(ROOM.format(REFS) + more))
    said = " ".join(imported_file(tmp_path / "a.osm")[1].doubts)
    assert "2 indoor=yes have no level" in said
    assert "indoor=no" not in said


def clip_of(path: Path, corners: list[tuple[float, float]]) -> Path:
    """A block of two rooms of 10 m by 8 m, 10 m apart, and a line between them, clipped in its own coordinates."""
    drawing = new("R2010", units=6)
    block = drawing.blocks.new("B")
    for x in (0, 20):
        block.add_lwpolyline([(x, 0), (x + 10, 0), (x + 10, 8), (x, 8)], close=True, dxfattribs={"layer": "WALLS"})
    block.add_line((10, 4), (20, 4), dxfattribs={"layer": "WALLS"})
    clip = XClip(drawing.modelspace().add_blockref("B", (500, 300)))
    clip.set_block_clipping_path(corners)
    clip.invert_clipping_path(ignore_acad_compatibility=True)
    drawing.saveas(path / "a.dxf")
    return path / "a.dxf"


def test_of_a_block_with_an_inverted_clip_the_part_outside_is_read(tmp_path: Path) -> None:
    plan, _ = imported_file(clip_of(tmp_path, [(-1, -1), (12, 9)]))
    assert size_m(plan.levels[0]) == pytest.approx((18.0, 8.0), abs=1e-3)


def test_a_binary_drawing_that_is_cut_is_refused(tmp_path: Path) -> None:
    new("R2010", units=6).saveas(tmp_path / "b.dxf", fmt="bin")
    content = (tmp_path / "b.dxf").read_bytes()
    for cut in (22, len(content) // 2, len(content) - 1):
        (tmp_path / "b.dxf").write_bytes(content[:cut])
        with pytest.raises(EchostepError, match=r"b\.dxf: "):
            imported_file(tmp_path / "b.dxf")


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


def test_walls_with_gaps_are_not_called_closed(tmp_path: Path) -> None:
    """Rooms that a gap leads to can be entered, doors or not."""
    doc = new("R2010", units=6)
    space = doc.modelspace()
    for line in ((0, 0, 12, 0), (12, 0, 12, 8), (12, 8, 0, 8), (0, 8, 0, 0), (0, 5, 2, 5), (2.9, 5, 12, 5)):
        space.add_line(line[:2], line[2:], {"layer": "A-WALL"})
    space.add_text("Kitchen", dxfattribs={"layer": "ROOM", "height": 0.3, "insert": (3, 6.5)})
    doc.saveas(tmp_path / "a.dxf")
    plan, report = imported_file(tmp_path / "a.dxf")
    said = "\n".join(summary(plan, report))
    assert "0 doors, 1 gap that people can pass, 1 room" in said
    assert "cannot be entered" not in said
    assert plan.levels[0].rooms[0].name == "Kitchen"
