# SPDX-License-Identifier: MIT
"""Beacons that the wearers of a team drop on their ways, and what the gateway of each wearer hears of them.

In: `TeamWalks`, a seed. Out: `TeamWalks` whose chunks have those of a gateway among them. Owns where and when beacons are dropped. Simulated: reach
and errors are those of `BeaconWorld` [Fischer 2008, 4.1.1]; a beacon is heard on its own floor only, from when it was dropped, through no wall.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from operator import attrgetter

import numpy as np

from echostep.arrays import Floats
from echostep.board.frames import encode
from echostep.ports.chunks import GATEWAY, Chunk
from echostep_simulation.devices.beacon_gateway import ASIDE_M, PERIOD_S, SPACING_M, BeaconWorld, heard_at, message
from echostep_simulation.scenario import START_NS
from echostep_studies.bench.walks import T, X, Y, Z, way_m
from echostep_studies.team.walks import LEVEL_M, TeamWalks

MOST_EACH = 12  # beacons that a wearer carries: five wearers have fewer than a gateway tells apart


@dataclass(frozen=True, slots=True)
class Dropped:
    """A beacon dropped at `t_s` at a place on the floor of height `z_m`; `axis_rad`: its orientation."""

    number: int
    t_s: float
    x_m: float
    y_m: float
    z_m: float
    axis_rad: float


def with_dropped_beacons(walks: TeamWalks, seed: int) -> TeamWalks:
    """The same walks; each wearer drops a beacon every SPACING_M, and has a gateway that hears the beacons of all."""
    beacons = [
        b
        for who, truth in enumerate(walks.truth)
        for b in dropped_on(truth, who, np.random.default_rng([seed, 79, who]))
    ]
    chunks = tuple(
        tuple(
            heapq.merge(
                own,
                _heard(walks, truth, beacons, np.random.default_rng([seed, 81, who])),
                key=attrgetter("t_arrival_ns"),
            )
        )
        for who, (own, truth) in enumerate(zip(walks.chunks, walks.truth, strict=True))
    )
    return replace(walks, chunks=chunks)


def dropped_on(truth: Floats, who: int, rng: np.random.Generator) -> list[Dropped]:
    """The beacons dropped by wearer `who` beside its true path (n, 5)."""
    way = way_m(truth)
    rows = [int(np.searchsorted(way, k * SPACING_M)) for k in range(MOST_EACH) if k * SPACING_M <= way[-1]]
    drops = []
    for k, row in enumerate(rows):
        t_s, x, y, z = truth[row, [T, X, Y, Z]].tolist()
        aside_x, aside_y = (ASIDE_M * rng.uniform(-1.0, 1.0, 2)).tolist()
        drops.append(Dropped(who * MOST_EACH + k + 1, t_s, x + aside_x, y + aside_y, z, rng.uniform(-math.pi, math.pi)))
    return drops


def _heard(walks: TeamWalks, truth: Floats, beacons: Sequence[Dropped], rng: np.random.Generator) -> Iterator[Chunk]:
    """Chunks of one wearer's gateway."""
    heights = np.array([level.height_m for level in walks.plan.levels])
    sequence = 0
    for now in np.arange(truth[0, T], truth[-1, T], PERIOD_S).tolist():
        x, y, z = (float(np.interp(now, truth[:, T], truth[:, k])) for k in (X, Y, Z))
        near = [b for b in beacons if b.t_s <= now and abs(b.z_m - z) < LEVEL_M]
        places = np.array([[b.x_m, b.y_m, b.axis_rad] for b in near]).reshape(-1, 3)
        world = BeaconWorld(places, walks.plan.levels[int(np.abs(heights - z).argmin())].walls)
        data = b""
        for k, range_m, bearing in heard_at(world, x, y, rng):
            data += encode(message(near[k].number, range_m, bearing, now), sequence)
            sequence += 1
        if data:
            yield Chunk(GATEWAY, START_NS + round(1e9 * now), data)
