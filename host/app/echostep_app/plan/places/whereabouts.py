# SPDX-License-Identifier: MIT
"""Whereabouts: a position in words: "in Office 1", "in the corridor, by the door of Lab".

In: a plan, positions. Out: words. Owns only the spaces that it has found. The page, team reports and summaries take their words
from here.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import shapely

from echostep.plan import Plan, Room
from echostep_app.plan.cropping import is_clear
from echostep_app.plan.places.faces import OUTSIDE
from echostep_app.plan.places.spaces import PlanSpaces, Spaces

BY_M = 4.0  # a door within this distance is named in a corridor: it is seen from there
ON_OR_IN = {"stairs": "on", "lift": "in", "ramp": "on"}


class Whereabouts:
    """Words for positions on one plan. One thread asks at a time."""

    def __init__(self, plan: Plan, spaces: PlanSpaces | None = None) -> None:
        """`spaces`: the plan's spaces, if shared."""
        self._plan = plan
        self._spaces = spaces or PlanSpaces(plan)

    def words(self, x_m: float, y_m: float, level: int) -> str:
        """Where a position is, on its own level; empty where the plan names nothing there."""
        if not (0 <= level < len(self._plan.levels) and math.isfinite(x_m) and math.isfinite(y_m)):
            return ""
        spaces = self._spaces.on(level)
        if spaces is None:
            return self._near(x_m, y_m, level)
        return (
            _on_a_way(spaces, x_m, y_m)
            or _in_an_outline(spaces, x_m, y_m)
            or self._in_a_face(spaces, x_m, y_m, level)
            or self._by_a_door(spaces, x_m, y_m)
            or self._near(x_m, y_m, level)
        )

    def _in_a_face(self, spaces: Spaces, x_m: float, y_m: float, level: int) -> str:
        """By the walls around the position: the room in them. Of several rooms the nearest one that is in sight counts."""
        face = spaces.face_at(x_m, y_m)
        if face == OUTSIDE:
            return "outside the building" if spaces.enclosed else ""
        rooms = spaces.names.get(face, [])
        if len(rooms) == 1:
            return f"in {rooms[0].name}"
        for room in _by_distance(rooms, x_m, y_m):
            if is_clear(self._plan.levels[level].solid, (x_m, y_m), room.at_m):
                return f"in {room.name}"
        return f"near {_by_distance(rooms, x_m, y_m)[0].name}" if rooms else ""

    def _by_a_door(self, spaces: Spaces, x_m: float, y_m: float) -> str:
        """The nearest door that leads from the space around the position into a room; in a corridor only when it is near."""
        face, corridor = spaces.face_at(x_m, y_m), ""
        if spaces.is_corridor(face):
            corridor = "in the corridor"
        doors = [
            (shapely.LineString((door.line[:2], door.line[2:])).distance(shapely.Point(x_m, y_m)), name)
            for door, a, b in spaces.doors
            if face in (a, b) and (name := _room_of_face(spaces, b if a == face else a))
        ]
        if not doors:
            return corridor
        away_m, name = min(doors)
        if corridor and away_m > BY_M:
            return corridor
        return f"{corridor}{', ' if corridor else ''}by the door of {name}"

    def _near(self, x_m: float, y_m: float, level: int) -> str:
        """The nearest room of the level by its position."""
        rooms = _by_distance(self._plan.levels[level].rooms, x_m, y_m)
        return f"near {rooms[0].name}" if rooms else ""


def _on_a_way(spaces: Spaces, x_m: float, y_m: float) -> str:
    """Stairs, lift or ramp under the position."""
    for way, area in zip(spaces.ways, spaces.way_areas, strict=True):
        if area.intersects(shapely.Point(x_m, y_m)):
            return f"{ON_OR_IN[way.kind]} {way.name or 'the ' + way.kind}"
    return ""


def _in_an_outline(spaces: Spaces, x_m: float, y_m: float) -> str:
    """The smallest outline of a room around the position."""
    point = shapely.Point(x_m, y_m)
    pairs = zip(spaces.outlines, spaces.outlined, strict=True)
    names = {float(area.area): room.name for area, room in pairs if area.intersects(point)}
    return f"in {names[min(names)]}" if names else ""


def _room_of_face(spaces: Spaces, face: int) -> str:
    """Name of the one room in a face, or empty."""
    rooms = spaces.names.get(face, [])
    if len(rooms) == 1:
        return rooms[0].name
    if face == OUTSIDE or not len(spaces.outlines):
        return ""
    middle = spaces.faces.areas[face].representative_point()
    return _in_an_outline(spaces, middle.x, middle.y).removeprefix("in ")


def _by_distance(rooms: Sequence[Room], x_m: float, y_m: float) -> list[Room]:
    return sorted(rooms, key=lambda room: math.dist(room.at_m, (x_m, y_m)))
