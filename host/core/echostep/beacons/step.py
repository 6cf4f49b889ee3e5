# SPDX-License-Identifier: MIT
"""One reading of a beacon: where it is placed first, how it reweights the cloud, and where it is placed again after it was moved.

In: particles, a beacon's measurement to the boot. Out: log-weights, corrected `Beacons`. Owns `Waiting`: the readings of beacons whose place is
not known, or no longer known. `BeaconMap` and the study of guided returns call the same kernels.

A beacon that is near within its first readings was just dropped and lies about each particle (one range of twenty is too long, the first one too).
A beacon first received from afar is located from several readings, for a near one leaves open on which side of the path it lies. A moved beacon
continues to reweight the particles, each of which doubts it separately, while readings for a new place are collected; they count only while the
plan supports the cloud, because a wrong cloud would place a beacon where it suits that cloud, and other beacons may fit a wrong cloud too.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.beacons.beliefs import BeaconBeliefs, BeaconMeasurement, place_beacon
from echostep.beacons.initialisation import locate_beacon
from echostep.beacons.model import BeaconModel
from echostep.beacons.slam import IN_PLACE, RECOVERIES, SUSPECT, BeaconHealth, update_by_measurement
from echostep.jit import kernel, part
from echostep.particles.arrays import ParticleArrays
from echostep.walls.index import WallIndex

# Assumed, not measured.
MOST_READINGS = 48  # readings kept of a beacon without a place
FIRST = 4  # readings of a beacon, among which a near one means that it was just dropped
LOCATE_EVERY = 4  # readings of a beacon without a place
LOCATED_SD_M = 0.4  # of a place found by `locate_beacon`, about the cloud's own error


class Waiting(NamedTuple):
    """Readings of b beacons that wait for a place.

    `rows` (b, MOST_READINGS, 4): a ring of rows for `locate_beacon`; `taken` (b,): rows written so far.
    """

    rows: Floats
    taken: Ints


class Beacons(NamedTuple):
    """All that is known of b beacons."""

    beliefs: BeaconBeliefs
    health: BeaconHealth
    waiting: Waiting


def no_waiting(beacons: int) -> Waiting:
    """Beacons without readings."""
    return Waiting(np.zeros((beacons, MOST_READINGS, 4)), np.zeros(beacons, np.int64))


@kernel
def update_by_reading(
    particles: ParticleArrays, beacons: Beacons, measurement: BeaconMeasurement, model: BeaconModel, walls: WallIndex,
    plan_supports: bool, rng: np.random.Generator,
) -> float:  # fmt: skip
    """Place the beacon, or update particles and beliefs by its reading; returns the effective size after it.

    `plan_supports`: whether echoes confirm the cloud by the plan.
    """
    beliefs, health, waiting = beacons
    k, size = measurement.slot, float(len(particles.x_m))
    if health.known[k]:
        recoveries = health.all[RECOVERIES]
        size = update_by_measurement(particles, beliefs, health, measurement, model, walls, rng)
        if health.all[RECOVERIES] > recoveries:
            waiting.taken[:] = 0
        if not health.each[k, SUSPECT]:
            waiting.taken[k] = 0
        elif plan_supports:
            _wait(particles, beacons, measurement)
    elif waiting.taken[k] < FIRST and measurement.range_m * measurement.range_m < 4.0 * model.drop_var_m2:
        place_beacon(beliefs, k, particles.x_m, particles.y_m, model.drop_var_m2)
        _trust(beacons, k)
    else:
        _wait(particles, beacons, measurement)
    return size


@part
def _wait(particles: ParticleArrays, beacons: Beacons, measurement: BeaconMeasurement) -> None:
    """Keep a reading, and after each LOCATE_EVERY of them look for the place that they allow.

    Each particle gets the place with its own offset from the cloud's mean, so that the cloud's error is part of the place's.
    """
    beliefs, waiting, k = beacons.beliefs, beacons.waiting, measurement.slot
    x, y = mean_place(particles)
    row = waiting.rows[k, waiting.taken[k] % MOST_READINGS]
    row[0], row[1], row[2], row[3] = x, y, measurement.range_m, measurement.bearing_rad
    waiting.taken[k] += 1
    if waiting.taken[k] % LOCATE_EVERY:
        return
    fix = locate_beacon(waiting.rows[k, : min(waiting.taken[k], MOST_READINGS)])
    if fix.sure:
        place_beacon(beliefs, k, fix.x_m + (particles.x_m - x), fix.y_m + (particles.y_m - y), LOCATED_SD_M**2)
        _trust(beacons, k)


@part
def _trust(beacons: Beacons, k: int) -> None:
    """Beacon k has been placed: no reading contradicts it yet."""
    beacons.health.known[k] = True
    beacons.health.each[k, IN_PLACE] = 1.0
    beacons.health.each[k, SUSPECT] = 0.0
    beacons.waiting.taken[k] = 0


@part
def mean_place(particles: ParticleArrays) -> tuple[float, float]:
    """Weighted mean of the places (m)."""
    total, x, y = 0.0, 0.0, 0.0
    for i in range(len(particles.x_m)):
        w = math.exp(particles.log_weight[i])
        total += w
        x += w * particles.x_m[i]
        y += w * particles.y_m[i]
    return x / total, y / total
