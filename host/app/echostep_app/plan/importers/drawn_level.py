# SPDX-License-Identifier: MIT
"""The shapes of one level as they are drawn -> a `Level`.

In: shapes of walls, windows, doors, obstacles, rooms and stairs, in map metres. Out: `Level`. Owns nothing. A wall with a thickness becomes both its
faces and its ends, because these reflect echoes; a wall drawn as one line stays one line, with gaps at the doors.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
import shapely
from shapely.geometry import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from echostep.arrays import Floats
from echostep.plan import ConnectorKind, Door, Level, Question, Room
from echostep_app.plan.importers.straight import merge_collinear

# All assumed:
CLOSE_M = 0.01  # half the width of the widest crack between two pieces of a wall that is closed
FLAT_M = 0.005  # greatest distance of a curve from the straight pieces that replace it
SLIVER_M2 = 1e-3  # smaller areas are dropped
GRID_M = 1e-3  # rounding step of coordinates
ACROSS_M = 3e-3  # a line across a door's end and nearer than this is the jamb: coordinates are rounded to a third
HALF_CUT_M = 0.05  # half the width of the strip along a door in which walls drawn as lines are cut
TOUCH_M = 2e-3  # a face nearer to a wall than this belongs to the wall, not to a window
FLECK_M = 0.02  # shorter pieces of window count as wall


@dataclass(slots=True)
class ConnectorShape:
    """The shape of stairs, a lift or a ramp on one level; `levels`: all levels that it reaches, where the drawing states them."""

    kind: ConnectorKind
    name: str
    area: Polygon
    levels: tuple[int, ...] = ()


@dataclass(slots=True)
class DrawnLevel:
    """The shapes of one level."""

    name: str
    height_m: float
    walls: list[BaseGeometry] = field(default_factory=list)
    windows: list[BaseGeometry] = field(default_factory=list)
    filled: list[Polygon] = field(default_factory=list)  # without access: shafts, cores
    doors: list[Door] = field(default_factory=list)
    obstacles: list[Polygon] = field(default_factory=list)
    rooms: list[Room] = field(default_factory=list)
    connectors: list[ConnectorShape] = field(default_factory=list)
    # Where walls drawn as lines are cut, besides the doors' lines
    cuts: list[BaseGeometry] = field(default_factory=list)
    questions: list[Question] = field(default_factory=list)

    def level(self) -> Level:
        """These shapes as a level of a plan; coordinates are rounded to a millimetre."""
        wall_faces, window_faces = _faces([*self.walls, *self.filled], self.windows)
        return Level(
            self.name,
            self.height_m,
            walls=merge_collinear(np.concatenate((wall_faces, self._lines(self.walls)))),
            rooms=tuple(self.rooms),
            doors=tuple(self.doors),
            windows=merge_collinear(np.concatenate((window_faces, self._lines(self.windows)))),
            obstacles=tuple(corners for area in self.obstacles if len(corners := ring(area)) > 2),
            questions=tuple(self.questions),
        )

    def _lines(self, shapes: Iterable[BaseGeometry]) -> Floats:
        """Segments (n, 4) of the shapes that are lines, cut at the doors."""
        lines = [part for part in pieces(shapes) if isinstance(part, LineString)]
        if not lines:
            return np.zeros((0, 4))
        doors = [LineString([door.line[:2], door.line[2:]]) for door in self.doors]
        openings = [door.buffer(HALF_CUT_M, cap_style="flat") for door in doors] + self.cuts
        jambs = [_across(door) for door in doors] + [LineString() for _ in self.cuts]
        tree = shapely.STRtree(openings)
        near = [tree.query(line) for line in lines]
        return _segments(
            cut(line, [openings[i] for i in which], [jambs[i] for i in which])
            for line, which in zip(lines, near, strict=True)
        )


def cut(line: BaseGeometry, openings: list[BaseGeometry], jambs: list[BaseGeometry]) -> BaseGeometry:
    """A line without its parts inside the openings; pieces across a door's end, such as jambs, stay."""
    if not openings:
        return line
    across = pieces([line.intersection(shapely.union_all(jambs))])
    # A third of this length of a line along the door is inside
    kept = [part for part in across if part.length > 6.0 * ACROSS_M]
    return joined(shapely.union_all([line.difference(shapely.union_all(openings)), *kept]))


def _across(door: LineString) -> BaseGeometry:
    """The two narrow strips across the ends of a door's line: as wide as the rounding of coordinates."""
    (x0, y0), (x1, y1) = door.coords
    u, v = HALF_CUT_M * (y0 - y1) / door.length, HALF_CUT_M * (x1 - x0) / door.length
    ends = [LineString([(x - u, y - v), (x + u, y + v)]) for x, y in ((x0, y0), (x1, y1))]
    return shapely.MultiPolygon([end.buffer(ACROSS_M, cap_style="flat") for end in ends])


def pieces(shapes: Iterable[BaseGeometry]) -> list[BaseGeometry]:
    """The lines and areas inside collections; empty ones are dropped."""
    parts = (part for shape in shapes for part in shapely.get_parts(shape, return_index=False))
    flat = [inner for part in parts for inner in (pieces(part.geoms) if hasattr(part, "geoms") else [part])]
    return [part for part in flat if not part.is_empty]


def areas(shapes: Iterable[BaseGeometry]) -> list[Polygon]:
    """The areas among the shapes, made valid, without slivers."""
    sound = (part if part.is_valid else shapely.make_valid(part) for part in pieces(shapes))
    return [part for part in pieces(sound) if isinstance(part, Polygon) and part.area > SLIVER_M2]


def ring(area: Polygon) -> Floats:
    """Outer corners of an area, (n, 2), the first not repeated, rounded to a millimetre."""
    corners = np.asarray(area.simplify(FLAT_M).exterior.coords)[:-1, :2].round(3)
    return corners[(corners != np.roll(corners, 1, axis=0)).any(1)]


def room(name: str, area: Polygon) -> Room:
    """A room with its outline; its position is a point inside the area."""
    inside = area.representative_point()
    return Room(name, (round(inside.x, 3), round(inside.y, 3)), ring(area))


def opening(area: Polygon) -> tuple[float, float, float, float]:
    """The line along the middle of a door's area, from jamb to jamb."""
    box = np.asarray(area.minimum_rotated_rectangle.exterior.coords)[:4, :2]
    if np.linalg.norm(box[1] - box[0]) < np.linalg.norm(box[2] - box[1]):
        box = np.roll(box, -1, axis=0)
    x0, y0 = (box[0] + box[3]) / 2
    x1, y1 = (box[1] + box[2]) / 2
    return round(float(x0), 3), round(float(y0), 3), round(float(x1), 3), round(float(y1), 3)


def _faces(walls: Iterable[BaseGeometry], windows: Iterable[BaseGeometry]) -> tuple[Floats, Floats]:
    """Segments (n, 4) of the faces of walls, and of the faces of windows where no wall covers them."""
    stone, glass = _solid(areas(walls)), _solid(areas(windows))
    both = _solid(pieces([stone, glass]))
    outside = shapely.union_all([part.boundary for part in pieces([both])])
    stone_faces, glass_faces = outside, LineString()
    if not glass.is_empty:
        near = stone.buffer(TOUCH_M)
        bits = pieces([joined(outside.difference(near))])
        glass_faces = shapely.union_all([bit for bit in bits if bit.length > FLECK_M])
        flecks = [bit for bit in bits if bit.length <= FLECK_M]
        stone_faces = shapely.union_all([outside.intersection(near), *flecks])
    return _segments([joined(stone_faces)]), _segments([joined(glass_faces)])


def joined(lines: BaseGeometry) -> BaseGeometry:
    """Merge lines that continue each other."""
    return lines if lines.is_empty or isinstance(lines, LineString) else shapely.line_merge(lines)


def _solid(parts: list[BaseGeometry]) -> BaseGeometry:
    """The union of areas, without cracks and slivers."""
    if not parts:
        return Polygon()
    one = shapely.union_all(parts, grid_size=GRID_M)
    closed = one.buffer(CLOSE_M, join_style="mitre").buffer(-CLOSE_M, join_style="mitre")
    return shapely.union_all([area for area in pieces([closed]) if area.area > SLIVER_M2])


def _segments(lines: Iterable[BaseGeometry]) -> Floats:
    """The straight pieces (n, 4) of lines, rounded to a millimetre; curves are simplified within `FLAT_M`."""
    rows = [np.zeros((0, 4))]
    for line in pieces(lines):
        points = np.asarray(line.simplify(FLAT_M).coords)[:, :2].round(3)
        rows.append(np.concatenate((points[:-1], points[1:]), axis=1))
    segments = np.concatenate(rows)
    return segments[(segments[:, :2] != segments[:, 2:]).any(1)]
