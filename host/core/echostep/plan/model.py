# SPDX-License-Identifier: MIT
"""The building's plan: a JSON file in metres -> levels with walls, doors, windows, obstacles and rooms, and connectors between levels.

In: plan.json (format in host/README.md). Out: `Plan`. Owns nothing; every error names the file and the field.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import UNSET

from echostep.additions import needed, svg_of
from echostep.arrays import Floats
from echostep.errors import EchostepError, replaced
from echostep.fields import checked, short
from echostep.plan import plan_file
from echostep.plan.plan_file import ConnectorFields, Door, LevelFields, PlanFields, QuestionFields, RoomFields

FORMAT_VERSION = 1
# Standard deviation per axis of a drawn storey's places, beyond which it is refused: 95 % are within 2.5 m, a room, assumed
MOST_PLACE_SD_M = 1.0


def _no_segments() -> Floats:
    return np.zeros((0, 4))


@dataclass(frozen=True, slots=True)
class Room:
    """A room's name and its position; its outline (n, 2) in metres, or None."""

    name: str
    at_m: tuple[float, float]
    outline_m: Floats | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Question:
    """A question that an import could not decide, for a person to answer in the plan editor; walks ignore it.

    `at_m`: where to look. `lines_m`: the doors or walls that it is about. `is_proposed`: they are not part of the plan, but may be.
    """

    text: str
    about: plan_file.QuestionAbout
    at_m: tuple[float, float]
    lines_m: tuple[tuple[float, float, float, float], ...] = ()
    is_proposed: bool = False


@dataclass(frozen=True, slots=True)
class Level:
    """One level: `walls` (n, 4) and `windows` (k, 4) are x0, y0, x1, y1 in map metres; doors are gaps in them; obstacles are outlines (m, 2).

    `doubtful` (d, 4): walls of a drawing that are not known well enough; they block nothing. `place_sd` (k, 3): x, y of a drawn wall, and the
    standard deviation per axis of its place in the building.
    """

    name: str
    height_m: float
    walls: Floats
    rooms: tuple[Room, ...] = ()
    doors: tuple[Door, ...] = ()
    windows: Floats = field(default_factory=_no_segments)
    obstacles: tuple[Floats, ...] = ()
    doubtful: Floats = field(default_factory=_no_segments)
    questions: tuple[Question, ...] = ()
    place_sd: Floats = field(default_factory=lambda: np.zeros((0, 3)))

    def __repr__(self) -> str:
        """Name, height and size."""
        return f"<Level {short(self.name)}, {self.height_m:g} m: {len(self.walls)} walls, {len(self.rooms)} rooms>"

    @property
    def is_refused(self) -> bool:
        """Whether it was drawn by a walk and most of its places are not known to within a room: then it is no plan."""
        return is_no_plan(self.place_sd)

    @property
    def heard(self) -> Floats:
        """All segments that echoes are compared with: the solid ones, and the doubtful walls of a drawing.

        The distance of doubtful walls from nearby places is known better than their place in the building.
        """
        if not len(self.place_sd) or self.is_refused:
            return self.solid
        return np.concatenate((self.solid, self.doubtful))

    @property
    def solid(self) -> Floats:
        """All segments that block people and echoes, (n + k + ..., 4): walls, then windows, then the sides of obstacles."""
        if not len(self.windows) and not self.obstacles:
            return self.walls
        return np.concatenate((self.walls, self.windows, *(sides(corners) for corners in self.obstacles)))


def is_no_plan(place_sd: Floats) -> bool:
    """Whether most of a drawn storey's places (k, 3) are not known to within a room."""
    return len(place_sd) > 0 and float(np.median(place_sd[:, 2])) > MOST_PLACE_SD_M


@dataclass(frozen=True, slots=True)
class Connector:
    """Stairs, a lift or a ramp: the same outline (n, 2) on all its levels (indices into Plan.levels, ascending)."""

    kind: plan_file.ConnectorKind
    name: str
    levels: tuple[int, ...]
    outline_m: Floats = field(repr=False)


ANY_LEVEL = -1  # of a pose whose level is not known


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
    """A building; a notebook shows it as a picture.

    `digest`: SHA-256 of the file. `uncertainty_m`: standard deviation of the walls' positions, None if unknown. `picture`: of the one that the
    plan is drawn over, metres a pixel and the place of its lower left corner.
    """

    name: str
    levels: tuple[Level, ...]
    start: Pose | None
    digest: str
    connectors: tuple[Connector, ...] = ()
    georeference: Georeference | None = None
    uncertainty_m: float | None = None
    picture: tuple[float, float, float] | None = None

    def __repr__(self) -> str:
        """Name and size."""
        names = ", ".join(level.name for level in self.levels)
        walls, rooms = (sum(len(getattr(level, kind)) for level in self.levels) for kind in ("walls", "rooms"))
        return f"<Plan {short(self.name)}: {short(names)}; {walls} walls, {rooms} rooms>"

    def _repr_svg_(self) -> str | None:
        """All levels as a picture, for a notebook; None without matplotlib, so that the repr is shown."""
        return svg_of(self)

    @property
    def exits(self) -> tuple[Pose, ...]:
        """A pose outside each way out, heading away from it; empty where the plan shows none. Raises EchostepError without echostep-app."""
        return tuple(needed("exits", "Plan.exits")(self))

    @property
    def is_drawn(self) -> bool:
        """Whether it has segments that echoes are compared with; NO_PLAN and a refused drawing have none."""
        return any(len(level.heard) for level in self.levels)


# Without a plan, the map begins where the walk begins: x to the right of the first heading, y ahead.
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
    except ValueError as error:
        other = "; of another format (DXF, IMDF, OSM, IFC or GeoJSON), echostep plan import makes one"
        raise EchostepError(f"{path}: {error}{other if isinstance(error, NotJsonError) else ''}") from error


def parse_plan(raw: bytes) -> Plan:
    """Parse the bytes of a plan file; raises ValueError that names the field."""
    try:
        tree = json.loads(raw, object_pairs_hook=_once)
    except (ValueError, RecursionError) as error:
        if what := replaced(raw[:32]):
            raise ValueError(what) from error
        if isinstance(error, RecursionError) or str(error).startswith("Exceeds"):
            raise ValueError("not a plan: nested too deep, or a number has too many digits") from error
        if not isinstance(error, json.JSONDecodeError | UnicodeDecodeError):
            raise
        where = f", line {error.lineno}, column {error.colno}" if isinstance(error, json.JSONDecodeError) else ""
        raise NotJsonError(f"not a plan: it is not JSON{where}") from error
    return _plan(tree, hashlib.sha256(raw).hexdigest())


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """An object whose fields stand once."""
    if len(tree := dict(pairs)) < len(pairs):
        twice = Counter(key for key, _ in pairs).most_common(1)[0][0]
        raise ValueError(f"the field {short(twice)} stands twice: delete one")
    return tree


def _plan(tree: Any, digest: str) -> Plan:
    version = tree.get("echostep_plan") if isinstance(tree, dict) else FORMAT_VERSION
    if version != FORMAT_VERSION or version is True:
        raise ValueError(f"echostep_plan is {short(version)}, expected {FORMAT_VERSION}: is this an echostep plan?")
    fields = checked(tree, PlanFields)
    levels = tuple(_level(level, f"levels[{i}]") for i, level in enumerate(fields.levels))
    names, start, geo = [level.name for level in levels], fields.start, fields.georeference
    start_level = 0 if start is None else _level_index(start.level, "start.level", names)
    return Plan(
        name=fields.name,
        levels=levels,
        start=None if start is None else Pose(start.x, start.y, math.radians(start.heading_deg), start_level),
        digest=digest,
        connectors=tuple(_connector(row, f"connectors[{i}]", names) for i, row in enumerate(fields.connectors)),
        georeference=None if geo is None else Georeference(*geo.origin, math.radians(geo.rotation_deg), geo.crs),
        uncertainty_m=fields.uncertainty_m,
        picture=fields.picture,
    )


def _level(fields: LevelFields, where: str) -> Level:
    for i, door in enumerate(fields.doors):
        _segments([door.line], f"{where}.doors[{i}].line")
    return Level(
        name=where if fields.name is UNSET else fields.name,
        height_m=fields.height_m,
        walls=_segments(fields.walls, f"{where}.walls"),
        rooms=tuple(_room(room, f"{where}.rooms[{i}]") for i, room in enumerate(fields.rooms)),
        doors=tuple(fields.doors),
        windows=_segments(fields.windows, f"{where}.windows"),
        obstacles=tuple(_outline(corners, f"{where}.obstacles[{i}]") for i, corners in enumerate(fields.obstacles)),
        doubtful=_segments(fields.doubtful, f"{where}.doubtful"),
        questions=tuple(_question(question, f"{where}.questions[{i}]") for i, question in enumerate(fields.questions)),
        place_sd=np.array(fields.place_sd, np.float64).reshape(-1, 3),
    )


def _room(fields: RoomFields, where: str) -> Room:
    corners = None if fields.outline is None else _outline(fields.outline, f"{where}.outline")
    return Room(fields.name, fields.at, corners)


def _question(fields: QuestionFields, where: str) -> Question:
    _segments(fields.lines, f"{where}.lines")
    return Question(fields.text, fields.about, fields.at, tuple(fields.lines), fields.proposed)


def _connector(fields: ConnectorFields, where: str, names: list[str]) -> Connector:
    levels = sorted({_level_index(reference, f"{where}.levels", names) for reference in fields.levels})
    if len(levels) < 2:
        raise ValueError(f"{where}.levels: a connector needs two levels or more")
    return Connector(fields.kind, fields.name, tuple(levels), _outline(fields.outline, f"{where}.outline"))


def _level_index(reference: str | int, where: str, names: list[str]) -> int:
    """The index of a level that the file gives by its name or its index."""
    if isinstance(reference, str):
        if (count := names.count(reference)) != 1:
            raise ValueError(f"{where}: {'two levels are' if count else 'no level is'} named {reference[:40]!r}")
        return names.index(reference)
    if not 0 <= reference < len(names):
        raise ValueError(f"{where}: expected names of levels or indices from 0 to {len(names) - 1}")
    return reference


def _outline(points: Sequence[tuple[float, float]], where: str) -> Floats:
    """An outline of at least three corners -> (n, 2) float64; consecutive equal corners count as one."""
    if len(points) > plan_file.MOST_CORNERS:
        raise ValueError(f"{where}: {len(points)} corners, expected {plan_file.MOST_CORNERS} at most")
    corners = [corner for corner, _ in groupby(points)]
    if len(corners) > 1 and corners[0] == corners[-1]:
        corners.pop()
    if len(set(corners)) < 3:
        raise ValueError(f"{where}: an outline needs at least three different corners")
    return np.array(corners, dtype=np.float64)


def _segments(rows: Sequence[tuple[float, float, float, float]], where: str) -> Floats:
    """Segments, each with a length -> (n, 4) float64."""
    segments = np.array(rows, dtype=np.float64).reshape(-1, 4)
    without_length = (segments[:, :2] == segments[:, 2:]).all(axis=1)
    if without_length.any():
        raise ValueError(f"{where}[{without_length.argmax()}]: a wall without length: both ends are the same point")
    return segments
