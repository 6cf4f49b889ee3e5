# SPDX-License-Identifier: MIT
"""The cloud of this study: the tracker's kernels for particles and beacons, on open ground.

In: dead reckoning, and what beacons measure. Out: particles and their beliefs of the beacons. Owns `BeaconCloud`.

The rules are the tracker's: when to resample, where a beacon is placed first and where again. The number of particles is constant; the tracker's
`Cloud` lets it follow the spread.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.beacons.beliefs import BeaconBeliefs, BeaconMeasurement, empty_beliefs, set_beliefs
from echostep.beacons.model import BeaconModel, BeaconSettings, beacon_model
from echostep.beacons.slam import initial_health, propose_heading_jumps
from echostep.beacons.step import Beacons, no_waiting, update_by_reading
from echostep.jit import kernel, part
from echostep.localization import CloudSettings
from echostep.particles.arrays import Move, ParticleArrays
from echostep.particles.kernels import systematic
from echostep.walls.echo_sources import Walls
from echostep.walls.index import WallIndex
from echostep_simulation.world.beacon_ground import BeaconGround, is_in_reach, measure
from echostep_studies.fischer2008.walker import GuidedWalker

CLOUD = CloudSettings()
START_SD_M = CLOUD.start_sd_m  # per axis, of the known place at the start
START_TURN_SD_RAD = math.radians(CLOUD.start_turn_sd_deg)
SCALE_SD = 0.002  # drift of the scale per square root of a metre: dead reckoning by steps
RESAMPLE_BELOW = CLOUD.resample_below  # effective share of the particles
TURN_SD_RAD = math.radians(1.0)  # drift of a compass's heading per square root of a metre; assumed
OPEN_GROUND = Walls(np.zeros((0, 4))).near(np.zeros(1), np.zeros(1), 0.0)


class BeaconCloud(NamedTuple):
    """n particles with their beliefs of b beacons.

    `heard_ticks` (b,): when each beacon last measured. `step_sd`: standard deviation of a move's length, per square root of a metre.
    """

    particles: ParticleArrays
    beacons: Beacons
    heard_ticks: Floats
    model: BeaconModel
    walls: WallIndex
    step_sd: float


def new_cloud(
    size: int, beacons: int, x: float, y: float, settings: BeaconSettings, rng: np.random.Generator
) -> BeaconCloud:
    """So many particles about a known place and heading; no beacon is known."""
    particles = ParticleArrays(
        x + START_SD_M * rng.standard_normal(size),
        y + START_SD_M * rng.standard_normal(size),
        START_TURN_SD_RAD * rng.standard_normal(size),
        np.ones(size),
        np.zeros(size),
    )
    nothing = Beacons(empty_beliefs(size, beacons), initial_health(beacons), no_waiting(beacons))
    heard_ticks = np.full(beacons, -np.inf)
    return BeaconCloud(particles, nothing, heard_ticks, beacon_model(settings), OPEN_GROUND, settings.step_sd)


def set_beacons(cloud: BeaconCloud, beacons: Floats, place_sd_m: float, axis_sd_rad: float) -> None:
    """Give all particles the same beliefs of the beacons (b, 3): x, y, axis, within these standard deviations."""
    for k, (x, y, axis) in enumerate(beacons.tolist()):
        set_beliefs(cloud.beacons.beliefs, k, x, y, axis, place_sd_m**2, axis_sd_rad**2)
    cloud.beacons.health.known[:] = True


@part
def update_by_ultrasound(
    world: BeaconGround, cloud: BeaconCloud, walker: GuidedWalker, tick: int, order: Ints, rng: np.random.Generator
) -> bool:
    """One ultrasound event: propagate by the dead reckoning since the last one, then reweight by each beacon in reach.

    `order` (b,): in which the beacons measure. Returns whether any did.
    """
    _propagate(cloud, walker.moved_x, walker.moved_y, rng)
    walker.moved_x, walker.moved_y = 0.0, 0.0
    measured = False
    for k in order:
        if is_in_reach(world, k, walker.x, walker.y):
            measured, cloud.heard_ticks[k] = True, tick
            range_m, bearing = measure(world, k, walker.x, walker.y, rng)
            _reweight(cloud, BeaconMeasurement(k, range_m, bearing), rng)
    return measured


@part
def _propagate(cloud: BeaconCloud, dx: float, dy: float, rng: np.random.Generator) -> None:
    """Move the particles by (dx, dy) in the walk frame, and let some of them try a jump of the heading."""
    length = math.hypot(dx, dy)
    if length > 0.0:
        root, particles = math.sqrt(length), cloud.particles
        move = Move(dx, dy, cloud.step_sd * root, TURN_SD_RAD * root, SCALE_SD * root)
        _propagate_on_open_ground(particles, move, rng)
        propose_heading_jumps(particles.turn_rad, particles.log_weight, length, cloud.model, rng)


@part
def _reweight(cloud: BeaconCloud, measurement: BeaconMeasurement, rng: np.random.Generator) -> None:
    """Update by one measurement; systematic resampling when too few particles carry the weight."""
    particles, has_plan = cloud.particles, len(cloud.walls.walls) > 0
    size = update_by_reading(particles, cloud.beacons, measurement, cloud.model, cloud.walls, has_plan, rng)
    if size < RESAMPLE_BELOW * len(particles.x_m):
        chosen = systematic(np.exp(particles.log_weight), rng.random(), len(particles.x_m))
        _keep_chosen(particles, chosen)
        resample_beliefs(cloud.beacons.beliefs, chosen)


@part
def _propagate_on_open_ground(particles: ParticleArrays, move: Move, rng: np.random.Generator) -> None:
    """Move every particle on open ground, without walls."""
    x, y, turn, scale, _ = particles
    for i in range(len(x)):
        turn[i] += move.turn_sd_rad * rng.standard_normal()
        scale[i] += move.scale_sd * rng.standard_normal()
        c, s = math.cos(turn[i]), math.sin(turn[i])
        x[i] += scale[i] * (c * move.dx_m - s * move.dy_m) + move.sd_m * rng.standard_normal()
        y[i] += scale[i] * (s * move.dx_m + c * move.dy_m) + move.sd_m * rng.standard_normal()


@part
def _keep_chosen(particles: ParticleArrays, chosen: Ints) -> None:
    """Replace the particles by the chosen ones (n,) in place, with equal weights; their number stays."""
    x, y, turn, scale, log_weight = particles
    x[:], y[:], turn[:], scale[:] = x[chosen], y[chosen], turn[chosen], scale[chosen]
    log_weight[:] = 0.0


@kernel
def resample_beliefs(beliefs: BeaconBeliefs, chosen: Ints) -> None:
    """Replace the beliefs by those of the chosen particles (n,) in place."""
    beliefs.mean[:], beliefs.cov[:], beliefs.doubt[:] = beliefs.mean[chosen], beliefs.cov[chosen], beliefs.doubt[chosen]
