# SPDX-License-Identifier: MIT
"""The world of a guided return [Fischer 2008, 4]: a trail on open ground, beacons dropped along it, magnetic sources nearby.

In: settings and a random generator. Out: a `BeaconGround` of plain arrays, and kernels for what happens on it: how a source turns the measured
heading, which beacon receives the boot, and its measurement. Owns nothing. The paper does not print its trail: each seed draws another one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from shapely import LineString

from echostep.arrays import Bools, Floats
from echostep.jit import kernel

OUTLIER_M = 3.0  # added to a range [Fischer 2008, 4.1.1]

# The constants below are assumed: the paper prints none of them.
PARTS = (4, 7)  # straight parts of a trail
PART_M = (12.0, 25.0)
TURNS_RAD = (math.radians(30.0), math.radians(110.0))  # between parts, to either side
ASIDE_M = 0.3  # standard deviation per axis of a dropped beacon's place about the trail
CLEARANCE_M = 8.0  # between parts of a trail that do not meet: on open ground a path need not cross itself
MOVED_M = 4.0  # standard deviation per axis of the displacement of a moved beacon
SOURCE_SHARE = (0.1, 0.8)  # of the trail's length: where sources lie


@dataclass(frozen=True, slots=True)
class GroundSettings:
    """[Fischer 2008, 4.1]: `range_sd_m`, `bearing_sd_deg` of the beacons' measurements, `outliers` the share of ranges with 3 m too much.

    `spacing_m`: between beacons along the trail; `reach_m`: greatest distance at which a beacon hears the boot. `place_sd_m` (per axis),
    `axis_sd_deg`: standard deviations of a beacon's believed place and axis. `sources`: magnetic sources per trail, each within `source_aside_m` of
    it per axis, with radius and amplitude drawn from the ranges. `moved`, `dead`: share of beacons that are moved by MOVED_M, or stop working,
    before the way back.
    """

    range_sd_m: float = 0.05
    bearing_sd_deg: float = 30.0
    outliers: float = 0.1
    spacing_m: float = 5.0
    reach_m: float = 8.0
    place_sd_m: float = 0.0
    axis_sd_deg: float = 0.0
    sources: int = 3
    source_aside_m: float = 2.0
    source_radius_m: tuple[float, float] = (2.5, 5.0)
    source_deg: tuple[float, float] = (20.0, 60.0)
    moved: float = 0.0
    dead: float = 0.0


class BeaconGround(NamedTuple):
    """The ground, on which b beacons and s sources lie.

    `trail` (k, 2): from the deepest point to the exit. Beacons (b, 3) are x, y, axis: `beacons` on the way back, `dropped` on the way in,
    `believed` as the system has them; `works` (b,). `sources` (s, 4): x, y, radius (m), amplitude (rad).
    """

    trail: Floats
    beacons: Floats
    dropped: Floats
    believed: Floats
    works: Bools
    sources: Floats
    range_sd_m: float
    bearing_sd_rad: float
    outliers: float
    reach_m: float


def ground(settings: GroundSettings, rng: np.random.Generator) -> BeaconGround:
    """A ground with beacons and sources along a random trail."""
    trail = draw_trail(rng)
    line = LineString(trail)
    total = line.length
    count = max(int(total / settings.spacing_m) + 1, 2)
    dropped = np.empty((count, 3))
    for k, s in enumerate(np.linspace(0.0, total, count).tolist()):
        x, y = line.interpolate(s).coords[0]
        dropped[k] = x, y, rng.uniform(-math.pi, math.pi)
    dropped[:, :2] += ASIDE_M * rng.standard_normal((count, 2))
    believed = dropped.copy()
    believed[:, :2] += settings.place_sd_m * rng.standard_normal((count, 2))
    believed[:, 2] += math.radians(settings.axis_sd_deg) * rng.standard_normal(count)
    beacons = dropped.copy()
    moved = rng.random(count) < settings.moved
    beacons[moved, :2] += MOVED_M * rng.standard_normal((int(moved.sum()), 2))
    works = rng.random(count) >= settings.dead
    return BeaconGround(
        trail, beacons, dropped, believed, works, _sources(settings, trail, rng), settings.range_sd_m,
        math.radians(settings.bearing_sd_deg), settings.outliers, settings.reach_m,
    )  # fmt: skip


def draw_trail(rng: np.random.Generator) -> Floats:
    """Straight parts joined by turns to either side, (k, 2); drawn again until its parts keep CLEARANCE_M."""
    while True:
        count = int(rng.integers(PARTS[0], PARTS[1] + 1))
        turns = rng.uniform(*TURNS_RAD, count) * rng.choice([-1.0, 1.0], count)
        heading = rng.uniform(-math.pi, math.pi) + np.cumsum(turns)
        parts = rng.uniform(*PART_M, count)[:, None] * np.column_stack([np.cos(heading), np.sin(heading)])
        trail = np.vstack([np.zeros(2), np.cumsum(parts, axis=0)])
        if _clear(trail):
            return trail


def _clear(trail: Floats) -> bool:
    """Whether parts of a trail that do not meet keep CLEARANCE_M."""
    parts = [LineString(trail[k : k + 2]) for k in range(len(trail) - 1)]
    return all(a.distance(b) >= CLEARANCE_M for k, a in enumerate(parts) for b in parts[k + 2 :])


def _sources(settings: GroundSettings, trail: Floats, rng: np.random.Generator) -> Floats:
    """Sources (s, 4) at random places along the trail."""
    sources = np.empty((settings.sources, 4))
    for k in range(settings.sources):
        x, y = LineString(trail).interpolate(rng.uniform(*SOURCE_SHARE), normalized=True).coords[0]
        aside = rng.uniform(-settings.source_aside_m, settings.source_aside_m, 2)
        sources[k] = (
            x + aside[0], y + aside[1], rng.uniform(*settings.source_radius_m),
            math.radians(rng.uniform(*settings.source_deg)),
        )  # fmt: skip
    return sources


@kernel
def disturbance(sources: Floats, inside: Bools, x: float, y: float, heading: float) -> float:
    """Error of the measured heading (rad) by the sources on a step to (x, y) [Fischer 2008, 4.1.2].

    Entering a source's radius turns the heading by its amplitude, once; the sign is the side on which the source is passed. The turn stays: the
    sensor's own filter remembers earlier fields. `inside` (s,): whether the last step was within each radius; updated.
    """
    added = 0.0
    for k in range(len(sources)):
        dx, dy = sources[k, 0] - x, sources[k, 1] - y
        now = dx * dx + dy * dy < sources[k, 2] ** 2
        if now and not inside[k]:
            left = math.cos(heading) * dy - math.sin(heading) * dx >= 0.0
            added += sources[k, 3] if left else -sources[k, 3]
        inside[k] = now
    return added


@kernel
def is_in_reach(world: BeaconGround, k: int, x: float, y: float) -> bool:
    """Whether beacon k works and a boot at (x, y) is within its reach."""
    dx, dy = x - world.beacons[k, 0], y - world.beacons[k, 1]
    return bool(world.works[k]) and dx * dx + dy * dy <= world.reach_m * world.reach_m


@kernel
def measure(world: BeaconGround, k: int, x: float, y: float, rng: np.random.Generator) -> tuple[float, float]:
    """Range (m) and bearing (rad, from the beacon's axis) that beacon k measures to a boot at (x, y) [Fischer 2008, 4.1.1]."""
    dx, dy = x - world.beacons[k, 0], y - world.beacons[k, 1]
    range_m = math.hypot(dx, dy) + world.range_sd_m * rng.standard_normal()
    if rng.random() < world.outliers:
        range_m += OUTLIER_M
    bearing = math.atan2(dy, dx) - world.beacons[k, 2] + world.bearing_sd_rad * rng.standard_normal()
    return max(range_m, 0.0), math.atan2(math.sin(bearing), math.cos(bearing))
