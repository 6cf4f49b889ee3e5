# SPDX-License-Identifier: MIT
"""Doors of a given width where a source has none: an assumption, and named so.

In: areas of rooms and of corridors in map metres, points of openings. Out: `Door`s. Owns nothing.
A room without an opening gets a door in the middle of the longest straight piece of wall that it shares with a corridor, else with a room that has a
door already. Rooms drawn with the thickness of the wall between them get one in each face.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import shapely
from shapely.geometry import LineString, Point, Polygon

from echostep.arrays import Floats
from echostep.plan import Door

ASSUMED = "assumed"  # name of such a door
THICKEST_M = 0.6  # greatest distance of neighbours: the thickness of a wall; assumed
FLANK_M = 0.05  # of wall left beside a door; assumed
ONE_LINE_M = 0.05  # nearer faces are one wall: half the width in which a door cuts a wall drawn as a line


def doors_of_rooms(
    rooms: Sequence[Polygon], ways: Sequence[Polygon], opened: Sequence[Polygon], width_m: float
) -> list[Door]:
    """Doors of `rooms` without an opening, to `ways` without walls or to rooms that have a door: `opened`, or an earlier room."""
    doors: list[Door] = []
    closed = _with_doors(list(rooms), list(ways), {}, width_m, doors)
    reached = [*opened, *(room for room in rooms if all(room is not other for other in closed))]
    while closed and reached:
        walls = {id(area): area.exterior for area in reached}
        left = _with_doors(closed, reached, walls, width_m, doors)
        reached = [room for room in closed if all(room is not other for other in left)]
        closed = left
    return doors


def _with_doors(
    closed: list[Polygon], reached: list[Polygon], walls: dict[int, LineString], width_m: float, doors: list[Door]
) -> list[Polygon]:
    """Add a door to each closed room that shares enough wall with a reached area; returns the rooms that share none.

    `walls`: boundary by id of the reached areas that have walls of their own.
    """
    if not reached:
        return closed
    tree, left = shapely.STRtree(reached), []
    for room in closed:
        near = [reached[k] for k in sorted(tree.query(room, predicate="dwithin", distance=THICKEST_M).tolist())]
        pieces = [
            (piece, other) for other in near for piece in _straight(room.exterior, other) if _fits(piece, width_m)
        ]
        if not pieces:
            left.append(room)
            continue
        piece, other = max(pieces, key=lambda pair: float(np.hypot(*(pair[0][2:] - pair[0][:2]))))
        middle = (piece[:2] + piece[2:]) / 2
        doors.append(_door(piece, middle, width_m))
        wall = walls.get(id(other))
        if wall is not None and wall.distance(Point(middle)) > ONE_LINE_M:
            doors += _doors_at(Point(middle), [wall], width_m, THICKEST_M)
    return left


def doors_at(point: Point, walls: Sequence[LineString], width_m: float, within_m: float) -> list[Door]:
    """A door at an opening that is drawn as a point, in each of the walls (boundaries) near it."""
    near = [wall for wall in walls if wall.distance(point) < within_m]
    doors = _doors_at(point, near, width_m, within_m)
    lines = [LineString((door.line[:2], door.line[2:])) for door in doors]
    alone = (all(line.distance(other) > ONE_LINE_M for other in lines[:k]) for k, line in enumerate(lines))
    return [door for door, is_alone in zip(doors, alone, strict=True) if is_alone]


def _doors_at(point: Point, walls: Sequence[LineString], width_m: float, within_m: float) -> list[Door]:
    """A door in each wall, in the straight piece that is nearest to the point and long enough."""
    doors = []
    for wall in walls:
        pieces = [piece for piece in _segments(np.asarray(wall.coords)) if _fits(piece, width_m)]
        lines = [LineString(piece.reshape(2, 2)) for piece in pieces]
        distances = [line.distance(point) for line in lines]
        if distances and min(distances) < within_m:
            nearest = int(np.argmin(distances))
            at = np.asarray(lines[nearest].interpolate(lines[nearest].project(point)).coords[0])
            doors.append(_door(pieces[nearest], at, width_m))
    return doors


def _straight(boundary: LineString, other: Polygon) -> Iterator[Floats]:
    """The straight pieces (4,) of a boundary that run along another area."""
    about = other.buffer(THICKEST_M, cap_style="flat", join_style="mitre")
    for segment in _segments(np.asarray(boundary.coords)):
        for part in shapely.get_parts(LineString(segment.reshape(2, 2)).intersection(about)):
            if isinstance(part, LineString) and not part.is_empty:
                yield _facing(np.asarray(part.coords[:2]).ravel(), other)


def _facing(piece: Floats, other: Polygon) -> Floats:
    """The part of a piece (4,) that lies between the ends of the other area, seen along the piece: not round its corner."""
    begin, step = piece[:2], piece[2:] - piece[:2]
    band = LineString(piece.reshape(2, 2)).buffer(THICKEST_M + ONE_LINE_M, cap_style="flat")
    corners = shapely.get_coordinates(other.exterior.intersection(band))
    if not len(corners) or not step.any():
        return np.concatenate((begin, begin))
    share = np.clip((corners - begin) @ step / (step @ step), 0.0, 1.0)
    return np.concatenate((begin + share.min() * step, begin + share.max() * step))


def _segments(points: Floats) -> Floats:
    """The segments (n, 4) between points (n + 1, 2)."""
    return np.concatenate((points[:-1, :2], points[1:, :2]), axis=1)


def _fits(piece: Floats, width_m: float) -> bool:
    return bool(np.hypot(*(piece[2:] - piece[:2])) >= width_m + 2 * FLANK_M)


def _door(piece: Floats, at: Floats, width_m: float) -> Door:
    """A door in a straight piece (4,) of wall, as near to the point (2,) as its ends allow."""
    length = float(np.hypot(*(piece[2:] - piece[:2])))
    along = (piece[2:] - piece[:2]) / length
    middle = min(max(float((at - piece[:2]) @ along), width_m / 2 + FLANK_M), length - width_m / 2 - FLANK_M)
    (x0, y0), (x1, y1) = (piece[:2] + (middle + side * width_m / 2) * along for side in (-1, 1))
    return Door(
        (round(float(x0), 3), round(float(y0), 3), round(float(x1), 3), round(float(y1), 3)), "unknown", ASSUMED
    )
