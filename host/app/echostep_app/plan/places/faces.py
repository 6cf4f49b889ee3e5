# SPDX-License-Identifier: MIT
"""Faces: the enclosed spaces of a level, and which of them doors and stairs connect.

In: a `Plan`. Out: `Faces` of each level, and groups of connected faces. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from echostep.arrays import Floats
from echostep.plan import Door, Level, Plan

# Assumed:
TOUCH_M = 0.01  # walls with a smaller distance touch
JAMB_M = 0.1  # greatest distance of a door's end from its wall
BESIDE_M = 0.1  # distance from a door at which the faces on its two sides are looked up
CLEAR_M = 0.2  # on both sides of a door, no wall runs along it
SMALLEST_M2 = 0.02  # smaller faces are slivers
OUTSIDE = -1
Face = tuple[int, int]  # index of the level, index of the face (or OUTSIDE)


@dataclass(frozen=True, slots=True)
class Faces:
    """The enclosed spaces of a level with all doors closed: polygons (n,) and an index of them."""

    areas: NDArray[np.object_]
    tree: shapely.STRtree

    def indices_of(self, points: Floats) -> NDArray[np.intp]:
        """Points (n, 2) in metres -> (n,) index of the face around each, or OUTSIDE."""
        indices = np.full(len(points), OUTSIDE, dtype=np.intp)
        which, face = self.tree.query(shapely.points(points), predicate="intersects")
        indices[which] = face
        return indices


def find_faces(level: Level) -> Faces:
    """The faces between the walls, windows, obstacles and doors of a level."""
    doors = np.array([door.line for door in level.doors]).reshape(-1, 4)
    lines = np.concatenate((extend(level.solid, TOUCH_M), extend(doors, JAMB_M), _ticks(doors)))
    noded = shapely.union_all(shapely.linestrings(lines.reshape(-1, 2, 2))) if len(lines) else shapely.MultiLineString()
    areas = shapely.get_parts(shapely.polygonize(shapely.get_parts(noded)))
    areas = areas[shapely.area(areas) > SMALLEST_M2]
    return Faces(areas, shapely.STRtree(areas))


def extend(segments: Floats, by_m: float) -> Floats:
    """Segments (n, 4), each made longer by `by_m` at both ends."""
    along = segments[:, 2:] - segments[:, :2]
    along = along / np.hypot(*along.T)[:, None] * by_m
    return np.concatenate((segments[:, :2] - along, segments[:, 2:] + along), axis=1)


def _ticks(doors: Floats) -> Floats:
    """Short lines across both ends of doors (n, 4) -> (2n, 4): a wall that continues a door may be off its line by rounding."""
    along = doors[:, 2:] - doors[:, :2]
    across = (along / np.hypot(*along.T)[:, None] * TOUCH_M)[:, ::-1] * (-1.0, 1.0)
    ends = (doors[:, :2], doors[:, 2:])
    return np.concatenate([np.concatenate((end - across, end + across), axis=1) for end in ends])


def connected_groups(plan: Plan, faces: Sequence[Faces]) -> dict[Face, Face]:
    """For each face with a door or a connector: the representative of its connected group (union-find)."""
    leader: dict[Face, Face] = {}
    for i, level in enumerate(plan.levels):
        for a, b in door_faces(level.doors, faces[i]):
            _join(leader, (i, a), (i, b))
    for connector in plan.connectors:
        area = shapely.make_valid(shapely.Polygon(connector.outline_m))
        touched = [(i, face) for i in connector.levels for face in faces_under(area, faces[i])]
        for face in touched[1:]:
            _join(leader, touched[0], face)
    return {face: leader_of(leader, face) for face in list(leader)}


def leader_of(leader: dict[Face, Face], face: Face) -> Face:
    """The representative of a face's group; shortens the chain on the way."""
    while leader.get(face, face) != face:
        leader[face] = leader.get(leader[face], leader[face])
        face = leader[face]
    return face


def _join(leader: dict[Face, Face], one: Face, other: Face) -> None:
    a, b = leader_of(leader, one), leader_of(leader, other)
    leader.setdefault(a, a)
    leader.setdefault(b, b)
    leader[a] = b


def door_faces(doors: Sequence[Door], faces: Faces) -> list[tuple[int, int]]:
    """The two faces that each door separates."""
    sides = np.array([beside(door) for door in doors]).reshape(-1, 2)
    pairs = faces.indices_of(sides).reshape(-1, 2)
    return [(int(a), int(b)) for a, b in pairs]


def beside(door: Door, by_m: float = BESIDE_M) -> tuple[tuple[float, float], tuple[float, float]]:
    """The points `by_m` from a door's middle, on its two sides."""
    (x0, y0, x1, y1), (x, y) = door.line, door.middle_m
    u, v = (by_m * d / door.width_m for d in (y1 - y0, x0 - x1))
    return (x + u, y + v), (x - u, y - v)


def is_walled(door: Door, walls: shapely.STRtree) -> bool:
    """Whether a wall runs through a door, or along it so near that the door is blocked."""
    line = shapely.LineString((door.line[:2], door.line[2:]))
    inner = shapely.LineString([line.interpolate(share, normalized=True) for share in (0.2, 0.8)])
    ways = (inner, shapely.LineString(beside(door, CLEAR_M)))
    return any(len(walls.query(way, predicate="dwithin", distance=TOUCH_M)) for way in ways)


def faces_under(area: BaseGeometry, faces: Faces) -> list[int]:
    """The faces that contain more than a tenth of a connector's area, or OUTSIDE."""
    near = faces.tree.query(area)
    held = [int(i) for i in near if faces.areas[i].intersection(area).area > 0.1 * area.area]
    return held or [OUTSIDE]
