# SPDX-License-Identifier: MIT
"""The walks of one team through one building, and when two of its wearers meet.

In: a plan, a seed. Out: `TeamWalks`: bytes and truth of each wearer, encounters by the truth. Owns the definition of an encounter. Simulated: bytes
of the simulated board and MTx. All wearers begin at one moment, each at a random place or all at the door, and walk a random tour.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import shapely

from echostep.arrays import Bools, Floats, spans
from echostep.plan import Plan, Pose
from echostep.ports.chunks import Chunk
from echostep_app.plan.routing import RoutePlace
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.people.walker import Person, Waypoint
from echostep_simulation.scenario import Scenario
from echostep_studies.bench.tours import random_tour
from echostep_studies.bench.walks import CORNER_M, T, X, Y, Z

WEARERS = 5
STOP_S = 4.0  # at each place of a tour: a room is looked at
SIDE_M = 1.2  # between two wearers at a tap, at most: side by side
RING_M = 0.5  # radius of the ring in which a team stands at a door
DOOR_S = 10.0  # for which it stands there
BEGIN_S = 4.0  # after which people meet: trackers have an estimate then
AGAIN_S = 30.0  # between two encounters of the same two
LEVEL_M = 1.0  # difference of height on one floor


@dataclass(frozen=True, slots=True)
class Encounter:
    """Wearers `who` are at their nearest at `t_s`, at a true distance, with no wall between."""

    t_s: float
    who: tuple[int, int]
    distance_m: float


@dataclass(frozen=True, slots=True)
class TeamWalks:
    """Of each wearer: `chunks` and `truth` (n, 5): t_s, x, y, heading, height of the floor; the true `starts`; encounters in order of time."""

    plan: Plan
    chunks: tuple[tuple[Chunk, ...], ...]
    truth: tuple[Floats, ...]
    starts: tuple[Pose, ...]
    encounters: tuple[Encounter, ...]


def team_walks(plan: Plan, begin: RoutePlace, length_m: float, seed: int, *, at_door: bool = False) -> TeamWalks:
    """A team of WEARERS; `begin`: from where all places of the plan are reached. `at_door`: all begin there, in a ring, not apart."""
    scenarios = []
    for k in range(WEARERS):
        x, y = (RING_M * f(2.0 * math.pi * k / WEARERS) for f in (math.cos, math.sin))
        first = RoutePlace(begin.x_m + x, begin.y_m + y, begin.level) if at_door else begin
        tour = random_tour(plan, first, length_m, np.random.default_rng([seed, 76, k]), anywhere=not at_door)
        way = _with_stops(tour)
        number = WEARERS * seed + k
        person = Person(corner_m=CORNER_M, stand_s=DOOR_S) if at_door else Person(corner_m=CORNER_M)
        scenarios.append(Scenario(plan, way, number, PythonBoard(number), person))
    truth = tuple(scenario.truth for scenario in scenarios)
    return TeamWalks(
        plan, tuple(tuple(scenario.chunks()) for scenario in scenarios), truth,
        tuple(scenario.start for scenario in scenarios), encounters(plan, truth),
    )  # fmt: skip


def _with_stops(tour: Sequence[Waypoint]) -> list[Waypoint]:
    """The same way with a stop where it turns back: the places of the tour."""
    points = [(w[0], w[1], 0.0, w[3] if len(w) == 4 else 0.0) for w in tour]
    stopped = [points[0]]
    for before, here, after in zip(points, points[1:], points[2:], strict=False):
        turns_back = (here[0] - before[0]) * (after[0] - here[0]) + (here[1] - before[1]) * (after[1] - here[1]) < 0.0
        flat = before[3] == here[3] == after[3]
        stopped.append((here[0], here[1], STOP_S if turns_back and flat else 0.0, here[3]))
    return [*stopped, points[-1]]


def encounters(plan: Plan, truth: Sequence[Floats]) -> tuple[Encounter, ...]:
    """Every time that two wearers come within SIDE_M of each other on one floor without a wall between, at the moment when they are nearest."""
    nearest = []
    for i, j in combinations(range(len(truth)), 2):
        rows = min(len(truth[i]), len(truth[j]))
        a, b = truth[i][:rows], truth[j][:rows]
        away = np.hypot(a[:, X] - b[:, X], a[:, Y] - b[:, Y])
        beside = (a[:, T] >= BEGIN_S) & (away < SIDE_M) & (np.abs(a[:, Z] - b[:, Z]) < LEVEL_M)
        beside[beside] = ~_walled(plan, a[beside], b[beside])
        last_s = -np.inf
        for first, end in spans(beside).tolist():
            k = first + int(away[first:end].argmin())
            if a[k, T] - last_s >= AGAIN_S:
                last_s = float(a[k, T])
                nearest.append(Encounter(last_s, (i, j), float(away[k])))
    return tuple(sorted(nearest, key=lambda e: e.t_s))


def _walled(plan: Plan, a: Floats, b: Floats) -> Bools:
    """Whether a wall of the nearest level is between two places of the truth, (n,)."""
    walled = np.zeros(len(a), np.bool_)
    heights = np.array([level.height_m for level in plan.levels])
    nearest = np.abs(a[:, Z, None] - heights).argmin(1)
    for k, level in enumerate(plan.levels):
        rows = np.flatnonzero(nearest == k)
        lines = shapely.linestrings(np.stack([a[rows][:, [X, Y]], b[rows][:, [X, Y]]], axis=1))
        walls = shapely.union_all(shapely.linestrings(level.solid.reshape(-1, 2, 2)))
        walled[rows] = shapely.intersects(lines, walls)
    return walled
