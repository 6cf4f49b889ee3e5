# SPDX-License-Identifier: MIT
"""Simulated beacons and their gateway: a walk among beacons -> the bytes that the gateway sends.

In: the walker's positions over time, the walls, the beacons. Out: chunks of the gateway's port, or frames. Owns the sequence number. Every 200 ms all
beacons within reach without a wall between measure, with the errors of [Fischer 2008, 4.1.1].
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterator
from dataclasses import dataclass
from operator import attrgetter

import numpy as np
from shapely import LineString

from echostep.arrays import Floats, Ints
from echostep.board.frames import encode
from echostep.board.messages import Beacon
from echostep.plan import Plan
from echostep.ports.chunks import GATEWAY, Chunk
from echostep_simulation.scenario import START_NS, Scenario
from echostep_simulation.world.beacon_ground import OUTLIER_M

PERIOD_S = 0.2
ASIDE_M = 0.3
LATENCY_S = 0.02
SPACING_M = 5.0


@dataclass(frozen=True, slots=True)
class BeaconWorld:
    """`places` (b, 3): x, y, axis; `walls` (n, 4) that no sound passes; the beacons' reach and errors [Fischer 2008, 4.1.1]."""

    places: Floats
    walls: Floats
    reach_m: float = 8.0
    range_sd_m: float = 0.05
    bearing_sd_deg: float = 30.0
    outliers: float = 0.05


def lay_beacons(path_m: Floats, spacing_m: float, rng: np.random.Generator) -> Floats:
    """Beacons (b, 3) dropped along a path (k, 2), `spacing_m` apart, each with a random orientation."""
    line = LineString(path_m)
    count = max(int(line.length / spacing_m), 1)
    places = np.array(
        [(*line.interpolate(spacing_m * k).coords[0], rng.uniform(-math.pi, math.pi)) for k in range(count)]
    )
    places[:, :2] += ASIDE_M * rng.uniform(-1.0, 1.0, (count, 2))
    return places


def heard_at(
    world: BeaconWorld, x_m: float, y_m: float, rng: np.random.Generator
) -> Iterator[tuple[int, float, float]]:
    """Beacon, range (m) and bearing (rad) of all beacons that detect a boot there."""
    for k, (bx, by, axis) in enumerate(world.places.tolist()):
        distance = math.hypot(x_m - bx, y_m - by)
        if distance > world.reach_m or _hidden(world.walls, bx, by, x_m, y_m):
            continue
        range_m = distance + world.range_sd_m * rng.standard_normal() + OUTLIER_M * (rng.random() < world.outliers)
        bearing = math.atan2(y_m - by, x_m - bx) - axis + math.radians(world.bearing_sd_deg) * rng.standard_normal()
        yield k, max(range_m, 0.001), math.remainder(bearing, 2.0 * math.pi)


def message(number: int, range_m: float, bearing_rad: float, gateway_s: float) -> Beacon:
    """The gateway's message of one measurement; each number has a unit of its own."""
    return Beacon(
        gateway_ms=round(1e3 * gateway_s) & 0xFFFFFFFF,
        unit=0xBEAC0000 + number,
        number=number,
        age_ms=0,
        range_mm=min(round(1e3 * range_m), 0xFFFE),
        bearing=round(math.degrees(bearing_rad) * 100.0),
    )


def gateway_chunks(world: BeaconWorld, t_s: Floats, xy_m: Floats, arrival_ns: Ints, seed: int) -> Iterator[Chunk]:
    """The gateway's chunks for a walk t_s (n,), xy_m (n, 2), whose moments reach the host at `arrival_ns` (n,)."""
    rng = np.random.default_rng([seed, 2])
    sequence = 0
    for now in np.arange(float(t_s[0]), float(t_s[-1]), PERIOD_S).tolist():
        x, y = float(np.interp(now, t_s, xy_m[:, 0])), float(np.interp(now, t_s, xy_m[:, 1]))
        message_bytes = b""
        for k, range_m, bearing in heard_at(world, x, y, rng):
            message_bytes += encode(message(k + 1, range_m, bearing, now), sequence)
            sequence += 1
        if message_bytes:
            yield Chunk(GATEWAY, int(np.interp(now + LATENCY_S, t_s, arrival_ns)), message_bytes)


def with_beacons(scenario: Scenario, plan: Plan, seed: int) -> Iterator[Chunk]:
    """A scenario's chunks with the chunks of a gateway whose beacons lie along the walk, on a plan of one level."""
    truth = scenario.truth
    places = lay_beacons(truth[:, 1:3], SPACING_M, np.random.default_rng([seed, 8]))
    arrival_ns = START_NS + np.rint(truth[:, 0] * 1e9).astype(np.int64)
    gateway = gateway_chunks(BeaconWorld(places, plan.levels[0].walls), truth[:, 0], truth[:, 1:3], arrival_ns, seed)
    return heapq.merge(scenario.chunks(), gateway, key=attrgetter("t_arrival_ns"))


def _hidden(walls: Floats, ax: float, ay: float, bx: float, by: float) -> bool:
    """Whether a wall lies between two places."""
    if not len(walls):
        return False
    dx, dy = bx - ax, by - ay
    from_a = dx * (walls[:, 1::2] - ay) - dy * (walls[:, ::2] - ax)  # side of either end of the wall
    ux, uy = walls[:, 2] - walls[:, 0], walls[:, 3] - walls[:, 1]
    of_a = ux * (ay - walls[:, 1]) - uy * (ax - walls[:, 0])
    of_b = ux * (by - walls[:, 1]) - uy * (bx - walls[:, 0])
    return bool(((from_a[:, 0] * from_a[:, 1] < 0.0) & (of_a * of_b < 0.0)).any())
