# SPDX-License-Identifier: MIT
"""The small inputs of ../shared/data/small that concern plans and scores: the right result of each. Their kinds are tested in their own files."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import command_line
from echostep.errors import EchostepError
from echostep.plan import Plan
from echostep_app.plan.importers.formats import import_plan
from echostep_app.plan.importers.hints import Hints
from echostep_app.plan.importers.report import ImportReport
from echostep_app.plan.importers.summary import size_m
from needs_data import data_or_skip


@pytest.fixture(scope="module")
def files() -> Path:
    return data_or_skip("small/files")


def imported(path: Path, **hints: object) -> tuple[Plan, ImportReport]:
    report = ImportReport()
    return import_plan(path, Hints(**hints), report=report), report  # type: ignore[arg-type]


@pytest.mark.parametrize(("name", "line"), [
    ("dxf-door-swing-as-bulge/house.dxf", (4.05, 3.0, 4.05, 3.9)),
    ("dxf-door-swing-as-bulge/as_polyline.dxf", (4.05, 3.0, 4.05, 3.9)),
    ("dxf-door-arc-on-another-layer/house.dxf", (4.05, 3.0, 4.05, 3.9)),
    ("dxf-double-door-loose-arcs/house.dxf", (4.05, 3.0, 4.05, 4.8)),
    ("dxf-door-beside-window/house.dxf", (2.0, 0.15, 2.8, 0.15)),
    ("dxf-some-wall-layers-not-recognised/house.dxf", (4.05, 3.0, 4.05, 3.9)),
    ("ifc-door-drawn-open/house.ifc", (4.1, 3.0, 4.1, 5.0)),
    ("ifc-doors-without-shape/house.ifc", (4.1, 3.0, 4.1, 5.0)),
])  # fmt: skip
def test_doors(files: Path, name: str, line: tuple[float, ...]) -> None:
    plan, _ = imported(files / name)
    assert [sorted((door.line[:2], door.line[2:])) for door in plan.levels[0].doors] == [sorted((line[:2], line[2:]))]


@pytest.mark.parametrize("name", [
    "dxf-hatch-on-wall-layer/house.dxf",
    "dxf-hidden-layer/house.dxf",
    "dxf-hidden-layer/off.dxf",
    "dxf-room-outlines/house.dxf",
])  # fmt: skip
def test_walls(files: Path, name: str) -> None:
    plan, report = imported(files / name)
    assert len(plan.levels[0].walls) == 14
    assert bool(report.left_out) == ("hidden" in name)


@pytest.mark.parametrize(("folder", "unit"), [("dxf-units-metres-called-mm", "m"), ("dxf-units-cm-called-mm", "cm")])
def test_wrong_units(files: Path, folder: str, unit: str) -> None:
    with pytest.raises(EchostepError, match=f"--units {unit} "):
        imported(files / folder / "house.dxf")
    plan, _ = imported(files / folder / "house.dxf", units=unit)
    assert size_m(plan.levels[0]) == pytest.approx((10, 8))
    assert len(plan.levels[0].walls) == 14


def test_units_that_differ_between_storeys(files: Path) -> None:
    folder = files / "dxf-units-differ-between-storeys"
    with pytest.raises(EchostepError, match=r"first.dxf: its units \(in\).*do not lie over each other: give --units"):
        import_plan(folder / "ground.dxf", Hints(), [folder / "first.dxf"])


def test_a_multiline_is_both_faces_of_a_wall(files: Path) -> None:
    plan, _ = imported(files / "dxf-walls-as-mline" / "house.dxf")
    faces = [w for w in plan.levels[0].walls.tolist() if w[0] == w[2] and 3.5 < w[0] < 4.5]
    assert len({w[0] for w in faces}) == 2
    assert {y for w in faces for y in (w[1], w[3])} == {0.3, 3.0, 3.9, 7.7}


def test_outlines_of_rooms(files: Path) -> None:
    plan, _ = imported(files / "dxf-room-outlines" / "house.dxf", layers={"rooms": ["Meeting rooms"]})
    assert [room.outline_m is not None for room in plan.levels[0].rooms] == [True, True]


def test_a_reference_that_is_not_bound(files: Path) -> None:
    with pytest.raises(EchostepError, match=r"only refers to floor-1.dwg \(external reference\): bind it"):
        imported(files / "dxf-xref-not-bound" / "sheet.dxf")


def test_storeys_of_models(files: Path) -> None:
    plan, _ = imported(files / "ifc-storey-long-name" / "house.ifc")
    assert [level.name for level in plan.levels] == ["Ground floor"]
    plan, report = imported(files / "ifc-reference-levels" / "house.ifc")
    assert [level.height_m for level in plan.levels] == [0.0, 2.9]
    assert "reference levels" in report.doubts[0]


def test_formats(files: Path) -> None:
    """Read: a packed model, a map of ROS, GeoJSON of overpass-turbo, IMDF without a manifest. Others name the next step."""
    for name in (
        "refused-formats/house.ifczip",
        "refused-formats/map.yaml",
        "osm-geojson-export/export.geojson",
        "imdf-folder-without-manifest",
    ):
        assert len(imported(files / name)[0].levels[0].walls)
    for name, step in (
        ("plan.dwg", "DWG: save it as DXF"),
        ("plan.svg", "plan edit PLAN --picture FILE"),
        ("map.pgm", "map.yaml"),
    ):
        with pytest.raises(EchostepError, match=step):
            imported(files / "refused-formats" / name)


@pytest.mark.process
def test_pictures(files: Path, tmp_path: Path, recwarn: pytest.WarningsRecorder) -> None:
    done = command_line.echostep("plan", "show", files / "cjk-names" / "plan.json", "-o", tmp_path / "x.png")
    assert done.returncode == 0
    assert len(done.stdout.splitlines()) <= 1
    assert not done.stderr
    assert not [warning for warning in recwarn if "Glyph" in str(warning.message)]


@pytest.mark.process
@pytest.mark.parametrize(
    ("track", "truth"),
    [("score-nanoseconds/track.csv", "score-nanoseconds/truth.csv"), ("score-tum/track.txt", "score-tum/truth.txt")],
)
def test_scores(files: Path, track: str, truth: str) -> None:
    done = command_line.echostep("score", files / track, "--truth", files / truth, "--json")
    card = json.loads(done.stdout)["tracks"][0]
    text = json.dumps(card)
    assert done.returncode == 0
    assert np.isclose(_value(card, "availability"), 1.0), text
    assert np.isclose(_value(card, "mean_m"), 0.05, atol=0.001), text


def _value(tree: object, name: str) -> float:
    """The first value of this name in nested objects."""
    stack = [tree]
    while stack:
        node = stack.pop(0)
        if isinstance(node, dict):
            if isinstance(node.get(name), int | float):
                return float(node[name])
            stack += node.values()
    raise AssertionError(f"no {name} in {tree}")
