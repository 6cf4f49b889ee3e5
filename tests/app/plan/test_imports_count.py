# SPDX-License-Identifier: MIT
"""What goes into an import against what comes out: each element of each kind of a format is a part of the plan, or counted as left out.

Drawings: test_layers_of_drawings.py.
"""

from __future__ import annotations

import json
from pathlib import Path

from echostep.plan import Plan
from plan import test_plan_importer_imdf as imdf
from plan import test_plan_importer_osm as osm
from plan.imported_plans import imported_file


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
    plan, report = imported_file(imdf.folder(tmp_path / "venue", tree))
    assert report.left_out == dict.fromkeys(others, 1) | {
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
    plan, report = imported_file(tmp_path / "house.json")
    assert report.left_out == {
        "node that is no door, stairs or lift": 1, "door on no wall": 1, "lift on one level only": 1,
        "way that is no wall, room, corridor or stairs": 2, "room without level": 1, "relation that is no multipolygon": 1,
    }  # fmt: skip
    assert sizes(plan) == {"doors": 3, "windows": 1, "rooms": 4, "obstacles": 0, "connectors": 2}
