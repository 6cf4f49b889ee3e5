# SPDX-License-Identifier: MIT
"""A building of seven floors as importers make plans, for tests: walls with a thickness, outlines, windows, obstacles and a georeference."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from shapely.geometry import Polygon
from shapely.geometry import box as area

from echostep.plan import Door, Georeference, Plan, Pose
from echostep_app.plan.importers.connector_shapes import plan_of
from echostep_app.plan.importers.drawn_level import ConnectorShape, DrawnLevel, room
from echostep_app.plan.importers.formats import import_plan
from echostep_app.plan.importers.report import Hints, ImportReport
from echostep_app.plan.writer import plan_json

LON, LAT = 8.85, 53.11
STOREY_M = 3.5
FLOORS = ("Basement", "Ground floor", "First floor", "Second floor", "Third floor", "Fourth floor", "Attic")
HALF_M = 0.1  # half the thickness of a wall


def imported_file(path: Path, above: Sequence[Path] = (), **hints: Any) -> tuple[Plan, ImportReport]:
    """The plan of a file, `above` being those of the higher levels, and what is told of it."""
    report = ImportReport()
    return import_plan(path, Hints(**hints), above, report), report


def across(y: float, x0: float, x1: float, doors: tuple[float, ...] = ()) -> list[Polygon]:
    """A wall from west to east, cut for doors of 1 m about these x."""
    ends = [x0 - HALF_M, *(x + side for x in doors for side in (-0.5, 0.5)), x1 + HALF_M]
    return [area(a, y - HALF_M, b, y + HALF_M) for a, b in zip(ends[::2], ends[1::2], strict=True)]


def along(x: float, y0: float, y1: float) -> Polygon:
    """A wall from south to north."""
    return area(x - HALF_M, y0 - HALF_M, x + HALF_M, y1 + HALF_M)


def floor(number: int) -> DrawnLevel:
    """24 m by 14 m: a corridor with two rooms to the north and two to the south, stairs and a lift in the east, an entrance in the west."""
    south, north = (4.0, 12.0), (4.0, 12.0, 18.0, 22.0)  # doors of the corridor
    doors = [Door((x - 0.5, y, x + 0.5, y)) for y, row in ((6.0, south), (8.0, north)) for x in row]
    return DrawnLevel(
        FLOORS[number], (number - 1) * STOREY_M,
        walls=[
            *across(0, 0, 24), *across(6, 0, 24, south), *across(8, 0, 24, north), *across(14, 0, 2), *across(14, 6, 24),
            along(0, 0, 14), along(24, 0, 14), along(8, 0, 6), along(8, 8, 14), along(16, 8, 14), along(20, 8, 14), along(16, 0, 6),
        ],
        windows=[area(2.1, 13.9, 5.9, 14.1)],
        doors=[*doors, *([Door((0.0, 6.5, 0.0, 7.5))] if number == 1 else [])],
        rooms=[
            room(f"Office {number}01", area(0.1, 8.1, 7.9, 13.9)), room(f"Meeting {number}02", area(8.1, 8.1, 15.9, 13.9)),
            room("Kitchen", area(0.1, 0.1, 7.9, 5.9)), room(f"Store {number}04", area(8.1, 0.1, 15.9, 5.9)),
            room("Corridor", area(0.1, 6.1, 23.9, 7.9)),
        ],
        connectors=[
            ConnectorShape("stairs", "Stairs A", area(16.1, 8.6, 19.9, 13.9)),
            ConnectorShape("lift", "Lift", area(20.1, 8.6, 23.9, 13.9)),
        ],
    )  # fmt: skip


@cache
def seven_floors() -> Plan:
    """The building, with a table in each meeting room, and a start."""
    floors = [floor(number) for number in range(len(FLOORS))]
    plan = plan_of("Seven floors", floors, ImportReport(), Georeference(LON, LAT))
    table = np.array([[11.0, 10.0], [13.0, 10.0], [13.0, 11.5], [11.0, 11.5]])
    levels = tuple(replace(level, obstacles=(table,)) for level in plan.levels)
    plan = replace(plan, levels=levels, start=Pose(1.0, 7.0, 0.0, 1))
    return replace(plan, digest=hashlib.sha256(plan_json(plan).encode()).hexdigest())
