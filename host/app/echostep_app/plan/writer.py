# SPDX-License-Identifier: MIT
"""Writes a plan as plan.json without loss.

In: a `Plan`. Out: the text or the file, with one wall per line. Owns nothing.
"""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any

from echostep.fields import UNWRITABLE
from echostep.file_mode import keep_earlier
from echostep.plan import FORMAT_VERSION, Connector, Door, Georeference, Level, Plan, Pose, Question, Room
from echostep_app.printing.lines import as_error


def save_plan(plan: Plan, path: Path | str) -> None:
    """Write a plan; `load_plan` reads back an equal plan with another digest. Raises EchostepError when the file cannot be written."""
    with as_error(f"{path}: cannot write the plan"):
        keep_earlier(Path(path)).write_text(plan_json(plan), encoding="utf-8")


def plan_json(plan: Plan) -> str:
    """The text of plan.json."""
    tree: dict[str, Any] = {"echostep_plan": FORMAT_VERSION, "name": _text(plan.name)}
    if plan.uncertainty_m is not None:
        tree["uncertainty_m"] = plan.uncertainty_m
    if plan.picture is not None:
        tree["picture"] = list(plan.picture)
    if plan.georeference is not None:
        tree["georeference"] = _georeference(plan.georeference)
    tree["levels"] = [_level(level) for level in plan.levels]
    if plan.connectors:
        tree["connectors"] = [_connector(connector) for connector in plan.connectors]
    if plan.start is not None:
        tree["start"] = _start(plan.start)
    return _lines(tree) + "\n"


def _text(name: str) -> str:
    """A name as a plan can hold it; names of an imported file may have any letters."""
    return re.sub(f"[{UNWRITABLE}]", " ", name)


def _level(level: Level) -> dict[str, Any]:
    tree: dict[str, Any] = {"name": _text(level.name), "height_m": level.height_m, "walls": level.walls.tolist()}
    if len(level.windows):
        tree["windows"] = level.windows.tolist()
    if len(level.doubtful):
        tree["doubtful"] = level.doubtful.tolist()
    if len(level.place_sd):
        tree["place_sd"] = level.place_sd.tolist()
    if level.doors:
        tree["doors"] = [_door(door) for door in level.doors]
    if level.obstacles:
        tree["obstacles"] = [corners.tolist() for corners in level.obstacles]
    if level.questions:
        tree["questions"] = [_question(question) for question in level.questions]
    return tree | {"rooms": [_room(room) for room in level.rooms]}


def _door(door: Door) -> dict[str, Any]:
    return {"line": list(door.line), "state": door.state} | ({"name": _text(door.name)} if door.name else {})


def _question(question: Question) -> dict[str, Any]:
    lines = [list(line) for line in question.lines_m]
    return {
        "text": _text(question.text), "about": question.about, "at": list(question.at_m), "lines": lines, "proposed": question.is_proposed,
    }  # fmt: skip


def _room(room: Room) -> dict[str, Any]:
    return {"name": _text(room.name), "at": list(room.at_m)} | (
        {} if room.outline_m is None else {"outline": room.outline_m.tolist()}
    )


def _connector(connector: Connector) -> dict[str, Any]:
    return {
        "kind": connector.kind,
        "name": _text(connector.name),
        "levels": list(connector.levels),
        "outline": connector.outline_m.tolist(),
    }


def _start(start: Pose) -> dict[str, Any]:
    tree: dict[str, Any] = {"x": start.x_m, "y": start.y_m, "heading_deg": _degrees(start.heading_rad)}
    return tree | ({"level": start.level} if start.level else {})


def _georeference(georeference: Georeference) -> dict[str, Any]:
    """The field `georeference` of plan.json."""
    return {
        "crs": georeference.crs,
        "origin": [georeference.longitude_deg, georeference.latitude_deg],
        "rotation_deg": _degrees(georeference.rotation_rad),
    }


def _degrees(angle_rad: float) -> float:
    """The shortest number of degrees that is read back as the same radians; else the nearest one."""
    angle = math.degrees(angle_rad)
    below, above = math.nextafter(angle, -math.inf), math.nextafter(angle, math.inf)
    tried = [*(round(angle, digits) for digits in range(16)), angle, below, above]
    return next((degrees for degrees in tried if math.radians(degrees) == angle_rad), angle)


def _lines(tree: Any, depth: int = 0) -> str:
    """JSON text with one row of a list per line."""
    inner = " " * (depth + 1)
    if isinstance(tree, dict):
        rows = [f"{json.dumps(key)}: {_lines(value, depth + 1)}" for key, value in tree.items()]
        return "{\n" + inner + f",\n{inner}".join(rows) + "\n" + " " * depth + "}"
    if not isinstance(tree, list) or not tree or not isinstance(tree[0], dict | list):
        return json.dumps(tree)
    if isinstance(tree[0], dict) and any(len(json.dumps(row)) > 1000 for row in tree):
        rows = [_lines(row, depth + 1) for row in tree]
        return "[\n" + inner + f",\n{inner}".join(rows) + "\n" + " " * depth + "]"
    return "[\n" + inner + f",\n{inner}".join(json.dumps(row) for row in tree) + "\n" + " " * depth + "]"
