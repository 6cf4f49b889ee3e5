# SPDX-License-Identifier: MIT
"""Importing IMDF: folder and zip give the same plan; units, openings, stairs; what a damaged or hostile archive gets."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from echostep.errors import EchostepError
from echostep.plan import Plan
from echostep_app.plan.check import check_plan
from echostep_app.plan.importers.formats import import_plan
from echostep_app.plan.importers.report import Hints
from echostep_app.plan.importers.summary import summary
from plan.imported_plans import imported_file

LON, LAT = -2.978, 56.46
EAST, NORTH = 1 / 61_650.0, 1 / 111_360.0  # degrees a metre there


def at(x: float, y: float) -> list[float]:
    return [LON + x * EAST, LAT + y * NORTH]


def box(x0: float, y0: float, x1: float, y1: float) -> dict[str, Any]:
    return {"type": "Polygon", "coordinates": [[at(x0, y0), at(x1, y0), at(x1, y1), at(x0, y1), at(x0, y0)]]}


def line(x0: float, y0: float, x1: float, y1: float) -> dict[str, Any]:
    return {"type": "LineString", "coordinates": [at(x0, y0), at(x1, y1)]}


def feature(kind: str, key: str, geometry: Any, **about: Any) -> dict[str, Any]:
    return {"type": "Feature", "id": key, "feature_type": kind, "geometry": geometry, "properties": about}


def storey(i: int) -> dict[str, list[dict[str, Any]]]:
    """Hall of 10 m by 8 m with a shop, stairs, a lift and a pillar."""
    on = {"level_id": f"L{i}"}
    return {
        "level": [feature("level", f"L{i}", box(0, 0, 10, 8), ordinal=i, name={"en": f"Floor {i}"})],
        "unit": [
            feature("unit", f"hall{i}", box(0, 0, 10, 5), category="walkway", **on),
            feature("unit", f"shop{i}", box(0, 5, 5, 8), category="room", name={"en": "Shop", "de": "Laden"}, **on),
            feature("unit", f"lift{i}", box(5, 5, 7, 8), category="elevator", **on),
            feature("unit", f"stairs{i}", box(7, 5, 10, 8), category="stairs", **on),
            feature("unit", f"pillar{i}", box(4, 2, 4.5, 2.5), category="column", **on),
        ],
        "opening": [
            feature("opening", f"o{i}", line(2, 5, 3, 5), category="pedestrian", door={"type": "swinging"}, **on),
            feature("opening", f"p{i}", line(5.5, 5, 6.5, 5), category="pedestrian", **on),
        ],
        "fixture": [feature("fixture", f"f{i}", box(8, 1, 9, 2), category="desk", **on)],
    }


def files(levels: int = 2) -> dict[str, Any]:
    rows = [storey(i) for i in range(levels)]
    found = {
        f"{kind}.geojson": {"type": "FeatureCollection", "features": [f for row in rows for f in row[kind]]}
        for kind in rows[0]
    }
    venue = feature("venue", "V", box(0, 0, 10, 8), name={"en": "Mall"})
    return {
        "manifest.json": {"version": "1.0.0"},
        "venue.geojson": {"type": "FeatureCollection", "features": [venue]},
        **found,
    }


def folder(path: Path, tree: dict[str, Any]) -> Path:
    path.mkdir(exist_ok=True)
    for name, content in tree.items():
        (path / name).write_text(content if isinstance(content, str) else json.dumps(content))
    return path


def zipped(path: Path, tree: dict[str, Any]) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        for name, content in tree.items():
            file.writestr(f"venue/{name}", content if isinstance(content, str) else json.dumps(content))
    return path


@pytest.fixture
def mall(tmp_path: Path) -> Plan:
    return import_plan(folder(tmp_path / "mall", files()))


def test_what_becomes_of_a_mall(mall: Plan) -> None:
    assert (mall.name, [(level.name, level.height_m) for level in mall.levels]) == (
        "Mall",
        [("Floor 0", 0.0), ("Floor 1", 3.5)],
    )
    ground = mall.levels[0]
    assert [room.name for room in ground.rooms] == ["Shop"]
    assert [(door.state, round(door.width_m, 2)) for door in ground.doors] == [("unknown", 1.0), ("open", 1.0)]
    assert len(ground.obstacles) == 1
    length = np.hypot(*(ground.walls[:, 2:] - ground.walls[:, :2]).T).sum()
    assert length == pytest.approx(36 + 5 + 3 + 2 + 3 - 2 + 2, abs=0.2)  # outside, shop, lift, doors, pillar
    assert {(c.kind, c.levels) for c in mall.connectors} == {("stairs", (0, 1)), ("lift", (0, 1))}
    assert [finding.kind for finding in check_plan(mall)] == ["no exit"]


def test_a_relationship_joins_stairs_apart(tmp_path: Path) -> None:
    tree = files()
    tree["unit.geojson"]["features"][8]["geometry"] = box(0, 0, 1, 1)
    ends = {
        "origin": {"id": "stairs0", "feature_type": "unit"},
        "destination": {"id": "stairs1", "feature_type": "unit"},
    }
    relation = feature("relationship", "r", None, category="stairs", direction="undirected", **ends)
    plan = import_plan(folder(tmp_path / "a", tree))
    assert [c.kind for c in plan.connectors] == ["lift"]
    tree["relationship.geojson"] = {"type": "FeatureCollection", "features": [relation]}
    plan = import_plan(folder(tmp_path / "b", tree))
    assert sorted(c.kind for c in plan.connectors) == ["lift", "stairs", "stairs"]
    relation["properties"] |= {"intermediary": 3, "origin": [], "destination": {"id": {}}}
    assert len(import_plan(folder(tmp_path / "c", tree)).connectors) == 1


def without_openings(rooms: int = 8) -> dict[str, Any]:
    """One level: a corridor of 40 m, rooms of 5 m on one side, and a store behind the first room that only this room touches."""
    on = {"level_id": "L0"}
    units = [feature("unit", "way", box(0, 0, 5 * rooms, 2), category="walkway", **on)]
    units += [
        feature("unit", f"u{k}", box(5 * k, 2, 5 * k + 5, 6), category="office", name={"en": f"R{k}"}, **on)
        for k in range(rooms)
    ]
    units.append(feature("unit", "store", box(0, 6, 4, 9), category="storage", name={"en": "Store"}, **on))
    tree = files(1)
    tree["level.geojson"]["features"] = [feature("level", "L0", box(0, 0, 5 * rooms, 9), ordinal=0, name={"en": "G"})]
    tree["unit.geojson"]["features"] = units
    tree["opening.geojson"]["features"] = tree["fixture.geojson"]["features"] = []
    return tree


def test_files_may_end_in_json(mall: Plan, tmp_path: Path) -> None:
    renamed = {name.replace(".geojson", ".json"): content for name, content in files().items()}
    assert import_plan(folder(tmp_path / "a", renamed)).digest == mall.digest
    assert import_plan(zipped(tmp_path / "mall.zip", renamed)).digest == mall.digest
    renamed["level.json"]["features"] = []
    with pytest.raises(EchostepError, match=r"level\.json: it has no levels"):
        import_plan(folder(tmp_path / "c", renamed))


def test_assumed_doors_reach_every_room(tmp_path: Path) -> None:
    plan = import_plan(folder(tmp_path / "a", without_openings()), Hints(doors_m=0.9))
    doors = plan.levels[0].doors
    assert [(door.name, round(door.width_m, 3), door.state) for door in doors] == [("assumed", 0.9, "unknown")] * 9
    assert all(door.line[1] == door.line[3] == pytest.approx(2.0, abs=0.01) for door in doors[:8])  # on the corridor
    assert doors[8].line[1] == pytest.approx(6.0, abs=0.01)  # the store's, to the room beside it
    assert [finding.kind for finding in check_plan(plan)] == ["sealed"]  # what is no unit


def test_assumed_doors_pass_walls_drawn_with_a_thickness(tmp_path: Path) -> None:
    """Rooms 0.2 m apart have a wall each: a door in both."""
    tree = without_openings(1)
    tree["unit.geojson"]["features"][2] = feature(
        "unit", "store", box(0, 6.2, 4, 9), category="storage", name={"en": "Store"}, level_id="L0"
    )
    plan = import_plan(folder(tmp_path / "a", tree), Hints(doors_m=0.8))
    assert sorted(round(door.line[1], 1) for door in plan.levels[0].doors) == [2.0, 6.0, 6.2]
    assert [finding.kind for finding in check_plan(plan)] == []


def test_an_opening_passes_both_faces_of_a_wall(tmp_path: Path) -> None:
    tree = files(1)
    hall, shop, *_ = tree["unit.geojson"]["features"]
    hall["properties"]["category"], shop["geometry"] = "room", box(0, 5.15, 5, 8)
    plan = import_plan(folder(tmp_path / "a", tree))
    assert sorted(round(door.line[1], 2) for door in plan.levels[0].doors) == [5.0, 5.0, 5.15]
    assert check_plan(plan) == []


def test_an_opening_drawn_as_a_point_gets_the_width(tmp_path: Path) -> None:
    tree = without_openings(2)
    opening = feature(
        "opening", "o", {"type": "Point", "coordinates": at(1.5, 2.0)}, category="pedestrian", level_id="L0"
    )
    tree["opening.geojson"]["features"] = [opening]
    plan = import_plan(folder(tmp_path / "a", tree), Hints(doors_m=0.9))
    assert plan.levels[0].doors[0].line == pytest.approx((1.05, 2.0, 1.95, 2.0), abs=0.01)
    assert len(plan.levels[0].doors) == 3  # and one each of the other room and the store


def test_doors_that_are_drawn_stay_as_they_are(mall: Plan, tmp_path: Path) -> None:
    assert import_plan(folder(tmp_path / "a", files()), Hints(doors_m=0.9)).levels[0].doors == mall.levels[0].doors


def test_the_import_says_that_there_are_no_doors(tmp_path: Path) -> None:
    said = []
    for doors_m in (None, 0.9):
        said.append("\n".join(summary(*imported_file(folder(tmp_path / "a", without_openings()), doors_m=doors_m))))
    assert "has no door openings, so its rooms cannot be entered: --doors 0.9" in said[0]
    assert "9 doors are assumed" in said[1]
    assert "no door openings" not in said[1]
