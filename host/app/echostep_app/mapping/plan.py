# SPDX-License-Identifier: MIT
"""A drawing as a plan like any other.

In: `Mapped`, the pose at which the walk began. Out: `Plan`. Owns nothing. The openings between walls are listed as doors; doors that the path leads
through are open, the state of the others is unknown.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import shapely

from echostep.arrays import Floats
from echostep.plan import Door, Level, Plan, Pose, is_no_plan
from echostep_app.mapping.graph.directions import right_angles_off
from echostep_app.mapping.mapper import Mapped
from echostep_app.mapping.stairs import connector, wells_of, with_wells
from echostep_app.mapping.walls.drawing import Drawing
from echostep_app.plan.places.gaps import door_gaps

LEAST_M = 0.1  # a shorter piece is not a wall
ROUND = 3  # digits of a metre
# The first heading is the course of this much of the path, or of its straight part from LEAST_COURSE_M on: ratio of chord to length of the path,
# which is 4 degrees about its course
COURSE_M, LEAST_COURSE_M, STRAIGHT = 4.0, 0.5, 0.998
COURSE_SD_RAD = math.radians(1.3)  # of that course: 32 simulated starts
SQUARE_RAD = math.radians(6.0)


Walked = tuple[tuple[Floats, ...], ...]  # of each level: the path (n, 2), or its pieces there
Moved = Callable[[Floats], Floats]  # points (n, 2) of the walk's own frame -> in the plan


def plan_of(mapped: Mapped, start: Pose, name: str) -> tuple[Plan, Walked]:
    """The plan with the first pose of the walk at `start`, and the paths walked on each level."""
    first = mapped.graph.pose[0]
    turn, is_square = _turn(mapped, start.heading_rad)
    c, s = math.cos(turn), math.sin(turn)
    turned = np.array([[c, -s], [s, c]])

    def moved(points: Floats) -> Floats:
        moved_points: Floats = (points - first[:2]) @ turned.T + [start.x_m, start.y_m]
        return moved_points

    return plan_in(mapped, moved, start, name, 0.0 if is_square else COURSE_SD_RAD)


def plan_in(mapped: Mapped, moved: Moved, start: Pose, name: str, turn_sd_rad: float = 0.0) -> tuple[Plan, Walked]:
    """The plan in the frame that `moved` leads to, and the paths walked on each level; heights are above the first level.

    `turn_sd_rad`: standard deviation of the frame's direction, beyond the error of the first 15 m of the path.
    """
    walk_levels, first_level = mapped.graph.levels, mapped.first_level
    heights = np.zeros(1) if walk_levels is None else walk_levels.height_m - walk_levels.height_m[first_level]
    wells = [] if walk_levels is None else wells_of(walk_levels, moved(mapped.graph.pose[:, :2]))
    walked = tuple(tuple(moved(path) for path in drawing.paths_m) for drawing in mapped.drawings)
    levels, lengths_m, variances = [], [], []
    for k, drawing in enumerate(mapped.drawings):
        level = _level(_turned(drawing, mapped, turn_sd_rad), moved, str(k - first_level), round(float(heights[k]), 1))
        levels.append(
            level if level.is_refused else with_wells(replace(level, doors=_doors(level, walked[k])), k, wells)
        )
        if not level.is_refused:
            every = drawing.all_walls
            every = every[_length_m(every) > LEAST_M]
            lengths_m += _length_m(every).tolist()
            variances += (every[:, 4] ** 2).tolist()
    sd = round(math.sqrt(float(np.average(variances, weights=lengths_m))), ROUND) if variances else None
    connectors = tuple(connector(well, number) for number, well in enumerate(wells, 1))
    plan = Plan(name, tuple(levels), replace(start, level=first_level), "", connectors, uncertainty_m=sd)
    return plan, walked


def _turned(drawing: Drawing, mapped: Mapped, turn_sd_rad: float) -> Drawing:
    """The drawing in a frame whose direction has this standard deviation; all of it is doubtful if it is then not a plan."""
    x, y, sd_m = drawing.place_sd.T
    away_m = np.hypot(x - mapped.graph.pose[0, 0], y - mapped.graph.pose[0, 1])
    place_sd = np.column_stack([x, y, np.hypot(sd_m, turn_sd_rad * away_m)])
    if not is_no_plan(place_sd):
        return replace(drawing, place_sd=place_sd)
    every, none = drawing.all_walls, np.zeros((0, 4))
    return replace(
        drawing, walls=none, sd_m=none[:, 0], doubtful=every[:, :4], doubtful_sd_m=every[:, 4], place_sd=place_sd
    )


def _level(drawing: Drawing, moved: Moved, name: str, height_m: float) -> Level:
    """A drawn level in the frame of the plan."""
    walls, doubtful = (_long(moved(rows.reshape(-1, 2)).reshape(-1, 4)) for rows in (drawing.walls, drawing.doubtful))
    places: Floats = np.column_stack([moved(drawing.place_sd[:, :2]), drawing.place_sd[:, 2]])
    return Level(name, height_m, walls, doubtful=doubtful, place_sd=places.round(ROUND))


def _long(walls: Floats) -> Floats:
    """Segments (n, 4), rounded, without too short ones."""
    rounded = np.round(walls, ROUND)
    return rounded[_length_m(rounded) > LEAST_M]


def _length_m(walls: Floats) -> Floats:
    """Length (n,) of segments."""
    lengths: Floats = np.hypot(*(walls[:, 2:4] - walls[:, :2]).T)
    return lengths


def _turn(mapped: Mapped, heading_rad: float) -> tuple[float, bool]:
    """Turn of the map so that the first metres lead to where the wearer looked, and walls within SQUARE_RAD of the axes are parallel to them; whether
    they are.

    At the first step the direction of the toe is not estimated yet.
    """
    graph = mapped.graph
    turn = heading_rad - _first_course(graph.pose, graph.nodes.way_m)
    if graph.base_rad is None:
        return turn, False
    off = right_angles_off(graph.base_rad + turn)
    is_square = abs(off) < SQUARE_RAD
    return turn - (off if is_square else 0.0), is_square


def _first_course(pose: Floats, way_m: Floats) -> float:
    """Direction of the straight beginning of a path (n, 3); else the first heading.

    The first stride leads to where the wearer looks, whatever the toe's heading is in it.
    """
    for k in range(min(int(np.searchsorted(way_m, COURSE_M)), len(pose) - 1), 0, -1):
        dx, dy = pose[k, :2] - pose[0, :2]
        if way_m[k] > LEAST_COURSE_M and math.hypot(dx, dy) > STRAIGHT * way_m[k]:
            return math.atan2(dy, dx)
    return float(pose[0, 2])


def _doors(level: Level, paths: tuple[Floats, ...]) -> tuple[Door, ...]:
    """The openings of a level, open where the paths (n, 2) lead through."""
    walked = shapely.MultiLineString([path for path in paths if len(path) > 1])
    return tuple(
        replace(door, state="open") if shapely.LineString((door.line[:2], door.line[2:])).intersects(walked) else door
        for door in door_gaps(replace(level, walls=level.heard))
    )
