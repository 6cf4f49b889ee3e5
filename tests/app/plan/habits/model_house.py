# SPDX-License-Identifier: MIT
"""The house as a building model (IFC)."""

from __future__ import annotations

import random
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ifcopenshell.api import aggregate, unit

from plan.habits.house import ENTRANCE, HIGH, INNER, PARTITION, ROOMS, STAIRS, STOREYS, WIDE, Line, Move
from plan.test_plan_importer_ifc import Model, Schema


def model(
    move: Move, units: str = "", z: float = 0.0, thick: float = 0.2, schema: Schema = "IFC4", *, voids: bool = True
) -> Model:
    """The house in millimetres, or in feet or inches; its lowest floor at height z. Without `voids` its walls have no openings for doors."""
    made, h = Model(schema), thick / 2
    if units:
        unit.assign_unit(made.file, length={"is_metric": units.endswith("METERS"), "raw": units})
    made.site.RefLatitude, made.site.RefLongitude = (53, 0, 0), (8, 0, 0)

    def put(kind: str, box: Line, low: float, high: float, name: str = "") -> Any:
        return made.box(kind, (*move(*box[:2]), low), (box[2] - box[0], box[3] - box[1], high), move.turn, name)

    for k in STOREYS:
        floor = z + 3.0 * k
        storey = made.storey(f"Floor {k}", floor)
        south = put("IfcWall", (-h, -h, WIDE + h, h), floor, 2.8)
        partition = put("IfcWall", (PARTITION - h, h, PARTITION + h, HIGH - h), floor, 2.8)
        around = ((-h, HIGH - h, WIDE + h, HIGH + h), (-h, h, h, HIGH - h), (WIDE - h, h, WIDE + h, HIGH - h))
        elements = [south, partition, *(put("IfcWall", box, floor, 2.8) for box in around)]
        for wall, (a, b, c, d) in [(partition, INNER), *([(south, ENTRANCE)] if k == 0 else [])]:
            x, y = (0.05, 0.0) if a == c else (0.0, 0.05)
            far = 1.0 + 20 * h
            if not voids:
                elements.append(put("IfcDoor", (a - x, b - y, c + x, d + y), floor, 2.05))
                continue
            hole = put("IfcOpeningElement", (a - far * x, b - far * y, c + far * x, d + far * y), floor, 2.1)
            door = put("IfcDoor", (a - x, b - y, c + x, d + y), floor, 2.05)
            made.add(wall, hole)
            made.fill(hole, door)
            elements.append(door)
        for name, (a, b, c, d) in ROOMS.items():
            space = put("IfcSpace", (a + h, b + h, c - h, d - h), floor, 2.7, name)
            aggregate.assign_object(made.file, products=[space], relating_object=storey)
        made.contain(storey, *elements)
    put("IfcStairFlight", STAIRS, z, 6.0, "Stairs")
    return made


def write(folder: Path, move: Move, change: Callable[[Model], Any] = str, **about: Any) -> Path:
    """A file of the house; `change` alters the model. In another order its entities have other numbers, too."""
    made = model(move, **about)
    change(made)
    text = made.file.to_string()
    if move.seed is not None:
        head, _, data = text.partition("DATA;")
        rows = [row for row in data.partition("ENDSEC;")[0].splitlines() if row.strip()]
        random.Random(move.seed).shuffle(rows)
        numbers = {row[1 : row.index("=")]: str(k) for k, row in enumerate(rows, 1)}
        rows = [re.sub(r"#(\d+)", lambda found: "#" + numbers[found[1]], row) for row in rows]
        text = f"{head}DATA;\n" + "\n".join(rows) + "\nENDSEC;\nEND-ISO-10303-21;\n"
    path = folder / "house.ifc"
    path.write_text(text)
    return path


def storeys_anywhere(made: Model) -> None:
    """Storeys placed far from their contents."""
    for k, storey in enumerate(made.file.by_type("IfcBuildingStorey")):
        made._put(storey, 3e5, 6e6, 3.0 * k, 0.0)


def storeys_at_0(made: Model) -> None:
    """Storeys placed at 0, whose Elevation is right."""
    for k, storey in enumerate(made.file.by_type("IfcBuildingStorey")):
        made._put(storey, 0.0, 0.0, 0.0, 0.0)
        storey.Elevation = 3000.0 * k


def elevations_0(made: Model) -> None:
    """Storeys placed at their heights, whose Elevation is 0."""
    for storey in made.file.by_type("IfcBuildingStorey"):
        storey.Elevation = 0.0


def spaces_below(made: Model) -> None:
    """Rooms a storey lower than the storey that they belong to."""
    for k, space in enumerate(made.file.by_type("IfcSpace")):
        made._put(space, 0.1 + 5.0 * (k % 2), 0.1, 3.0 * (k // 2) - 3.0, 0.0)


def wide_doors(made: Model) -> None:
    for door in made.file.by_type("IfcDoor"):
        door.OverallWidth = 2000.0
