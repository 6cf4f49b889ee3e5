# SPDX-License-Identifier: MIT
"""The paper's fusion of dead reckoning and ultrasound [Fischer 2008, 4.1.1]; without ultrasound, dead reckoning alone.

In: dead-reckoned steps, and what the nearest beacon measures. Out: an estimated place and heading. Owns the fields of a `Fusion` record.
"""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np

from echostep.arrays import Floats, record_dtype
from echostep.jit import kernel, part
from echostep_simulation.world.beacon_ground import BeaconGround, is_in_reach, measure
from echostep_studies.fischer2008.walker import GuidedWalker

THRESHOLD_M = 1.0  # "on the scale of a meter or more" [Fischer 2008, 4.1.1]


class Fusion(Protocol):
    """A record of floats: the estimate, in metres and radians."""

    x: float
    y: float
    offset: float  # added to the measured heading
    reliable_x: float  # last reliable place
    reliable_y: float
    confirmed: float  # 1: ultrasound has confirmed or corrected the place since the last guidance


FUSION = record_dtype(Fusion)


@part
def start_fusion(fusion: Fusion, x: float, y: float) -> None:
    """Start at a place that is known exactly."""
    fusion.x, fusion.y, fusion.reliable_x, fusion.reliable_y = x, y, x, y


@part
def add_step(fusion: Fusion, dx: float, dy: float) -> None:
    """Move the estimate by one dead-reckoned step (m, walk frame), rotated by the heading's offset."""
    c, s = math.cos(fusion.offset), math.sin(fusion.offset)
    fusion.x, fusion.y = fusion.x + c * dx - s * dy, fusion.y + s * dx + c * dy


@part
def fuse_nearest(world: BeaconGround, walker: GuidedWalker, fusion: Fusion, rng: np.random.Generator) -> None:
    """One ultrasound event: all beacons in reach measure, and the measurement with the shortest range is fused."""
    closest, shortest_m, its_bearing = -1, np.inf, 0.0
    for k in range(len(world.beacons)):
        if is_in_reach(world, k, walker.x, walker.y):
            range_m, bearing = measure(world, k, walker.x, walker.y, rng)
            if range_m < shortest_m:
                closest, shortest_m, its_bearing = k, range_m, bearing
    if closest >= 0:
        fuse(fusion, world.believed[closest], shortest_m, its_bearing, THRESHOLD_M)


@kernel
def fuse(fusion: Fusion, beacon: Floats, range_m: float, bearing: float, threshold_m: float) -> None:
    """Fuse one measurement by a beacon (x, y, axis).

    Beyond the threshold the place is taken from the ultrasound, and the heading is turned by the angle between the wrong place, the last reliable
    one and the new one. The paper does not say which place is reliable: here it is the place of the last guidance that ultrasound had confirmed or
    corrected. With the place of 200 ms before, the angle would be noise.
    """
    x = beacon[0] + range_m * math.cos(beacon[2] + bearing)
    y = beacon[1] + range_m * math.sin(beacon[2] + bearing)
    fusion.confirmed = 1.0
    if math.hypot(x - fusion.x, y - fusion.y) <= threshold_m:
        return
    if fusion.x != fusion.reliable_x or fusion.y != fusion.reliable_y:
        before = math.atan2(fusion.y - fusion.reliable_y, fusion.x - fusion.reliable_x)
        fusion.offset += math.atan2(y - fusion.reliable_y, x - fusion.reliable_x) - before
    fusion.x, fusion.y = x, y


@part
def note_reliable(fusion: Fusion) -> None:
    """At a guidance: the present place becomes the last reliable one if ultrasound has confirmed or corrected it."""
    if fusion.confirmed:
        fusion.reliable_x, fusion.reliable_y, fusion.confirmed = fusion.x, fusion.y, 0.0
