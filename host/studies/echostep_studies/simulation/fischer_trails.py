# SPDX-License-Identifier: MIT
"""The trails of [Fischer 2008, section 3.2] as walks past machines.

In: a seed. Out: a walk and what an MTx on the foot measures. Owns the trails' geometry.
The paper gives lengths and kinds, not plans: lengths are as printed, shapes as described, the rest is chosen here. Everyone keeps to the right, so
that a machine behind the wall is nearer on one way than on the other; the field falls off with the cube of the distance. That is our reading
of "strong interference on the forward path but not on the return path", which puzzled the authors.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echostep_simulation.devices.mtx import MtxModel, MtxSamples, measure
from echostep_simulation.devices.onboard_filter import OnBoardFilter
from echostep_simulation.people.walker import Person, Walk, Waypoint, walk
from echostep_simulation.world.magnetic_field import MagneticDipole, MagneticField

BUILDING = 2008  # seed of the field that the steel of every building makes; the people differ from run to run, the buildings do not
LANE_M = 0.5  # from the middle of a corridor
HEIGHT_M = 0.6
STAND_S = 5.0
STRIDE_M, STRIDE_S = (1.3, 0.08), (1.1, 0.05)  # mean and standard deviation over people [Perry 1992]


@dataclass(frozen=True, slots=True)
class Trail:
    """A way from a start back to it. `printed`: the paper's description, in short; `printed_percent`: its distance error."""

    name: str
    length_m: float
    waypoints: tuple[Waypoint, ...]
    machines: tuple[MagneticDipole, ...]
    printed_percent: float | None
    printed: str


def walk_trail(trail: Trail, seed: int) -> Walk:
    """One person's walk."""
    rng = np.random.default_rng([seed, BUILDING])
    stride_m, stride_s = (mean + sd * float(rng.standard_normal()) for mean, sd in (STRIDE_M, STRIDE_S))
    return walk(trail.waypoints, Person(stride_m=stride_m, stride_s=stride_s, stand_s=STAND_S), rng)


def measure_trail(trail: Trail, walked: Walk, rate_hz: float, seed: int) -> MtxSamples:
    """What an MTx on the foot measures, with its own, fooled orientation."""
    magnetism = MagneticField(np.random.default_rng(BUILDING), trail.machines)
    model = MtxModel(rate_hz=rate_hz, filter=OnBoardFilter())
    return measure(walked, model, np.random.default_rng([seed, int(rate_hz)]), magnetism)


def _corridor_with_offices() -> tuple[Waypoint, ...]:
    """46 m, three offices on the way there and three on the way back, 4 m deep."""
    way: list[Waypoint] = [(0.0, -LANE_M)]
    for x in (8.0, 20.0, 32.0):
        way += [(x, -LANE_M), (x, -LANE_M - 4.0, 2.0), (x, -LANE_M)]
    way += [(46.0, -LANE_M), (46.0, LANE_M)]
    for x in (38.0, 26.0, 14.0):
        way += [(x, LANE_M), (x, LANE_M + 4.0, 2.0), (x, LANE_M)]
    return (*way, (0.0, LANE_M))


def _round_the_machines() -> tuple[Waypoint, ...]:
    """A corridor round three sides of a workshop and back, on the right of each way."""
    a, x, y = LANE_M, 28.0, 41.0
    there: tuple[Waypoint, ...] = ((a, 0.0), (a, y - a), (x - a, y - a), (x - a, 0.0))
    back: tuple[Waypoint, ...] = ((x + a, 0.0), (x + a, y + a), (-a, y + a), (-a, 0.0))
    return (*there, *back)


def _row(
    first_m: tuple[float, float], step_m: tuple[float, float], count: int, moment_a_m2: tuple[float, float, float]
) -> tuple[MagneticDipole, ...]:
    """Equal machines in a row, their middles `HEIGHT_M` above the floor."""
    (x, y), (dx, dy) = first_m, step_m
    return tuple(MagneticDipole((x + k * dx, y + k * dy, HEIGHT_M), moment_a_m2) for k in range(count))


TRAILS = (
    Trail("line", 88.0, ((0.0, 0.0), (44.0, 0.0), (0.0, 0.0)), (), 2.0, "+2 %"),
    Trail(
        "l", 54.0, ((0.0, 0.0), (17.0, 0.0), (17.0, 10.0), (17.0, 0.0), (0.0, 0.0)), (), -8.0, "-8 %"
    ),
    Trail("rectangle", 11.5, ((0.0, 0.0), (3.5, 0.0), (3.5, 2.25), (0.0, 2.25), (0.0, 0.0)), (), -7.0, "-7 %"),
    Trail(
        "offices", 140.0, _corridor_with_offices(),
        (
            *_row((23.0, -1.7), (2.0, 0.0), 3, (-1200.0, -1200.0, 0.0)),
            *_row((41.0, 1.7), (2.0, 0.0), 3, (1200.0, -1200.0, 0.0)),
        ),
        None, "drifts off",
    ),
    Trail(
        "workshop", 200.0,
        (
            (0.0, 0.0), (36.0, 0.0), (36.0, 8.0), (6.0, 8.0), (6.0, 16.0), (36.0, 16.0), (36.0, 24.0),
            (12.0, 24.0), (12.0, 12.0), (24.0, 12.0), (24.0, 4.0), (0.0, 4.0), (0.0, 0.0),
        ),
        (
            *_row((14.0, 1.6), (3.0, 0.0), 2, (1000.0, -1000.0, -300.0)),
            *_row((27.0, 9.6), (3.0, 0.0), 2, (-1000.0, -1000.0, 300.0)),
            *_row((20.0, 17.6), (3.0, 0.0), 2, (1000.0, -1000.0, 0.0)),
            *_row((13.6, 19.0), (0.0, 3.0), 2, (1000.0, 500.0, -300.0)),
        ),
        None, "at places",
    ),
    Trail(
        "machinery", 220.0, _round_the_machines(),
        _row((2.0, 10.0), (0.0, 2.5), 12, (1500.0, 0.0, -400.0)),
        None, "unusable",
    ),
)  # fmt: skip
