# SPDX-License-Identifier: MIT
"""The simplest buildings, and a way up and down in each.

In: a seed. Out: `Site`: the building, and waypoints. Owns nothing. The way of a seed is shifted, so that no two walks are alike.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from echostep_studies.bench.sites import Site, plan_of

WALK_M = 70.0  # least length of a walk
PAUSE_S = 2.0  # at the ends of a way
SHIFT_M = 0.1  # standard deviation of a way from the middle of a corridor
DOOR_M = 0.9

Point = tuple[float, float]
Wall = tuple[float, float, float, float]


def _site(name: str, walls: Sequence[Wall], way: Sequence[Point], seed: int) -> Site:
    """Walls, and the way there and back until it is long enough, moved by a little."""
    shift = SHIFT_M * np.random.default_rng([seed, 76]).standard_normal(2)
    points = (np.array(way) + shift).tolist()
    length_m = float(np.hypot(*np.diff(np.array(way), axis=0).T).sum())
    is_lap = way[0] == way[-1]
    waypoints: list[tuple[float, ...]] = [(*points[0], PAUSE_S)]
    for k in range(max(int(np.ceil(WALK_M / length_m)), 1)):
        there = points[1:] if is_lap or k % 2 == 0 else points[-2::-1]
        waypoints += [*map(tuple, there[:-1]), (*there[-1], PAUSE_S)]
    return Site(plan_of(name, np.array(walls)), tuple(waypoints))  # type: ignore[arg-type]  # of two or three numbers


def _box(x0: float, y0: float, x1: float, y1: float) -> list[Wall]:
    return [(x0, y0, x1, y0), (x1, y0, x1, y1), (x1, y1, x0, y1), (x0, y1, x0, y0)]


def corridor(length_m: float, width_m: float, seed: int) -> Site:
    """A corridor with nothing else, walked in its middle from end to end."""
    middle = 0.5 * width_m
    return _site("corridor", _box(0.0, 0.0, length_m, width_m), [(1.0, middle), (length_m - 1.0, middle)], seed)


def open_corridor(seed: int) -> Site:
    """A corridor of 20 m that is open at both ends."""
    walls = [(0.0, 0.0, 20.0, 0.0), (0.0, 2.0, 20.0, 2.0)]
    return _site("open corridor", walls, [(2.0, 1.0), (18.0, 1.0)], seed)


def ell(seed: int) -> Site:
    """Two corridors at a right angle, 15 and 10 m long."""
    corners = [(0.0, 0.0), (15.0, 0.0), (15.0, 10.0), (13.0, 10.0), (13.0, 2.0), (0.0, 2.0)]
    walls = [(*a, *b) for a, b in zip(corners, [*corners[1:], corners[0]], strict=True)]
    return _site("L", walls, [(1.0, 1.0), (14.0, 1.0), (14.0, 9.0)], seed)


def ring(seed: int) -> Site:
    """A corridor 2 m wide around a core."""
    walls = [*_box(0.0, 0.0, 12.0, 10.0), *_box(2.0, 2.0, 10.0, 8.0)]
    return _site("ring", walls, [(1.0, 1.0), (11.0, 1.0), (11.0, 9.0), (1.0, 9.0), (1.0, 1.0)], seed)


def room(east_m: float, north_m: float, seed: int) -> Site:
    """One room, walked round and across."""
    x, y = east_m - 1.0, north_m - 1.0
    return _site("room", _box(0.0, 0.0, east_m, north_m), [(1.0, 1.0), (x, 1.0), (x, y), (1.0, y), (1.0, 1.0)], seed)


def two_rooms(seed: int) -> Site:
    """Two rooms of 5 x 4 m with a door between them."""
    low, high = 2.0 - 0.5 * DOOR_M, 2.0 + 0.5 * DOOR_M
    walls = [*_box(0.0, 0.0, 10.0, 4.0), (5.0, 0.0, 5.0, low), (5.0, high, 5.0, 4.0)]
    return _site("two rooms", walls, [(1.0, 1.2), (3.5, 2.0), (6.5, 2.0), (9.0, 1.2), (9.0, 3.0), (6.5, 2.0)], seed)


def flat(seed: int) -> Site:
    """Four rooms and a hallway between them."""
    gap = 0.5 * DOOR_M
    walls = [*_box(0.0, 0.0, 9.0, 7.6), (0.0, 3.2, 0.0, 4.6), (4.5, 0.0, 4.5, 3.0), (4.5, 4.6, 4.5, 7.6)]
    for y in (3.0, 4.6):
        for x in (0.0, 4.5):
            walls += [(x, y, x + 2.25 - gap, y), (x + 2.25 + gap, y, x + 4.5, y)]
    rooms = [(2.25, 1.5), (2.25, 3.8), (6.75, 3.8), (6.75, 6.2), (6.75, 1.5)]
    way = [(1.0, 3.8), (2.25, 3.8), *rooms, (6.75, 3.8), (8.0, 3.8)]
    return _site("flat", walls, way, seed)


def hall(seed: int) -> Site:
    """A hall of 20 x 15 m: most walls are out of the rangers' reach on most of the way."""
    way = [(2.0, 2.0), (18.0, 2.0), (18.0, 13.0), (10.0, 7.5), (2.0, 13.0), (2.0, 2.0)]
    return _site("hall", _box(0.0, 0.0, 20.0, 15.0), way, seed)


BUILDINGS: dict[str, Callable[[int], Site]] = {
    "corridor-8": partial(corridor, 8.0, 2.0),
    "corridor-20": partial(corridor, 20.0, 2.0),
    "corridor-30": partial(corridor, 30.0, 2.4),
    "corridor-60": partial(corridor, 60.0, 3.0),
    "corridor-open": open_corridor,
    "L": ell,
    "ring": ring,
    "room-5x4": partial(room, 5.0, 4.0),
    "room-8x6": partial(room, 8.0, 6.0),
    "two-rooms": two_rooms,
    "flat": flat,
    "hall": hall,
}
