# SPDX-License-Identifier: MIT
"""The building's plan: a JSON file in metres -> levels with walls, doors, windows, obstacles and rooms, and connectors between levels.

In: plan.json (format in host/README.md). Out: `Plan`. Owns nothing; every error names the file and the field.
"""

from __future__ import annotations

import hashlib
import json
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, cast, get_args

import numpy as np

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.plan.json_fields import choice, number, outline, point, segment, segments, text, typed

FORMAT_VERSION = 1
DoorState = Literal["open", "closed", "unknown"]
ConnectorKind = Literal["stairs", "lift", "ramp"]


def _no_segments() -> Floats:
    return np.zeros((0, 4))


@dataclass(frozen=True, slots=True)
class Room:
    """A room's name and its position; its outline (n, 2) in metres, None where the plan has none."""

    name: str
    at_m: tuple[float, float]
    outline_m: Floats | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class Door:
    """A gap in the walls; `line`: x0, y0, x1, y1 in metres, from one jamb to the other."""

    line: tuple[float, float, float, float]
    state: DoorState = "unknown"
    name: str = ""

    @property
    def width_m(self) -> float:
        """Distance between the jambs."""
        x0, y0, x1, y1 = self.line
        return math.hypot(x1 - x0, y1 - y0)


@dataclass(frozen=True, slots=True)
class Level:
    """One level: `walls` (n, 4) and `windows` (k, 4) are x0, y0, x1, y1 in map metres; doors are gaps in them; obstacles are outlines (m, 2).

    `doubtful` (d, 4): walls of an older plan that echoes passed; they block nothing.
    """

    name: str
    height_m: float
    walls: Floats
    rooms: tuple[Room, ...] = ()
    doors: tuple[Door, ...] = ()
    windows: Floats = field(default_factory=_no_segments)
    obstacles: tuple[Floats, ...] = ()
    doubtful: Floats = field(default_factory=_no_segments)

    @property
    def solid(self) -> Floats:
        """All segments that block people and echoes, (n + k + ..., 4): walls, then windows, then the sides of obstacles."""
        if not len(self.windows) and not self.obstacles:
            return self.walls
        return np.concatenate((self.walls, self.windows, *(sides(corners) for corners in self.obstacles)))


@dataclass(frozen=True, slots=True)
class Connector:
    """Stairs, a lift or a ramp: the same outline (n, 2) on all its levels (indices into Plan.levels, ascending)."""

    kind: ConnectorKind
    name: str
    levels: tuple[int, ...]
    outline_m: Floats


@dataclass(frozen=True, slots=True)
class Pose:
    """Position in metres and heading in radians, counter-clockwise from the map's x axis; `level` is an index into Plan.levels."""

    x_m: float
    y_m: float
    heading_rad: float
    level: int = 0


@dataclass(frozen=True, slots=True)
class Georeference:
    """Position of the map's origin on the Earth; the map's x axis points `rotation_rad` counter-clockwise from east."""

    longitude_deg: float
    latitude_deg: float
    rotation_rad: float = 0.0
    crs: str = "EPSG:4326"


@dataclass(frozen=True, slots=True)
class Plan:
    """A building. `digest`: SHA-256 of the file. `uncertainty_m`: standard deviation of the walls' positions, None where unknown."""

    name: str
    levels: tuple[Level, ...]
    start: Pose | None
    digest: str
    connectors: tuple[Connector, ...] = ()
    georeference: Georeference | None = None
    uncertainty_m: float | None = None

    @property
    def is_drawn(self) -> bool:
        """Whether it has anything that blocks people and echoes: NO_PLAN has not."""
        return any(len(level.solid) for level in self.levels)


# Where there is no plan, the map begins where the walk begins: x to the right of the first heading, y ahead.
NO_PLAN = Plan("no plan", (Level("", 0.0, _no_segments()),), Pose(0.0, 0.0, 0.5 * math.pi), "")


def sides(corners: Floats) -> Floats:
    """The sides of an outline: (n, 2) -> (n, 4)."""
    return np.concatenate((corners, np.roll(corners, -1, axis=0)), axis=1)


class NotJsonError(ValueError):
    """A file that is not JSON, so not a plan of echostep's own format."""


def load_plan(path: Path | str) -> Plan:
    """Read a plan file; raises EchostepError that names the file and the field."""
    path = Path(path)
    try:
        raw = path.read_bytes()
    except OSError as error:
        remedy = "give the building's file with --plan; echostep plan import makes one of a drawing"
        raise EchostepError(f"{path}: cannot read the plan: {error.strerror or error}: {remedy}") from error
    try:
        return parse_plan(raw)
    except NotJsonError as error:
        formats = "DXF, IMDF, OSM, IFC, GeoJSON or WRLD"
        remedy = f"of another format ({formats}), echostep plan import makes one"
        raise EchostepError(f"{path}: {error}; {remedy}") from error
    except ValueError as error:
        raise EchostepError(f"{path}: {error}") from error


def parse_plan(raw: bytes) -> Plan:
    """Parse the bytes of a plan file; raises ValueError that names the field."""
    try:
        tree = json.loads(raw)
    except (ValueError, RecursionError) as error:
        raise NotJsonError(f"not a plan: {error}") from error
    return _plan(tree, hashlib.sha256(raw).hexdigest())


def _plan(tree: Any, digest: str) -> Plan:
    tree = typed(tree, "the file", dict)
    version = tree.get("echostep_plan")
    if version != FORMAT_VERSION or version is True:
        raise ValueError(
            f"echostep_plan is {str(version)[:40]!r}, expected {FORMAT_VERSION}: is this an echostep plan?"
        )
    rows = typed(tree.get("levels"), "levels", list)
    if not rows:
        raise ValueError("levels: a plan needs at least one level")
    levels = tuple(_level(row, f"levels[{i}]") for i, row in enumerate(rows))
    names = [level.name for level in levels]
    connectors = typed(tree.get("connectors", []), "connectors", list)
    return Plan(
        name=text(tree.get("name", "plan"), "name"),
        levels=levels,
        start=None if tree.get("start") is None else _start(tree["start"], names),
        digest=digest,
        connectors=tuple(_connector(row, f"connectors[{i}]", names) for i, row in enumerate(connectors)),
        georeference=None if tree.get("georeference") is None else _georeference(tree["georeference"]),
        uncertainty_m=None if tree.get("uncertainty_m") is None else _uncertainty(tree["uncertainty_m"]),
    )


def _level(row: Any, where: str) -> Level:
    row = typed(row, where, dict)
    rooms, doors, obstacles = (
        typed(row.get(key, []), f"{where}.{key}", list) for key in ("rooms", "doors", "obstacles")
    )
    return Level(
        name=text(row.get("name", where), f"{where}.name"),
        height_m=number(row.get("height_m", 0.0), f"{where}.height_m"),
        walls=segments(row.get("walls"), f"{where}.walls"),
        rooms=tuple(_room(room, f"{where}.rooms[{i}]") for i, room in enumerate(rooms)),
        doors=tuple(_door(door, f"{where}.doors[{i}]") for i, door in enumerate(doors)),
        windows=segments(row.get("windows", []), f"{where}.windows"),
        obstacles=tuple(outline(corners, f"{where}.obstacles[{i}]") for i, corners in enumerate(obstacles)),
        doubtful=segments(row.get("doubtful", []), f"{where}.doubtful"),
    )


def _room(row: Any, where: str) -> Room:
    row = typed(row, where, dict)
    corners = None if row.get("outline") is None else outline(row["outline"], f"{where}.outline")
    return Room(text(row.get("name"), f"{where}.name"), point(row.get("at"), f"{where}.at"), corners)


def _door(row: Any, where: str) -> Door:
    row = typed(row, where, dict)
    state = choice(row.get("state", "unknown"), f"{where}.state", get_args(DoorState))
    return Door(
        segment(row.get("line"), f"{where}.line"), cast(DoorState, state), text(row.get("name", ""), f"{where}.name")
    )


def _connector(row: Any, where: str, names: list[str]) -> Connector:
    row = typed(row, where, dict)
    references = typed(row.get("levels"), f"{where}.levels", list)
    levels = sorted({_level_index(reference, f"{where}.levels", names) for reference in references})
    if len(levels) < 2:
        raise ValueError(f"{where}.levels: a connector needs two levels or more")
    return Connector(
        cast(ConnectorKind, choice(row.get("kind"), f"{where}.kind", get_args(ConnectorKind))),
        text(row.get("name", ""), f"{where}.name"),
        tuple(levels),
        outline(row.get("outline"), f"{where}.outline"),
    )


def _level_index(value: Any, where: str, names: list[str]) -> int:
    """The index of a level that the file gives by its name or its index."""
    if isinstance(value, str):
        if names.count(value) != 1:
            raise ValueError(f"{where}: {'two levels are' if value in names else 'no level is'} named {value[:40]!r}")
        return names.index(value)
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < len(names):
        raise ValueError(f"{where}: expected names of levels or indices from 0 to {len(names) - 1}")
    return value


def _start(row: Any, names: list[str]) -> Pose:
    row = typed(row, "start", dict)
    x, y, heading = (number(row.get(key), f"start.{key}") for key in ("x", "y", "heading_deg"))
    return Pose(x, y, math.radians(heading), _level_index(row.get("level", 0), "start.level", names))


def _georeference(row: Any) -> Georeference:
    row = typed(row, "georeference", dict)
    origin = typed(row.get("origin"), "georeference.origin", list)
    if len(origin) != 2:
        raise ValueError("georeference.origin: expected [longitude, latitude] in degrees")
    return Georeference(
        number(origin[0], "georeference.origin", 180.0, "degrees east"),
        number(origin[1], "georeference.origin", 90.0, "degrees north"),
        math.radians(number(row.get("rotation_deg", 0.0), "georeference.rotation_deg", 360.0, "degrees")),
        text(row.get("crs", "EPSG:4326"), "georeference.crs"),
    )


def _uncertainty(value: Any) -> float:
    if (sd_m := number(value, "uncertainty_m")) < 0.0:
        raise ValueError(f"uncertainty_m: {sd_m} is negative")
    return sd_m
