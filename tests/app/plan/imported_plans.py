# SPDX-License-Identifier: MIT
"""Plans of other programs for tests: a building of seven floors as WRLD exports it, with outlines, windows, obstacles and a georeference."""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from echostep.plan import Plan, Pose
from echostep_app.plan.importers.formats import import_plan
from echostep_app.plan.writer import plan_json

LON, LAT = 8.85, 53.11
EAST, NORTH = 1 / 66_945.0, 1 / 111_300.0  # degrees a metre there
FLOORS = ("Basement", "Ground floor", "First floor", "Second floor", "Third floor", "Fourth floor", "Attic")
HALF_M = 0.1  # half the thickness of a wall

Box = tuple[float, float, float, float]


def feature(kind: str, box: Box, name: str = "") -> dict[str, Any]:
    """An area of a WRLD level, a box x0, y0, x1, y1 in metres."""
    x0, y0, x1, y1 = box
    ring = [(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)]
    corners = [[LON + x * EAST, LAT + y * NORTH] for x, y in ring]
    about = {"type": kind} | ({"name": name} if name else {})
    return {"type": "Feature", "properties": about, "geometry": {"type": "Polygon", "coordinates": [corners]}}


def across(y: float, x0: float, x1: float, doors: tuple[float, ...] = ()) -> list[dict[str, Any]]:
    """A wall from west to east, with doors of 1 m about these x."""
    ends = [x0 - HALF_M, *(x + side for x in doors for side in (-0.5, 0.5)), x1 + HALF_M]
    walls = [feature("wall", (a, y - HALF_M, b, y + HALF_M)) for a, b in zip(ends[::2], ends[1::2], strict=True)]
    return [*walls, *(feature("door", (x - 0.5, y - HALF_M, x + 0.5, y + HALF_M)) for x in doors)]


def along(x: float, y0: float, y1: float) -> list[dict[str, Any]]:
    """A wall from south to north."""
    return [feature("wall", (x - HALF_M, y0 - HALF_M, x + HALF_M, y1 + HALF_M))]


def floor(number: int) -> list[dict[str, Any]]:
    """24 m by 14 m: a corridor with two rooms to the north and two to the south, stairs and a lift in the east, an entrance in the west."""
    entrance = (8.0,) if number == 1 else ()
    return [
        *across(0, 0, 24), *across(6, 0, 24, (4.0, 12.0)), *across(8, 0, 24, (4.0, 12.0, 18.0, 22.0)), *across(14, 0, 2), *across(14, 6, 24),
        *along(0, 0, 14), *along(24, 0, 14), *along(8, 0, 6), *along(8, 8, 14), *along(16, 8, 14), *along(20, 8, 14), *along(16, 0, 6),
        feature("room", (0.1, 8.1, 7.9, 13.9), f"Office {number}01"), feature("room", (8.1, 8.1, 15.9, 13.9), f"Meeting {number}02"),
        feature("room", (0.1, 0.1, 7.9, 5.9), "Kitchen"), feature("room", (8.1, 0.1, 15.9, 5.9), f"Store {number}04"),
        feature("hallway", (0.1, 6.1, 23.9, 7.9), "Corridor"),
        feature("window", (2.1, 13.9, 5.9, 14.1)),
        feature("stairs", (16.1, 8.6, 19.9, 13.9), "Stairs A"), feature("elevator", (20.1, 8.6, 23.9, 13.9), "Lift"),
        *(feature("door", (-0.1, 6.5, 0.1, 7.5)) for _ in entrance),
    ]  # fmt: skip


def write_seven_floors(folder: Path) -> Path:
    """The building as files; returns its main.json."""
    folder.mkdir(parents=True, exist_ok=True)
    levels = []
    for k, name in enumerate(FLOORS):
        levels.append({"readable_name": name, "z_order": k - 1, "filename": f"floor{k}.geojson"})
        tree = {"type": "FeatureCollection", "features": floor(k)}
        (folder / f"floor{k}.geojson").write_text(json.dumps(tree))
    main = {"name": "Seven floors", "location": {"coordinates": [LON, LAT]}, "levels": levels}
    (folder / "main.json").write_text(json.dumps(main))
    return folder / "main.json"


@cache
def seven_floors() -> Plan:
    """The building of seven floors, imported; then each meeting room got a table, which WRLD does not know, and the plan a start."""
    with TemporaryDirectory() as folder:
        plan = import_plan(write_seven_floors(Path(folder)))
    table = np.array([[11.0, 10.0], [13.0, 10.0], [13.0, 11.5], [11.0, 11.5]])
    levels = tuple(replace(level, obstacles=(table,)) for level in plan.levels)
    plan = replace(plan, levels=levels, start=Pose(1.0, 7.0, 0.0, 1))
    return replace(plan, digest=hashlib.sha256(plan_json(plan).encode()).hexdigest())
