"""The building's plan: a JSON file in metres -> levels with walls as segments.

In: plan.json (format in host/README.md). Out: `Plan`. Owns nothing; every error names the file and the field.
"""

from __future__ import annotations

import hashlib
import json
import math
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from echostep.errors import EchostepError

FORMAT_VERSION = 1
LIMIT_M = 1e5


@dataclass(frozen=True, slots=True)
class Room:
    """A name at a place, for people."""

    name: str
    at_m: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Level:
    """One storey: `walls` is (n, 4) float64, x0 y0 x1 y1 in map metres; doors are gaps in the walls."""

    name: str
    height_m: float
    walls: NDArray[np.float64]
    rooms: tuple[Room, ...]


@dataclass(frozen=True, slots=True)
class Pose:
    """A place and a heading on the map: metres, radians counter-clockwise from x (east)."""

    x_m: float
    y_m: float
    heading_rad: float


@dataclass(frozen=True, slots=True)
class Plan:
    """A building; `digest` identifies the file's content."""

    name: str
    levels: tuple[Level, ...]
    start: Pose | None
    digest: str


def load_plan(path: Path | str) -> Plan:
    """The plan in a file; raises EchostepError that names the file and the field."""
    path = Path(path)
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise EchostepError(f"{path}: cannot read the plan: {error.strerror or error}") from error
    try:
        tree = json.loads(raw)
    except (ValueError, RecursionError) as error:
        raise EchostepError(f"{path}: not a plan: {error}") from error
    try:
        return _plan(tree, hashlib.sha256(raw).hexdigest())
    except ValueError as error:
        raise EchostepError(f"{path}: {error}") from error


def _plan(tree: Any, digest: str) -> Plan:
    tree = _typed(tree, "the file", dict)
    if (version := tree.get("echostep_plan")) != FORMAT_VERSION:
        raise ValueError(f"echostep_plan is {version!r}, expected {FORMAT_VERSION}: is this an echostep plan?")
    rows = _typed(tree.get("levels"), "levels", list)
    if not rows:
        raise ValueError("levels: a plan needs at least one level")
    levels = tuple(_level(row, f"levels[{i}]") for i, row in enumerate(rows))
    start = _start(tree["start"]) if tree.get("start") is not None else None
    return Plan(_text(tree.get("name", "plan"), "name"), levels, start, digest)


def _level(row: Any, where: str) -> Level:
    row = _typed(row, where, dict)
    rooms = _typed(row.get("rooms", []), f"{where}.rooms", list)
    return Level(
        name=_text(row.get("name", where), f"{where}.name"),
        height_m=_number(row.get("height_m", 0.0), f"{where}.height_m"),
        walls=_walls(row.get("walls"), f"{where}.walls"),
        rooms=tuple(_room(room, f"{where}.rooms[{i}]") for i, room in enumerate(rooms)),
    )


def _walls(rows: Any, where: str) -> NDArray[np.float64]:
    rows = _typed(rows, where, list)
    walls = _sound(rows)
    return _checked(rows, where) if walls is None else walls


def _sound(rows: list[Any]) -> NDArray[np.float64] | None:
    """All walls at once if nothing is wrong with any; a city has a million."""
    if set(map(type, rows)) != {list} or set(map(len, rows)) != {4}:
        return None
    if not set(map(type, chain.from_iterable(rows))) <= {int, float}:
        return None
    try:
        walls = np.array(rows, dtype=np.float64)
    except OverflowError:
        return None
    within = (np.abs(walls) <= LIMIT_M).all() and (walls[:, :2] != walls[:, 2:]).any(1).all()
    return walls if within else None


def _checked(rows: list[Any], where: str) -> NDArray[np.float64]:
    """One wall after the other, to name the one that is wrong."""
    for i, row in enumerate(rows):
        if not isinstance(row, list) or len(row) != 4:
            raise ValueError(f"{where}[{i}]: expected [x0, y0, x1, y1] in metres")
        for value in row:
            _number(value, f"{where}[{i}]")
        if row[:2] == row[2:]:
            raise ValueError(f"{where}[{i}]: a wall without length")
    return np.array(rows, dtype=np.float64).reshape(-1, 4)


def _room(row: Any, where: str) -> Room:
    row = _typed(row, where, dict)
    at = _typed(row.get("at"), f"{where}.at", list)
    if len(at) != 2:
        raise ValueError(f"{where}.at: expected [x, y]")
    return Room(_text(row.get("name"), f"{where}.name"), (_number(at[0], f"{where}.at"), _number(at[1], f"{where}.at")))


def _start(row: Any) -> Pose:
    row = _typed(row, "start", dict)
    x, y, heading = (_number(row.get(key), f"start.{key}") for key in ("x", "y", "heading_deg"))
    return Pose(x, y, math.radians(heading))


def _number(value: Any, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= LIMIT_M:
        raise ValueError(f"{where}: {value!r} is not a finite number within {LIMIT_M:.0f} m")
    return float(value)


def _text(value: Any, where: str) -> str:
    if not isinstance(value, str):
        raise ValueError(f"{where}: {value!r} is not a text")
    return value


def _typed(value: Any, where: str, kind: type) -> Any:
    if not isinstance(value, kind):
        raise ValueError(f"{where}: expected {'a list' if kind is list else 'an object'}, found {type(value).__name__}")
    return value
