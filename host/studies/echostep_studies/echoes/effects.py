# SPDX-License-Identifier: MIT
"""Simulated pings that show one effect each [Girard 2011, 2.6, Figures 1-5].

In: a seed. Out: `Effect`s. Owns nothing. The simulation computes sound levels from mirror images and shares nothing with the likelihood but the plan.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from echostep.arrays import Floats
from echostep_simulation.world.acoustics import PIPE_RADIUS_M, SRF02, rod_db
from echostep_simulation.world.echoes import echoes

TRIES = 200  # pings at each place
WIDTH_M = 2.4  # of the corridor of Figure 5


@dataclass(frozen=True, slots=True)
class SimulatedEcho:
    """Pings of the left ranger: at `place` (angle in degrees, or distance in m) the pose (x, y, heading) and the ranges (k,), nan for none."""

    place: float
    pose: tuple[float, float, float]
    range_m: Floats


@dataclass(frozen=True, slots=True)
class Effect:
    """One effect: the true walls, the received echoes, and the walls of the plan."""

    name: str
    plan: Floats
    heard: list[SimulatedEcho]


def simulated_effects(seed: int) -> tuple[Effect, ...]:
    """All effects; one random generator runs through them."""
    rng = np.random.default_rng([seed, 40])
    return tuple(make(rng) for make in (incidence, near_and_far, oblique, limits, frames))


def incidence(rng: np.random.Generator) -> Effect:
    """A wall at 2 m, and the ranger turned away from it [Girard 2011, Figure 1]."""
    wall = np.array([[-10.0, 2.0, 10.0, 2.0]])
    poses = [(float(deg), (0.0, 0.0, math.radians(deg))) for deg in range(0, 52, 2)]
    return Effect("incidence", wall, _listen(wall, poses, rng))


def near_and_far(rng: np.random.Generator) -> Effect:
    """A post before a wall at 3 m: missed unless it is very near [Girard 2011, Figure 3a]."""
    wall = np.array([[-10.0, 3.0, 10.0, 3.0]])
    post = np.array([[0.0, 0.0, 0.0, 0.01]])  # no face toward the ranger: it echoes like a thin rod
    echoes = []
    for y in np.arange(0.2, 2.9, 0.15).tolist():
        built = np.vstack([wall, post + [0.0, y, 0.0, y]])
        echoes += _listen(built, [(y, (0.0, 0.0, 0.0))], rng)
    return Effect("near and far", wall, echoes)


def oblique(rng: np.random.Generator) -> Effect:
    """Across a corridor ever more obliquely: the echo is lost, then comes back by two walls [Girard 2011, Figure 3b]."""
    walls = np.array([[-10.0, 1.0, 4.0, 1.0], [-10.0, -1.0, 4.0, -1.0], [4.0, -1.0, 4.0, 1.0]])
    poses = [(float(deg), (2.0, 0.0, -math.radians(deg))) for deg in range(0, 92, 3)]
    return Effect("oblique", walls, _listen(walls, poses, rng))


def limits(rng: np.random.Generator) -> Effect:
    """A wall straight ahead from touching to 7 m: the minimum and the maximum range."""
    wall = np.array([[-10.0, 0.0, 10.0, 0.0]])
    poses = [
        (d, (0.0, -d, 0.0)) for d in np.concatenate([np.arange(0.04, 0.4, 0.04), np.arange(0.5, 7.0, 0.25)]).tolist()
    ]
    return Effect("limits", wall, _listen(wall, poses, rng))


def frames(rng: np.random.Generator) -> Effect:
    """Along a corridor with three open doors on one side [Girard 2011, Figures 4 and 5]."""
    y, walls, x = 0.5 * WIDTH_M, [], 0.0
    for door in (2.0, 5.0, 8.0):
        a, b = door - 0.45, door + 0.45
        walls += [(x, y, a, y), (a, y, a, y + 0.15), (b, y, b, y + 0.15)]
        x = b
    walls += [(x, y, 10.0, y), (0.0, -y, 10.0, -y), (0.0, y + 4.0, 10.0, y + 4.0)]
    plan = np.array(walls)
    poses = [(at, (at, 0.0, 0.0)) for at in np.arange(0.3, 9.7, 0.1).tolist()]
    return Effect("door frames", plan, _listen(plan, poses, rng))


def _listen(
    built: Floats, poses: list[tuple[float, tuple[float, float, float]]], rng: np.random.Generator
) -> list[SimulatedEcho]:
    """Many pings of the left ranger at each pose."""
    pings = []
    for place, (x, y, heading) in poses:
        trunk, look = np.tile([x, y], (TRIES, 1)), np.full(TRIES, heading)
        us = echoes(trunk, look, built, np.zeros(2), rng).own_us[:, 0].astype(float)
        pings.append(SimulatedEcho(place, (x, y, heading), np.where(us > 0, us * (0.5e-6 * SRF02.speed_m_s), np.nan)))
    return pings


def pipe_range_m(off_axis_rad: float) -> float:
    """Farthest distance at which the 55 mm pipe is heard half of the time [Girard 2011, Figure 2a]."""
    away = np.arange(0.05, 6.0, 0.01)
    is_loud = [rod_db(float(d), off_axis_rad, PIPE_RADIUS_M, SRF02) > SRF02.threshold_db for d in away]
    return float(away[int(np.argmin(is_loud)) - 1]) if is_loud[0] else 0.0
