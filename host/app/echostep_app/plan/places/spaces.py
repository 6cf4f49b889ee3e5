# SPDX-License-Identifier: MIT
"""Spaces: the kinds of a level's enclosed spaces: rooms, corridors, insides of walls.

In: a plan, the index of a level. Out: `Spaces`. Owns, in `PlanSpaces`, the spaces found before. Doors are the plan's doors and gaps between walls;
all of them count as closed.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from echostep.plan import Connector, Door, Plan, Room
from echostep_app.plan.places.faces import OUTSIDE, Faces, door_faces, find_faces
from echostep_app.plan.places.gaps import with_gaps

# Assumed:
WALL_M = 0.6  # a space without room and door that is narrower than this is the inside of a wall
CORRIDOR_DOORS = 3  # an unnamed space with this many doors is a corridor
ENCLOSED_SHARE = 0.5  # of the walls' hull that is enclosed in a building without names
MOST_WALLS = 10_000  # of a level whose spaces are looked for: about a second of computing

Areas = NDArray[np.object_]


@dataclass(frozen=True, slots=True)
class Spaces:
    """The spaces of one level.

    `names`: by index of a face, the rooms without an outline whose position it contains. `outlined`: rooms with an outline, and `outlines`, their
    areas. `doors`: with the two faces that each separates. `hollow`: faces that are insides of walls. `ways`: stairs, lifts and ramps, and
    `way_areas`. `enclosed`: all rooms lie in enclosed spaces, so that any other position is outside.
    """

    faces: Faces
    names: dict[int, list[Room]]
    outlined: tuple[Room, ...]
    outlines: Areas
    doors: tuple[tuple[Door, int, int], ...]
    hollow: frozenset[int]
    ways: tuple[Connector, ...]
    way_areas: Areas
    enclosed: bool

    def is_corridor(self, face: int) -> bool:
        """Whether a face is a space without a name that joins several others."""
        joins = sum(face in (a, b) for _, a, b in self.doors)
        return face != OUTSIDE and face not in self.names and joins >= CORRIDOR_DOORS

    def inside(self, x_m: float, y_m: float) -> bool:
        """Whether a position lies in an enclosed space, a room's outline, or on stairs."""
        point = shapely.Point(x_m, y_m)
        areas = (*self.outlines, *self.way_areas)
        return self.face_at(x_m, y_m) != OUTSIDE or any(area.intersects(point) for area in areas)

    def face_at(self, x_m: float, y_m: float) -> int:
        """Index of the face around a position, or OUTSIDE."""
        return int(self.faces.indices_of(np.array([[x_m, y_m]]))[0])


class PlanSpaces:
    """The spaces of each level of a plan, found when a level is first asked for. One thread asks at a time."""

    def __init__(self, plan: Plan) -> None:
        self._plan = plan
        self._by_level: dict[int, Spaces | None] = {}

    def on(self, level_index: int) -> Spaces | None:
        """The spaces of a level; None where the level has too many walls."""
        if level_index not in self._by_level:
            self._by_level[level_index] = find_spaces(self._plan, level_index)
        return self._by_level[level_index]


def find_spaces(plan: Plan, level_index: int) -> Spaces | None:
    """The spaces of a level; None where the level has too many walls."""
    level = plan.levels[level_index]
    if len(level.solid) > MOST_WALLS:
        return None
    level = with_gaps(level)
    faces = find_faces(level)
    at = faces.indices_of(np.array([room.at_m for room in level.rooms]).reshape(-1, 2)).tolist()
    names: dict[int, list[Room]] = defaultdict(list)
    for room, face in zip(level.rooms, at, strict=True):
        if face != OUTSIDE and room.outline_m is None:
            names[face].append(room)
    outlined = tuple(room for room in level.rooms if room.outline_m is not None)
    ways = tuple(way for way in plan.connectors if level_index in way.levels)
    doors = tuple((door, a, b) for door, (a, b) in zip(level.doors, door_faces(level.doors, faces), strict=True))
    spaces = Spaces(
        faces, dict(names), outlined, _areas([room.outline_m for room in outlined]), doors, frozenset(),
        ways, _areas([way.outline_m for way in ways]), enclosed=_is_enclosed(plan, level_index, faces, at),
    )  # fmt: skip
    return replace(spaces, hollow=_hollow(spaces))


def _areas(outlines: list[Any]) -> Areas:
    return np.array([shapely.make_valid(shapely.Polygon(corners)) for corners in outlines], dtype=np.object_)


def _is_enclosed(plan: Plan, level_index: int, faces: Faces, at: list[int]) -> bool:
    """Whether all rooms, and the start, lie in enclosed spaces; without any of them: whether these fill half of the walls' hull."""
    level, start = plan.levels[level_index], plan.start
    homes = [face != OUTSIDE or room.outline_m is not None for room, face in zip(level.rooms, at, strict=True)]
    if start is not None and start.level == level_index and not homes:
        homes = [faces.indices_of(np.array([[start.x_m, start.y_m]]))[0] != OUTSIDE]
    if homes:
        return all(homes)
    hull = shapely.MultiPoint(level.solid.reshape(-1, 2)).convex_hull
    return bool(len(faces.areas)) and float(shapely.area(faces.areas).sum()) > ENCLOSED_SHARE * hull.area


def _hollow(spaces: Spaces) -> frozenset[int]:
    """Faces that are narrow, have no name and no door, and belong to no room's outline or stairs."""
    doors = Counter(face for _, a, b in spaces.doors for face in (a, b))
    narrow = np.flatnonzero(shapely.is_empty(shapely.buffer(spaces.faces.areas, -WALL_M / 2))).tolist()
    used = shapely.STRtree(np.concatenate((spaces.outlines, spaces.way_areas)))
    middles = {face: spaces.faces.areas[face].representative_point() for face in narrow}
    return frozenset(
        face for face in narrow
        if face not in spaces.names and not doors[face] and not len(used.query(middles[face], predicate="intersects"))
    )  # fmt: skip
