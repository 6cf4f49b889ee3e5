# SPDX-License-Identifier: MIT
"""What goes into an import against what comes out: each element of each kind of a format is a part of the plan, or counted as left out.

Drawings: test_layers_of_drawings.py.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from echostep.plan import Plan
from echostep_app.plan.importers.formats import import_plan
from echostep_app.plan.importers.hints import Hints
from echostep_app.plan.importers.report import ImportReport
from plan import test_plan_importer_imdf as imdf
from plan import test_plan_importer_osm as osm
from plan import test_plan_importer_wrld as wrld
from plan.test_plan_importer_nodelink import SMALL
from plan.test_plan_importer_nodelink import write as write_nodelink


def counted(path: Path, **hints: Any) -> tuple[Plan, dict[str, int]]:
    report = ImportReport()
    return import_plan(path, Hints(**hints), report=report), report.left_out


def sizes(plan: Plan) -> dict[str, int]:
    """Doors, windows, rooms, obstacles of all levels, and connectors."""
    levels = plan.levels
    return {
        "doors": sum(len(level.doors) for level in levels),
        "windows": sum(len(level.windows) for level in levels),
        "rooms": sum(len(level.rooms) for level in levels),
        "obstacles": sum(len(level.obstacles) for level in levels),
        "connectors": len(plan.connectors),
    }


def test_kinds_of_imdf(tmp_path: Path) -> None:
    """All 16 kinds of features of IMDF 1.0: two storeys of a mall, one of each other kind, and what has no area."""
    tree, on = imdf.files(), {"level_id": "L0"}
    point = {"type": "Point", "coordinates": imdf.at(3, 3)}
    others = ("address", "amenity", "anchor", "building", "detail", "footprint", "geofence", "occupant", "section")
    for kind in others:
        tree[f"{kind}.geojson"] = {
            "type": "FeatureCollection",
            "features": [imdf.feature(kind, f"{kind}0", point, **on)],
        }
    kiosks = [
        imdf.feature("kiosk", "k0", imdf.box(8.2, 3, 8.8, 3.6), **on),
        imdf.feature("kiosk", "k1", point, **on),
    ]
    tree["kiosk.geojson"] = {"type": "FeatureCollection", "features": kiosks}
    tree["fixture.geojson"]["features"].append(
        imdf.feature("fixture", "f9", imdf.box(8, 3, 9, 4), category="rug", **on)
    )
    tree["unit.geojson"]["features"].append(imdf.feature("unit", "u9", point, category="room", **on))
    tree["opening.geojson"]["features"].append(imdf.feature("opening", "o9", point, category="pedestrian", **on))
    joins = [
        imdf.feature("relationship", f"r{k}", None, category=kind) for k, kind in enumerate(("stairs", "traversal"))
    ]
    tree["relationship.geojson"] = {"type": "FeatureCollection", "features": joins}
    plan, left_out = counted(imdf.folder(tmp_path / "venue", tree))
    assert left_out == dict.fromkeys(others, 1) | {
        "fixture rug": 1, "fixture or kiosk without an area": 1, "unit without an area": 1, "relationship traversal": 1,
        "opening without a width (--doors 0.9 gives one)": 1,
    }  # fmt: skip
    assert sizes(plan) == {"doors": 4, "windows": 0, "rooms": 2, "obstacles": 3, "connectors": 2}


def test_kinds_of_openstreetmap(tmp_path: Path) -> None:
    """Nodes, ways and relations: those of the house, and one more of each kind that a plan does not have."""
    elements = [
        *osm.HOUSE,
        osm.node(30, 1, 1, amenity="bench", level="0"),
        osm.node(31, 1, 2, door="yes", level="0"),  # on no wall
        osm.node(32, 2, 1, highway="elevator", level="0"),  # ends there
        osm.way(40, [1, 2], highway="footway"),
        osm.way(41, [9, 10], indoor="furniture", level="0"),
        osm.way(42, [9, 10, 12, 9], indoor="room", name="Lost"),
        osm.way(43, [9, 10, 12, 9], indoor="column", level="0"),
        osm.way(44, [9, 12], indoor="wall", material="glass", level="1"),
        {"type": "relation", "id": 50, "members": [], "tags": {"type": "site"}},
    ]
    (tmp_path / "house.json").write_text(json.dumps({"elements": elements}))
    plan, left_out = counted(tmp_path / "house.json")
    assert left_out == {
        "node that is no door, stairs or lift": 1, "door on no wall": 1, "lift on one level only": 1,
        "way that is no wall, room, corridor or stairs": 2, "room without level": 1, "relation that is no multipolygon": 1,
    }  # fmt: skip
    assert sizes(plan) == {"doors": 3, "windows": 1, "rooms": 4, "obstacles": 0, "connectors": 2}


def test_kinds_of_wrld(tmp_path: Path) -> None:
    """Each type that westport-house has, and one that nobody knows."""

    def square(k: int) -> list[list[list[float]]]:
        x, y, d = -3.0 + 1e-4 * k, 56.0, 5e-5
        return [[[x, y], [x + d, y], [x + d, y + d], [x, y + d], [x, y]]]

    taken = ("wall", "window", "door", "inaccessible_space", "floor_opening", "room", "bathroom", "hallway")
    alone = ("stairs", "elevator", "escalator", "ramp")
    left = ("building_outline", "landscaping", "table", "no_geometry", "pathway")
    features = [wrld.feature(kind, square(k)) for k, kind in enumerate((*taken, *alone, *left))]
    line = {
        "type": "Feature",
        "properties": {"type": "wall"},
        "geometry": {"type": "LineString", "coordinates": [[-3, 56], [-3, 56.0001]]},
    }
    plan, left_out = counted(wrld.write(tmp_path, [*features, line]))
    assert left_out == dict.fromkeys(left, 1) | {
        "wall": 1, "stairs on one level only": 2, "lift on one level only": 1, "ramp on one level only": 1,
    }  # fmt: skip
    assert sizes(plan) == {"doors": 1, "windows": 4, "rooms": 3, "obstacles": 0, "connectors": 0}
    assert len(plan.levels[0].walls) == 3 * 4  # wall, inaccessible space, opening in the floor


def test_kinds_of_nodes_and_links(tmp_path: Path) -> None:
    links = SMALL["link.txt"] + "10,0,4,4\n"
    zones = SMALL["polygon.txt"] + "6,0,3,1,2,3\n"
    arrows = SMALL["arrow.txt"] + "1,1,0,0\n"
    plan, left_out = counted(write_nodelink(tmp_path, link=links, polygon=zones, arrow=arrows))
    assert left_out == {"link without length": 1, "zone of type 0": 1, "arrow in no zone of stairs": 1}
    assert sum(len(level.walls) for level in plan.levels) == 2  # links 7 and 9 are one wall
    assert len(plan.connectors) == 1
