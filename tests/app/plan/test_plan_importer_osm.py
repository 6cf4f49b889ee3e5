# SPDX-License-Identifier: MIT
"""Importing OpenStreetMap indoor data: what becomes of a house, levels, tags, GeoJSON (all kinds of files: habits)."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from echostep.plan import Plan
from echostep_app.plan.check import check_plan
from echostep_app.plan.importers.formats import import_plan, is_foreign
from echostep_app.plan.importers.osm.elements import levels_of
from plan.habits import osm_house
from plan.habits.house import Move
from plan.imported_plans import imported_file

LON, LAT = 8.85, 53.11
EAST, NORTH = 1 / 66_945.0, 1 / 111_300.0  # degrees a metre there


def node(key: int, x: float, y: float, **tags: str) -> dict[str, Any]:
    return {"type": "node", "id": key, "lon": LON + x * EAST, "lat": LAT + y * NORTH, "tags": tags}


def way(key: int, nodes: list[int], **tags: str) -> dict[str, Any]:
    return {"type": "way", "id": key, "nodes": nodes, "tags": {k.replace("__", ":"): v for k, v in tags.items()}}


HOUSE = [
    node(1, 0, 0), node(2, 10, 0), node(3, 10, 8), node(4, 0, 8),
    node(5, 6, 0), node(6, 6, 8), node(7, 6, 4, door="yes", width="120 cm"), node(8, 0, 4, entrance="main", level="0"),
    node(9, 2, 2), node(10, 4, 2), node(11, 8, 6, highway="elevator", level="0;1"), node(12, 6, 3),
    way(20, [1, 5, 2, 3, 6, 4, 8, 1], building="yes", name="House"),
    way(21, [5, 2, 3, 6, 7, 12, 5], indoor="room", level="0-1", name="Hall"),
    way(22, [1, 5, 12, 7, 6, 4, 8, 1], indoor="corridor", level="0;1", name="Corridor"),
    way(23, [9, 10], highway="steps", level="0;1", width="2,0"),
]  # fmt: skip


def imported(folder: Path, elements: Any) -> Plan:
    (folder / "house.json").write_text(json.dumps({"version": 0.6, "elements": elements}))
    return import_plan(folder / "house.json")


def test_what_becomes_of_a_house(tmp_path: Path) -> None:
    plan = imported(tmp_path, HOUSE)
    ground, upper = plan.levels
    assert [room.name for room in ground.rooms] == ["Hall", "Corridor"]
    length = np.hypot(*(ground.walls[:, 2:] - ground.walls[:, :2]).T).sum()
    assert length == pytest.approx(36 + 8 - 1.2 - 0.9, abs=0.1)
    assert len(ground.walls) == 7
    assert sorted(door.width_m for door in ground.doors) == [pytest.approx(0.9, abs=0.01), pytest.approx(1.2, abs=0.01)]
    assert len(upper.doors) == 1
    assert ([door.name for door in ground.doors if door.name], len(plan.exits)) == (["main entrance"], 1)
    assert {(c.kind, c.levels) for c in plan.connectors} == {("stairs", (0, 1)), ("lift", (0, 1))}
    stairs = next(c for c in plan.connectors if c.kind == "stairs")
    assert np.ptp(stairs.outline_m, axis=0) == pytest.approx([2, 2], abs=0.02)
    assert check_plan(plan) == []
    assert plan.georeference is not None
    assert plan.georeference.latitude_deg == pytest.approx(LAT, abs=1e-4)


def test_an_entrance_without_level_is_on_the_ground(tmp_path: Path) -> None:
    house = [one | {"tags": {"entrance": "staircase"}} if one["id"] == 7 else one for one in HOUSE]
    assert [len(level.doors) for level in imported(tmp_path, house).levels] == [2, 0]


def test_multipolygons_glass_and_locked_doors(tmp_path: Path) -> None:
    members = [{"type": "way", "ref": 30, "role": "outer"}]
    tags = {"type": "multipolygon", "indoor": "room", "level": "2"}
    more = [
        way(30, [1, 5, 12, 7, 6, 4, 8, 1]),
        {"type": "relation", "id": 40, "members": members, "tags": tags},
        node(13, 3, 5, door="hinged", locked="yes"), node(14, 3, 7), node(15, 3, 3),
        way(31, [14, 13, 15], indoor="wall", level="0", material="glass"),
    ]  # fmt: skip
    plan = imported(tmp_path, [*HOUSE, *more])
    assert [level.name for level in plan.levels] == ["level 0", "level 1", "level 2"]
    assert len(plan.levels[0].windows) == 2
    assert [door.state for door in plan.levels[0].doors].count("closed") == 1


@pytest.mark.parametrize(("tags", "levels"), [
    ({"level": "0"}, [0]),
    ({"level": "1;0"}, [0, 1]),
    ({"level": "-2--1"}, [-2, -1]),
    ({"level": "\u22122"}, [-2]),
    ({"level": "-1-1"}, [-1, 0, 1]),
    ({"level": "0.5"}, [0.5]),
    ({"level": "0", "repeat_on": "2-3"}, [0, 2, 3]),
    ({"level": "ground"}, []),
    ({"level": "nan;1e9"}, []),
    ({}, []),
])  # fmt: skip
def test_levels(tags: dict[str, str], levels: list[float]) -> None:
    assert levels_of(tags) == levels


def geojson(*shapes: tuple[str, Any, dict[str, str]]) -> str:
    features = [
        {"type": "Feature", "properties": {"@id": f"way/{k}"} | tags, "geometry": {"type": kind, "coordinates": at}}
        for k, (kind, at, tags) in enumerate(shapes)
    ]
    return json.dumps({"type": "FeatureCollection", "generator": "overpass-turbo", "features": features})


RING = [[8.0, 50.0], [8.0001, 50.0], [8.0001, 50.0001], [8.0, 50.0001], [8.0, 50.0]]
ROOM = {"indoor": "room", "level": "0", "name": "Room 1"}


@pytest.mark.parametrize("name", ["export.geojson", "export.json"])
def test_geojson_of_overpass_turbo(tmp_path: Path, name: str) -> None:
    """A door's point lies on the wall that has a corner there; polygons with holes, several polygons, lines."""
    hole = [[8.00002, 50.00002], [8.00004, 50.00002], [8.00004, 50.00004], [8.00002, 50.00002]]
    (tmp_path / name).write_text(
        geojson(
            ("Polygon", [RING, hole], ROOM),
            ("Point", [8.0001, 50.0], {"door": "yes", "level": "0"}),
            ("Point", [8.00005, 50.00005], {"door": "yes", "level": "0"}),
            ("LineString", [[8.0001, 50.0], [8.0002, 50.0]], {"indoor": "wall", "level": "0"}),
            ("MultiPolygon", [[RING[:-1]]], {"indoor": "room", "level": "1", "name": "Room 2"}),
        )
    )
    assert is_foreign(tmp_path / name)
    plan, report = imported_file(tmp_path / name)
    assert [[room.name for room in level.rooms] for level in plan.levels] == [["Room 1"], ["Room 2"]]
    assert len(plan.levels[0].doors) == 1
    assert report.left_out == {"door on no wall": 1}
    assert plan.georeference is not None
    assert len(plan.levels[0].walls) == 4 + 3 + 1  # outline, hole, the wall beside


ROOFS = [({"building": kind}, None) for kind in ("roof", "carport", "canopy")]  # without walls, so without doors


@pytest.mark.parametrize("kind", ["osm", "geojson"])
@pytest.mark.parametrize(("tags", "level"), [({}, 0), ({"min_level": "1"}, 1), ({"max_level": "-1"}, -1), *ROOFS])
def test_an_outlines_door_is_on_the_ground(tmp_path: Path, kind: str, tags: dict[str, str], level: int | None) -> None:
    corners = [(0, 0), (9, 0), (9, 9), (-1, -1), (4, -1), (10, -1), (10, 10), (-1, 10)]
    rows = [node(k, x, y, **({"entrance": "main"} if k == 5 else {})) for k, (x, y) in enumerate(corners, 1)]
    tags = {"building": "yes"} | tags
    rows += [way(20, [1, 2, 3, 1], indoor="room", level="-1-2"), way(21, [4, 5, 6, 7, 8, 4], **tags)]
    plan, report = imported_file(osm_house.write(tmp_path, kind, rows, Move()))
    assert [one.name for one in plan.levels if one.doors] == [f"level {level}"] * (level is not None)
    assert ("on the ground (node" in report.doubts[0]) == (level is not None)
    rows.append(way(22, [1, 5, 2, 1], indoor="room", level="2"))
    doors = [one.doors for one in import_plan(osm_house.write(tmp_path, kind, rows, Move())).levels]
    assert [len(on) for on in doors] == [0, 0, 0, 1]
