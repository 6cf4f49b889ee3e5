# SPDX-License-Identifier: MIT
"""Buildings to walk through: the paper's, and those that it could not handle.

In: a seed where a building has something random. Out: `SimulatedSite`: the plan, what is really built, and a route. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from echostep.arrays import Floats
from echostep_studies.simulation.marker_walk import STEP_M

Point = tuple[float, float]

DOOR_M = 0.9
THICK_M = 0.25
ROOM_X = (1.25, 5.0, 8.75)  # middle of the rooms, three steps apart
ROOM_W, ROOM_D = 3.25, 5.0
CORRIDOR = (-1.5, 11.5, 2.0)  # from x, to x, width


@dataclass(frozen=True, slots=True)
class SimulatedSite:
    """Walls (n, 4) on the plan, walls that are built, and a route (n, 2). `passers`: share of pings that a passer-by answers first."""

    name: str
    plan: Floats
    built: Floats
    route: Floats
    passers: float = 0.0


def otb() -> SimulatedSite:
    """[Girard 2011, Figure 9]: a corridor 2 m wide with three rooms of about 3 x 5 m; 26 steps around, twice."""
    walls = np.array(_otb_walls())
    return SimulatedSite("otb", walls, walls, np.array(_otb_route()))


def furnished(seed: int) -> SimulatedSite:
    """The paper's site with five pieces of furniture a room that the plan does not have, and passers-by: 20 % of the pings are short."""
    rng = np.random.default_rng([seed, 11])
    site = otb()
    return replace(site, name="furniture", built=np.vstack([site.built, *_furniture(rng)]), passers=0.2)


def with_doors(seed: int) -> SimulatedSite:
    """The paper's site with doors and with rooms across the corridor; what is open and closed has nothing to do with the plan.

    The route leads through three of the six doors, so these are open, their leaves swung into the rooms; each of the others is open at random.
    On the plan a door is a gap: half of the others differ from it, on average, and so do all leaves.
    """
    rng = np.random.default_rng([seed, 12])
    walls = np.array(_otb_walls(south=True))
    at = [(x, y) for y in (0.0, CORRIDOR[2]) for x in ROOM_X]
    is_open = np.array([*(rng.random(3) < 0.5), True, True, True])
    doors = np.array([(x - 0.5 * DOOR_M, y, x + 0.5 * DOOR_M, y) for x, y in at])
    leaves = np.array([_leaf(x, y) for x, y in at])
    built = np.vstack([walls, doors[~is_open], leaves[is_open]])
    return SimulatedSite("doors", walls, built, np.array(_otb_route()))


def hall() -> SimulatedSite:
    """A corridor, a hall of 15 x 20 m whose walls are out of range for most of the way, and the corridor again."""
    walls = [
        *_box(0.0, 0.0, 20.0, 15.0, gaps=[("left", 7.5, 2.0)]),
        (-20.0, 6.5, 0.0, 6.5), (-20.0, 8.5, 0.0, 8.5), (-20.0, 6.5, -20.0, 8.5),
        (-12.0, 6.5, -12.0, 6.7), (-6.0, 8.5, -6.0, 8.3),
    ]  # fmt: skip
    route = [(-18.0, 7.5), (7.0, 7.5), (13.25, 7.5), (13.25, 8.75), (7.0, 8.75), (7.0, 7.5), (-18.0, 7.5)]
    return SimulatedSite("hall", np.array(walls), np.array(walls), np.array(route))


def mistaken(seed: int) -> SimulatedSite:
    """The paper's site on a plan whose walls are 10 to 20 cm off, each its own way, and that lacks one wall."""
    rng = np.random.default_rng([seed, 13])
    site = otb()
    return replace(site, name="plan", plan=_moved(site.plan, rng))


def displaced(seed: int) -> SimulatedSite:
    """The paper's site on a plan that lies 10 to 20 cm beside the building."""
    rng = np.random.default_rng([seed, 14])
    angle, off = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(0.1, 0.2)
    site = otb()
    return replace(site, name="displaced", plan=site.plan + off * np.tile([np.cos(angle), np.sin(angle)], 2))


def parallel() -> SimulatedSite:
    """Corridors 4 m apart that look alike, joined at their ends."""
    walls = [*_box(0.0, 0.0, 30.0, 14.0)]
    for y in (2.0, 6.0, 10.0):
        walls += _box(2.0, y, 28.0, y + 2.0)
    route = [(1.0, 1.0), (28.5, 1.0), (28.5, 4.75), (1.0, 4.75), (1.0, 8.5), (28.5, 8.5)]
    return SimulatedSite("parallel", np.array(walls), np.array(walls), np.array(route))


def angled() -> SimulatedSite:
    """Rooms that are not rectangular, a corridor that bends, a round end."""
    bend = [(0.0, 0.0), (10.0, 0.0), (16.0, 6.0), (16.0, 14.0), (12.5, 15.5), (10.0, 13.0), (13.6, 11.5), (13.6, 7.0),
            (9.0, 2.4), (6.4, 2.4), (7.6, 7.5), (3.5, 8.5), (2.2, 5.5), (5.1, 2.4), (0.0, 2.4), (0.0, 0.0)]  # fmt: skip
    walls = [(*a, *b) for a, b in zip(bend, bend[1:], strict=False)]
    route = [
        (1.0, 1.2),
        (5.9, 1.2),
        (5.4, 5.6),
        (5.9, 1.2),
        (9.6, 1.2),
        (14.8, 6.5),
        (14.8, 12.8),
        (14.8, 6.5),
        (9.6, 1.2),
        (1.0, 1.2),
    ]
    return SimulatedSite("angles", np.array(walls), np.array(walls), np.array(route))


def thousand() -> SimulatedSite:
    """An office building of about 1,000 walls: corridors between rows of equal rooms."""
    walls: list[tuple[float, ...]] = []
    rows, rooms, wide = 8, 30, 3 * STEP_M
    end = rooms * wide
    for y in (7.0 * row for row in range(rows)):
        for k in range(rooms):
            x, door = wide * k, wide * (k + 0.5)
            walls += [(x, y + 2.0, door - 0.45, y + 2.0), (door + 0.45, y + 2.0, x + wide, y + 2.0)]
            walls += [(x, y + 2.0, x, y + 7.0), (x, y + 7.0, x + wide, y + 7.0)]
        walls.append((end, y + 2.0, end, y + 7.0))
    walls += _box(-2.0, 0.0, end + 2.0, 7.0 * rows + 2.0)
    a, b, c = (wide * (k + 0.5) for k in (9, 12, 20))
    route = [(a, 15.0), (b, 15.0), (b, 18.75), (b, 15.0), (c, 15.0), (c, 18.75), (c, 15.0), (b, 15.0)]
    return SimulatedSite("thousand", np.array(walls), np.array(walls), np.array(route))


def _otb_route() -> list[Point]:
    """The ten numbers of [Girard 2011, Figure 9], twice."""
    a, b, c = ROOM_X
    lap = [(a, 1.0 + 3 * STEP_M), (a, 1.0), (b, 1.0), (b, 1.0 + 2 * STEP_M), (b, 1.0), (c, 1.0), (c, 1.0 + 2 * STEP_M),
           (c, 1.0), (a, 1.0), (a, 1.0 + 3 * STEP_M)]  # fmt: skip
    return lap + lap[1:]


def _otb_walls(south: bool = False) -> list[tuple[float, ...]]:
    x0, x1, width = CORRIDOR
    walls: list[tuple[float, ...]] = [(x0, 0.0, x0, width), (x1, 0.0, x1, width)]
    sides = ((width, width + THICK_M, 1.0), (0.0, -THICK_M, -1.0)) if south else ((width, width + THICK_M, 1.0),)
    if not south:
        walls.append((x0, 0.0, x1, 0.0))
    for face, back, up in sides:
        start = x0
        for x in ROOM_X:
            a, b = x - 0.5 * DOOR_M, x + 0.5 * DOOR_M
            left, right, far = x - 0.5 * ROOM_W, x + 0.5 * ROOM_W, back + up * ROOM_D
            walls += [(start, face, a, face), (a, face, a, back), (b, face, b, back)]
            walls += [
                (left, back, a, back),
                (b, back, right, back),
                (left, back, left, far),
                (right, back, right, far),
                (left, far, right, far),
            ]
            start = b
        walls.append((start, face, x1, face))
    return walls


def _leaf(x: float, face: float) -> tuple[float, float, float, float]:
    """An open door, at a right angle in the room behind it."""
    hinge = x - 0.5 * DOOR_M
    back, up = (face + THICK_M, 1.0) if face > 0.0 else (face - THICK_M, -1.0)
    return (hinge, back, hinge, back + up * DOOR_M)


def _furniture(rng: np.random.Generator) -> list[Floats]:
    """Five boxes a room along its walls, clear of the way to its middle."""
    pieces = []
    for x in ROOM_X:
        low, high = np.array([x - 0.5 * ROOM_W, 2.0 + THICK_M]), np.array([x + 0.5 * ROOM_W, 2.0 + THICK_M + ROOM_D])
        for _ in range(5):
            size = np.array([rng.uniform(0.3, 0.8), rng.uniform(0.4, 1.4)])
            side = rng.integers(2)
            left = low[0] if side == 0 else high[0] - size[0]
            at = np.array([left, rng.uniform(low[1] + 0.2, high[1] - size[1])])
            pieces.append(np.array(_box(*at.tolist(), *(at + size).tolist())))
    return pieces


def _moved(walls: Floats, rng: np.random.Generator) -> Floats:
    """Every wall moved along its normal by 10 to 20 cm either way; one of the walls without a door is missing."""
    along = walls[:, 2:] - walls[:, :2]
    length = np.hypot(*along.T)
    off = rng.uniform(0.1, 0.2, len(walls)) * rng.choice([-1.0, 1.0], len(walls))
    normal = np.column_stack([-along[:, 1], along[:, 0]]) / length[:, None] * off[:, None]
    moved = walls + np.tile(normal, 2)
    return np.delete(moved, rng.choice(np.flatnonzero(length > 2.5)), axis=0)


def _box(
    x0: float, y0: float, x1: float, y1: float, gaps: Sequence[tuple[str, float, float]] = ()
) -> list[tuple[float, ...]]:
    """Four walls; a gap is (side, middle, width)."""
    sides = {"bottom": (x0, y0, x1, y0), "top": (x0, y1, x1, y1), "left": (x0, y0, x0, y1), "right": (x1, y0, x1, y1)}
    walls: list[tuple[float, ...]] = []
    for name, (ax, ay, bx, by) in sides.items():
        gap = next((g for g in gaps if g[0] == name), None)
        if gap is None:
            walls.append((ax, ay, bx, by))
        elif name in ("left", "right"):
            walls += [(ax, ay, ax, gap[1] - 0.5 * gap[2]), (ax, gap[1] + 0.5 * gap[2], ax, by)]
        else:
            walls += [(ax, ay, gap[1] - 0.5 * gap[2], ay), (gap[1] + 0.5 * gap[2], ay, bx, ay)]
    return walls
