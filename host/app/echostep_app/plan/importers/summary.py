# SPDX-License-Identifier: MIT
"""The summary of an import in at most twelve lines: elements imported, elements left out, doubts.

In: a `Plan`, its `ImportReport`. Out: lines. Owns how many there are of each.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np
import shapely

from echostep.arrays import Floats
from echostep.plan import Door, Level, Plan
from echostep_app.plan.cropping import extent
from echostep_app.plan.importers.report import ImportReport
from echostep_app.plan.places.faces import is_walled
from echostep_app.plan.places.gaps import door_gaps

MOST_LINES = 12
MOST_LEVELS, MOST_DOUBTS = 5, 4  # lines on levels, and on doubts; more of them are counted
MOST_NAMES = 6  # kinds and layers in one line
AT_WALL_M = 0.15  # greatest distance of both ends of a door from a wall: issue 44's bound for a door in a gap
SIZES_M, DOORS_M = (2.5, 1500.0), (0.5, 3.0)  # plausible sizes of a level, and of half of the doors; assumed
ASKEW = 1e-3  # of walls that are drawn at right angles, at most: a degree; assumed


def summary(plan: Plan, report: ImportReport) -> list[str]:
    """Fewer than `MOST_LINES` lines: the caller adds one on the files written."""
    lines = [_level(level) for level in plan.levels[:MOST_LEVELS]]
    if len(plan.levels) > MOST_LEVELS:
        more = plan.levels[MOST_LEVELS:]
        lines.append(
            f"... and {len(more)} levels more: {sum(len(level.walls) for level in more)} walls, "
            f"{sum(len(level.doors) for level in more)} doors, {sum(len(level.rooms) for level in more)} rooms"
        )
    facts = [f"units: {report.units}"] if report.units else []
    facts = [_connectors(plan), *facts] if len(plan.levels) > 1 else facts
    if (earth := plan.georeference) is not None:
        facts.append(f"at latitude {earth.latitude_deg:.4f}, longitude {earth.longitude_deg:.4f}")
    lines += ["; ".join(facts)] if facts else []
    if report.layers:
        lines.append("layers: " + "; ".join(f"{kind}: {_some(names)}" for kind, names in report.layers.items()))
    if report.left_out:
        lines.append("left out: " + _counted(report.left_out))
    doubts = [*report.doubts, *_implausible(plan), *_without_doors(plan, report.doors_remedy)]
    shown = max(0, min(MOST_DOUBTS, MOST_LINES - len(lines) - 2))
    lines += [f"note: {doubt}" for doubt in doubts[:shown]]
    if len(doubts) > shown:
        lines.append(f"note: {len(doubts) - shown} more: " + "; ".join(doubts[shown:])[:300])
    return lines


def doors_in_gaps(level: Level) -> int:
    """The number of doors that lie in a gap of a wall: both ends at a wall or at the next door, the way through free."""
    solid = level.solid
    tree = shapely.STRtree(shapely.linestrings(solid.reshape(-1, 2, 2))) if len(solid) else None
    return 0 if tree is None else sum(_in_gap(door, tree, level.doors) for door in level.doors)


def _in_gap(door: Door, tree: shapely.STRtree, doors: Sequence[Door]) -> bool:
    ends = shapely.points(np.array(door.line).reshape(2, 2))
    at_wall = [len(tree.query(end, predicate="dwithin", distance=AT_WALL_M)) > 0 for end in ends]
    if not all(at_wall):
        others = [shapely.LineString((other.line[:2], other.line[2:])) for other in doors if other is not door]
        beside = shapely.union_all(others)
        at_wall = [one or beside.distance(end) < AT_WALL_M for one, end in zip(at_wall, ends, strict=True)]
    return all(at_wall) and not is_walled(door, tree)


def size_m(level: Level) -> tuple[float, float]:
    """Width and height of the rectangle around a level's walls and windows."""
    drawn = np.concatenate((level.walls, level.windows))
    x0, y0, x1, y1 = extent(drawn)
    return (x1 - x0, y1 - y0) if len(drawn) else (0.0, 0.0)


def _level(level: Level) -> str:
    wide, high = size_m(level)
    length_m = float(np.hypot(*(level.walls[:, 2:] - level.walls[:, :2]).T).sum())
    parts = [_plural(len(level.walls), "wall") + f" ({length_m:.0f} m)"]
    if len(level.windows):
        parts.append(_plural(len(level.windows), "window"))
    doors = _plural(len(level.doors), "door")
    parts.append(doors + (f" ({doors_in_gaps(level)} in a gap of a wall)" if level.doors else ""))
    if not level.doors:
        parts.append(_plural(len(door_gaps(level)), "gap") + " that people can pass")
    parts.append(_plural(len(level.rooms), "room"))
    return f"{level.name}, {level.height_m:g} m: {wide:.4g} x {high:.4g} m, {', '.join(parts)}"


def _connectors(plan: Plan) -> str:
    counts: Counter[str] = Counter(connector.kind for connector in plan.connectors)
    words = {"stairs": "stairs", "lift": "lifts", "ramp": "ramps"}
    found = [f"{counts[kind]} {word}" for kind, word in words.items() if counts[kind]]
    return (", ".join(found) or "no stairs, lifts or ramps") + " between levels"


def _implausible(plan: Plan) -> list[str]:
    """Implausible sizes: levels smaller than a room or larger than a campus, doors too narrow to pass or as wide as gates."""
    said = []
    for level in plan.levels:
        if len(level.walls) and not SIZES_M[0] <= max(size_m(level)) <= SIZES_M[1]:
            said.append(f"{level.name} is {max(size_m(level)):.3g} m long: is the scale right?")
    widths = [door.width_m for level in plan.levels for door in level.doors]
    if widths and not DOORS_M[0] <= (middle := float(np.median(widths))) <= DOORS_M[1]:
        said.append(
            f"half of the doors are {middle:.2f} m wide or {'less' if middle < 1 else 'more'}: is the scale right?"
        )
    return [*said[:3], *_exchanged(plan)]


def _exchanged(plan: Plan) -> list[str]:
    """One sentence when the walls are at right angles only where longitude and latitude are exchanged."""
    if (earth := plan.georeference) is None or not (walls := plan.levels[0].walls).size:
        return []
    c, s = math.cos(earth.rotation_rad), math.sin(earth.rotation_rad)
    east, north = np.array([[c, -s], [s, c]]) @ (walls[:, 2:] - walls[:, :2]).T
    lon, lat = math.radians(earth.longitude_deg), math.radians(earth.latitude_deg)
    own, other = _askew(east, north), _askew(north * math.cos(lon), east / math.cos(lat))
    if own < ASKEW or other > 0.2 * own:
        return []
    return [
        f"its walls are at right angles only with longitude and latitude exchanged: is its latitude {earth.longitude_deg:.4f}?"
    ]


def _askew(east: Floats, north: Floats) -> float:
    """How far walls are from two directions at a right angle: 0 for a rectangle, 1 for all directions."""
    return 1.0 - float(
        abs(np.sum(np.hypot(east, north) * np.exp(4j * np.arctan2(north, east)))) / np.hypot(east, north).sum()
    )


def _without_doors(plan: Plan, remedy: str) -> list[str]:
    """One sentence when levels with rooms have neither doors nor gaps."""
    if not any(level.rooms or level.doors for level in plan.levels):
        return [
            "the source has neither door openings nor rooms: ways are the gaps in its walls; echostep plan edit draws doors"
        ]
    closed = [level.name for level in plan.levels if level.rooms and not level.doors and not door_gaps(level)]
    if not closed:
        return []
    where = "the source" if len(closed) == len(plan.levels) else f"the source of {', '.join(closed)[:100]}"
    return [f"{where} has no door openings, so its rooms cannot be entered: {remedy}"]


def _counted(counts: Mapping[str, int]) -> str:
    """The largest counts first; the rest is summed up."""
    common = Counter(counts).most_common()
    shown = ", ".join(f"{count} {what}" for what, count in common[:MOST_NAMES])
    rest = common[MOST_NAMES:]
    return shown + (f", {sum(count for _, count in rest)} of {len(rest)} other kinds" if rest else "")


def _some(names: Sequence[str]) -> str:
    return ", ".join(name[:40] for name in names[:MOST_NAMES]) + (
        f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
    )


def _plural(count: int, word: str) -> str:
    return f"{count} {word}" + ("" if count == 1 else "s")
