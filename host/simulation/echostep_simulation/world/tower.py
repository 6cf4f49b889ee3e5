# SPDX-License-Identifier: MIT
"""A building of several storeys to walk through: a corridor with rooms on each, a stairwell at one end, a lift at the other.

In: how many storeys. Out: the plan, and waypoints through it. Owns nothing.
"""

from __future__ import annotations

import hashlib

import numpy as np

from echostep.plan import Connector, Level, Plan, Pose, Room
from echostep_simulation.people.walker import Waypoint

STOREY_M = 3.5
LENGTH_M = 30.0
STAIRWELL = np.array([(-5.0, 0.0), (0.0, 0.0), (0.0, 3.0), (-5.0, 3.0)])
LIFT = np.array([(LENGTH_M, 0.4), (LENGTH_M + 2.0, 0.4), (LENGTH_M + 2.0, 2.6), (LENGTH_M, 2.6)])
LIFT_AT = (LENGTH_M + 1.0, 1.5)
CORRIDOR_Y = 1.5
SPINE = (-3.6, CORRIDOR_Y, -1.4, CORRIDOR_Y)  # the wall between the flights, which leaves room to turn at both ends


def tower(storeys: int) -> Plan:
    """`storeys` levels alike, but for the doors along the corridor: no two have them at the same places."""
    heights = [k * STOREY_M for k in range(storeys)]
    levels = tuple(Level(f"{k}", h, _walls(k), (Room("corridor", (15.0, 1.5)),)) for k, h in enumerate(heights))
    every = tuple(range(storeys))
    connectors = (Connector("stairs", "stairs", every, STAIRWELL), Connector("lift", "lift", every, LIFT))
    digest = hashlib.sha256(b"tower %d" % storeys).hexdigest()
    return Plan("tower", levels, Pose(2.0, CORRIDOR_Y, 0.0), digest, connectors)


def stairs_from(level: int, up: bool) -> list[Waypoint]:
    """From the corridor at the stairwell by two flights with a landing in between, to the next level's corridor."""
    z = level * STOREY_M
    step = STOREY_M if up else -STOREY_M
    return [
        (-0.9, 0.8, 0.0, z), (-3.9, 0.8, 0.0, z + 0.5 * step), (-4.4, 1.5, 0.0, z + 0.5 * step),
        (-3.9, 2.2, 0.0, z + 0.5 * step), (-0.9, 2.2, 0.0, z + step), (1.0, CORRIDOR_Y, 0.0, z + step),
    ]  # fmt: skip


def lift_to(level: int, to: int) -> list[Waypoint]:
    """Into the lift at one level, and out of it at another."""
    z, there = level * STOREY_M, to * STOREY_M
    before = (LENGTH_M - 1.0, CORRIDOR_Y)
    return [(*before, 0.0, z), (*LIFT_AT, 0.0, z), (*LIFT_AT, 0.0, there), (*before, 0.0, there)]


def tour(storeys: int) -> list[Waypoint]:
    """Up by the stairs, along each corridor and back, and down from the top by the lift."""
    way: list[Waypoint] = [(2.0, CORRIDOR_Y, 0.0, 0.0)]
    for level in range(storeys):
        z = level * STOREY_M
        if level:
            way += stairs_from(level - 1, up=True)
        way += [(25.0, CORRIDOR_Y, 2.0, z)]
        if level + 1 < storeys:
            way += [(1.0, CORRIDOR_Y, 0.0, z)]
    return [*way, *lift_to(storeys - 1, 0), (6.0, CORRIDOR_Y, 0.0, 0.0)]


def _walls(level: int) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """A corridor 3 m wide with four doors to either side, the stairwell's opening, the lift's."""
    rng = np.random.default_rng([level, 21])
    walls: list[tuple[float, float, float, float]] = []
    for y, away in ((0.0, -4.0), (3.0, 7.0)):
        x = 0.0
        for door in np.sort(rng.uniform(1.0, 6.0, 4) + 7.0 * np.arange(4)).tolist():
            walls += [
                (x, y, door, y),
                (door, y, door, y + np.sign(away) * 0.2),
                (door + 0.9, y, door + 0.9, y + np.sign(away) * 0.2),
            ]
            x = door + 0.9
        walls += [(x, y, LENGTH_M, y), (0.0, away, LENGTH_M, away), (0.0, y, 0.0, away), (LENGTH_M, y, LENGTH_M, away)]
        walls += [(7.0 * k, y, 7.0 * k, away) for k in range(1, 4)]
    walls += [(-5.0, 0.0, 0.0, 0.0), (-5.0, 0.0, -5.0, 3.0), (-5.0, 3.0, 0.0, 3.0), SPINE]
    walls += [
        (0.0, 0.0, 0.0, 0.3),
        (0.0, 2.7, 0.0, 3.0),
        (LENGTH_M, 0.0, LENGTH_M, 0.9),
        (LENGTH_M, 2.1, LENGTH_M, 3.0),
    ]
    walls += [tuple(np.concatenate([a, b]).tolist()) for a, b in zip(LIFT[:3], LIFT[1:], strict=True)]
    return np.array(walls)
