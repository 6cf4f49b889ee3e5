"""The spaces between the walls of a level, and which of them doors and stairs join.

In: a `Plan`. Out: `Faces` of each level, and groups of faces that one can walk between. Owns nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from echostep.arrays import Floats
from echostep.plan.model import Door, Level, Plan

TOUCH_M = 0.01  # walls so near to each other meet
JAMB_M = 0.1  # a door's end is so near to a wall
BESIDE_M = 0.1  # in front of a door
SMALLEST_M2 = 0.02
OUTSIDE = -1
Face = tuple[int, int]  # level, number of the face (OUTSIDE for none)


@dataclass(frozen=True, slots=True)
class Faces:
    """The enclosed spaces of a level; doors are taken as closed."""

    areas: NDArray[np.object_]
    tree: shapely.STRtree

    def at(self, points: Floats) -> NDArray[np.intp]:
        """(n, 2) metres -> the face that each lies in, OUTSIDE when in none."""
        found = np.full(len(points), OUTSIDE, dtype=np.intp)
        which, face = (
            self.tree.query(shapely.points(points), predicate="intersects")
            if len(points)
            else np.zeros((2, 0), dtype=np.intp)
        )
        found[which] = face
        return found


def faces_of(level: Level) -> Faces:
    """Cut the level at its walls, windows, obstacles and doors."""
    doors = np.array([door.line for door in level.doors]).reshape(-1, 4)
    lines = np.concatenate((longer(level.solid, TOUCH_M), longer(doors, JAMB_M)))
    noded = shapely.union_all(shapely.linestrings(lines.reshape(-1, 2, 2))) if len(lines) else shapely.MultiLineString()
    areas = shapely.get_parts(shapely.polygonize(shapely.get_parts(noded)))
    areas = areas[shapely.area(areas) > SMALLEST_M2]
    return Faces(areas, shapely.STRtree(areas))


def longer(segments: Floats, by_m: float) -> Floats:
    """Segments with both ends pulled out."""
    along = segments[:, 2:] - segments[:, :2]
    along = along / np.hypot(*along.T)[:, None] * by_m
    return np.concatenate((segments[:, :2] - along, segments[:, 2:] + along), axis=1)


def groups(plan: Plan, faces: Sequence[Faces]) -> dict[Face, Face]:
    """For each face that a door or a way touches, the face that stands for all those that one can walk to from it."""
    leader: dict[Face, Face] = {}
    for i, level in enumerate(plan.levels):
        for a, b in both_sides(level.doors, faces[i]):
            _join(leader, (i, a), (i, b))
    for connector in plan.connectors:
        area = shapely.make_valid(shapely.Polygon(connector.outline_m))
        touched = [(i, face) for i in connector.levels for face in shared(area, faces[i])]
        for face in touched[1:]:
            _join(leader, touched[0], face)
    return {face: lead(leader, face) for face in list(leader)}


def lead(leader: dict[Face, Face], face: Face) -> Face:
    """The face that stands for its group."""
    while leader.get(face, face) != face:
        leader[face] = leader.get(leader[face], leader[face])
        face = leader[face]
    return face


def _join(leader: dict[Face, Face], one: Face, other: Face) -> None:
    a, b = lead(leader, one), lead(leader, other)
    leader.setdefault(a, a)
    leader.setdefault(b, b)
    leader[a] = b


def both_sides(doors: Sequence[Door], faces: Faces) -> list[tuple[int, int]]:
    """The faces in front of and behind each door."""
    sides = np.array([_beside(door) for door in doors]).reshape(-1, 2)
    found = faces.at(sides).reshape(-1, 2)
    return [(int(a), int(b)) for a, b in found]


def _beside(door: Door) -> tuple[tuple[float, float], tuple[float, float]]:
    x0, y0, x1, y1 = door.line
    x, y = (x0 + x1) / 2, (y0 + y1) / 2
    u, v = BESIDE_M * (y1 - y0) / math.dist((x0, y0), (x1, y1)), BESIDE_M * (x0 - x1) / math.dist((x0, y0), (x1, y1))
    return (x + u, y + v), (x - u, y - v)


def shared(area: BaseGeometry, faces: Faces) -> list[int]:
    """The faces that hold a tenth of a way's area or more; OUTSIDE when there is none."""
    near = faces.tree.query(area)
    held = [int(i) for i in near if faces.areas[i].intersection(area).area > 0.1 * area.area]
    return held or [OUTSIDE]
