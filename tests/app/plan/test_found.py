# SPDX-License-Identifier: MIT
"""What other programs really write: deleted, copied and clipped elements, other data, units and pictures, thick walls; each by its right result."""

from __future__ import annotations

import json
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ezdxf.filemanagement import new
from ezdxf.xclip import XClip

from echostep.errors import EchostepError
from echostep.plan import Plan, parse_plan
from echostep_app.plan.check import check_plan
from echostep_app.plan.georeference import EarthTransform
from echostep_app.plan.importers.formats import import_plan
from echostep_app.plan.importers.hints import Hints
from echostep_app.plan.importers.report import ImportReport
from echostep_app.plan.importers.summary import doors_in_gaps, size_m
from needs_data import data_or_skip

DEG = 1e-5  # degrees of the small houses on the Earth


def imported(path: Path, **hints: object) -> tuple[Plan, ImportReport]:
    report = ImportReport()
    return import_plan(path, Hints(**hints), report=report), report  # type: ignore[arg-type]


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


def test_words_about_tags_and_other_xml(tmp_path: Path) -> None:
    more = "".join(
        f'<way id="{k}">{REFS}<tag k="indoor" v="{v}"/></way>'
        for k, v in ((6, "no"), (7, "no"), (8, "yes"), (10, "yes"))
    )
    (tmp_path / "a.osm").write_text(osm(ROOM.format(REFS) + more))
    said = " ".join(imported(tmp_path / "a.osm")[1].doubts)
    assert "2 indoor=yes have no level" in said
    assert "indoor=no" not in said
    (tmp_path / "a.xml").write_text('<c:X xmlns:c="http://www.opengis.net/indoorgml/1.0/core"/>')
    with pytest.raises(EchostepError, match="this XML is <X>, not <osm>: IndoorGML or CityGML is not read"):
        imported(tmp_path / "a.xml")
    (tmp_path / "a.xml").write_text('<c:X xmlns:c="urn:other"/>')
    with pytest.raises(EchostepError, match=r"this XML is <X>, not <osm>: .*DXF, IFC, IMDF"):
        imported(tmp_path / "a.xml")


@pytest.fixture(scope="module")
def found() -> Path:
    return data_or_skip("small/found")


@pytest.mark.parametrize(("name", "doors"), [
    ("stacked/stacked.osm", [2, 1, 1]), ("stacked/stacked.geojson", [2, 1, 1]), ("geom/out_geom.osm", [2, 1, 1]), ("josm-deleted/josm.osm", [0]),
])  # fmt: skip
def test_doors_found(found: Path, name: str, doors: list[int]) -> None:
    assert [len(level.doors) for level in imported(found / name)[0].levels] == doors


@pytest.mark.parametrize(("name", "size", "walls"), [
    ("ros-raw/raw.yaml", (5.05, 3.55), 8), ("decimetres/plan.dxf", (20, 12), 8), ("decimetres/yards.dxf", (20, 12), 8),
    ("picture-kinds/transparent.png", (18.05, 13.05), 16), ("picture-kinds/la.png", (18.05, 13.05), 16),
    ("picture-kinds/palette_t.png", (18.05, 13.05), 16), ("picture-kinds/sixteen.png", (18.05, 13.05), 16),
    ("picture-kinds/exif6.jpg", (13.05, 18.05), 16), ("clipped-block/plan.dxf", (12, 8), 5), ("binary-dxf/plan.dxf", (20, 12), 8),
])  # fmt: skip
def test_sizes_found(found: Path, name: str, size: tuple[float, float], walls: int) -> None:
    plan, _ = imported(found / name, **({"scale_m": 0.05} if "picture" in name else {}))
    assert size_m(plan.levels[0]) == pytest.approx(size, abs=0.01)
    assert len(plan.levels[0].walls) == walls


def test_a_model_in_a_national_grid_is_the_same_house(found: Path) -> None:
    near, far = (imported(found / f"grid/{name}.ifc") for name in ("local", "site_in_utm"))
    assert size_m(far[0].levels[0]) == pytest.approx(size_m(near[0].levels[0]), abs=1e-3)
    assert len(far[0].levels[0].walls) == len(near[0].levels[0].walls)
    assert "the plan's origin is x 311988 m, y 5996148 m there" in " ".join(far[1].doubts)


@pytest.mark.parametrize("name", ["wall_24cm", "wall_30cm_at_0", "wall_30cm_at_1"])
def test_jambs_found(found: Path, name: str) -> None:
    assert not check_plan(parse_plan((found / f"jamb/{name}.json").read_bytes()))


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
    plan, _ = imported(clip_of(tmp_path, [(-1, -1), (12, 9)]))
    assert size_m(plan.levels[0]) == pytest.approx((18.0, 8.0), abs=1e-3)


def test_a_binary_drawing_that_is_cut_is_refused(tmp_path: Path) -> None:
    new("R2010", units=6).saveas(tmp_path / "b.dxf", fmt="bin")
    content = (tmp_path / "b.dxf").read_bytes()
    for cut in (22, len(content) // 2, len(content) - 1):
        (tmp_path / "b.dxf").write_bytes(content[:cut])
        with pytest.raises(EchostepError, match=r"b\.dxf: "):
            imported(tmp_path / "b.dxf")


@pytest.mark.parametrize("name", ["leaf_closed_wall", "leaf_closed_gap"])
def test_leaves_drawn_closed_found(found: Path, name: str) -> None:
    plan, report = imported(found / f"leaf/{name}.dxf")
    assert doors_in_gaps(plan.levels[0]) == 2
    assert ("2 doors lie where a wall is drawn through" in " ".join(report.doubts)) == (name == "leaf_closed_wall")


@pytest.mark.parametrize("name", ["storeys_frame", "storeys_frame_detail"])
def test_storeys_side_by_side_found(found: Path, name: str) -> None:
    assert "looks like 3 storeys beside each other" in " ".join(imported(found / f"storeys/{name}.dxf")[1].doubts)
