# SPDX-License-Identifier: MIT
"""A trail of beacons whose map is learnt on the way in, while they are dropped.

In: a `BeaconGround`, a cloud without known beacons. Out: the cloud at the deepest point, and the way back as each particle believes it. Owns nothing.

A map that was learnt on the way in is bent as a whole by tens of degrees, but right from beacon to beacon, and each particle has its own.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Bools, Floats
from echostep.beacons.beliefs import X, Y
from echostep.jit import kernel, part
from echostep_app.plan.polyline import along, way_m
from echostep_simulation.world.beacon_ground import BeaconGround
from echostep_studies.fischer2008.beacon_cloud import BeaconCloud, update_by_ultrasound
from echostep_studies.fischer2008.walker import STEP_M, WALKER, GuidedWalker, dead_reckon

DROP_AHEAD_M = 0.3  # a beacon is dropped when the walker is so near to its place on the path; assumed


def walk_in(world: BeaconGround, cloud: BeaconCloud, ultrasound_ticks: int, rng: np.random.Generator) -> float:
    """Learn the map on the way in along the trail; returns the error of the measured heading (rad) at the deepest point."""
    inward = world._replace(
        trail=world.trail[::-1].copy(), beacons=world.dropped, works=np.zeros(len(world.beacons), np.bool_)
    )
    walker = np.zeros(1, WALKER)
    _walk_in(inward, way_m(inward.trail), cloud, walker[0], ultrasound_ticks, rng)
    cloud.heard_ticks[:] = -np.inf
    return float(walker["error"][0])


@kernel
def _walk_in(
    world: BeaconGround, length_m: float, cloud: BeaconCloud, walker: GuidedWalker, ultrasound_ticks: int,
    rng: np.random.Generator,
) -> None:  # fmt: skip
    """Walk along the trail, whose first point is now the exit, and drop the beacons, the last one first; `world.works`: those that lie already."""
    inside = np.zeros(len(world.sources), np.bool_)
    last = len(world.beacons) - 1
    order = np.arange(last, -1, -1)
    for tick in range(int(length_m / STEP_M)):
        walker.x, walker.y, walker.heading = along(world.trail, tick * STEP_M)
        if tick % ultrasound_ticks == 0:
            for k in order:
                world.works[k] = (last - k) * length_m <= (tick * STEP_M + DROP_AHEAD_M) * last
            update_by_ultrasound(world, cloud, walker, tick, order, rng)
        dead_reckon(world, inside, walker)


@part
def believed_trail(cloud: BeaconCloud, i: int, exit_m: Floats) -> Floats:
    """The way back as particle i believes it, (b + 1, 2): from beacon to beacon to the exit. An unknown beacon has the place of the next one."""
    count = len(cloud.beacons.health.known)
    path = np.empty((count + 1, 2))
    path[count] = exit_m
    for k in range(count - 1, -1, -1):
        if cloud.beacons.health.known[k]:
            path[k, 0], path[k, 1] = cloud.beacons.beliefs.mean[i, k, X], cloud.beacons.beliefs.mean[i, k, Y]
        else:
            path[k] = path[k + 1]
    return path


@part
def span_near_heard(path: Floats, recent: Bools) -> tuple[float, float]:
    """Lengths (m) along a path (b + 1, 2) between which the walker must be: from one beacon before those heard (b,) to one behind.

    A bent map may pass the same place twice, but other beacons are heard there.
    """
    from_m, to_m, length_m, before_m, any_heard = 0.0, np.inf, 0.0, 0.0, False
    for k in range(len(recent)):
        if recent[k] and not any_heard:
            from_m, any_heard = before_m, True
        before_m = length_m
        length_m += math.hypot(path[k + 1, 0] - path[k, 0], path[k + 1, 1] - path[k, 1])
        if recent[k]:
            to_m = length_m
    return from_m, to_m
