# SPDX-License-Identifier: MIT
"""Beacons in the particle filter: reweight the particles by a measurement, and let each correct its belief of the beacon [Montemerlo 2002].

In: particles, a beacon's measurement to the boot. Out: log-weights, corrected `BeaconBeliefs`. Owns `BeaconHealth`: how well measurements fit,
from which a moved beacon and a lost cloud are noticed.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Bools, Floats
from echostep.beacons.beliefs import (
    AXIS,
    AXIS_AXIS,
    X_AXIS,
    XX,
    XY,
    Y_AXIS,
    YY,
    BeaconBeliefs,
    BeaconMeasurement,
    X,
    Y,
    correct,
)
from echostep.beacons.model import BeaconModel
from echostep.elementary import wrap_angle
from echostep.jit import kernel, lean_kernel, lean_part, part
from echostep.particles.arrays import ParticleArrays
from echostep.particles.limits import THREE_SD2
from echostep.walls.index import WallIndex, crosses_wall

TWO_PI = 2.0 * math.pi
# Assumed, not measured.
GREATEST_ODDS = math.exp(3.0)  # of a particle, that a beacon was moved
LEAST_DOUBT = 1.0 / GREATEST_ODDS  # of a particle, relative to a beacon that has just been placed
CLOSE_BEARING_M2 = 0.25  # squared distance below which a bearing carries no information: half a metre
UNKNOWN_AXIS_RAD2 = 3.0  # variance above which an axis is unknown: a uniform one has pi^2 / 3
KNOWN_AXIS_RAD2 = 1.0  # variance below which an axis determines on which side of the beacon the boot is
FIT_SHARE = 0.12  # of the newest measurement in a running mean
MISFIT = 0.25  # running probability below which a beacon was moved
LOST_FIT = 0.4  # the same of all beacons together: below it the cloud is wrong
RECOVERED_FIT = 0.7  # of all beacons together after a recovery
RECOVERED_SHARE = 0.25  # of a lost cloud: particles put where the newest measurement allows
RECOVERY_WIDTH = 1.5  # standard deviations of the direction are widened by this in a recovery
ACQUITTED_FIT = 0.75  # running probability above which a beacon that was found moved is where it was believed after all
IN_PLACE, MEASUREMENTS, TIMES_MOVED, SUSPECT = 0, 1, 2, 3  # columns of `BeaconHealth.each`
CLOUD_FIT, RECOVERIES = 0, 1  # entries of `BeaconHealth.all`


class BeaconHealth(NamedTuple):
    """How well the measurements of b beacons fit.

    `each` (b, 4): IN_PLACE, running probability that the beacon was not moved; MEASUREMENTS; TIMES_MOVED, how often it was found moved; SUSPECT, 1
    from then on until it has a new place or fits the old one again. `all` (2,): CLOUD_FIT, the same probability over all beacons; RECOVERIES. `known`
    (b,): whether the beacon has beliefs.
    """

    each: Floats
    all: Floats
    known: Bools


def initial_health(beacons: int) -> BeaconHealth:
    """Health of beacons without measurements."""
    each = np.zeros((beacons, 4))
    each[:, IN_PLACE] = 1.0
    return BeaconHealth(each, np.array([1.0, 0.0]), np.zeros(beacons, np.bool_))


@kernel
def update_by_measurement(
    particles: ParticleArrays, beliefs: BeaconBeliefs, health: BeaconHealth, measurement: BeaconMeasurement,
    model: BeaconModel, walls: WallIndex, rng: np.random.Generator,
) -> float:  # fmt: skip
    """Update particles, beliefs and health by one measurement of a known beacon.

    Notices a beacon that was moved, and a cloud that is wrong. Returns the effective size after it.
    """
    fit, size = reweight(particles, beliefs, measurement, model, walls)
    each, together = health.each[measurement.slot], health.all
    each[MEASUREMENTS] += 1.0
    each[IN_PLACE] += FIT_SHARE * (fit - each[IN_PLACE])
    if each[SUSPECT]:
        if each[IN_PLACE] > ACQUITTED_FIT:
            each[SUSPECT] = 0.0
    elif each[IN_PLACE] < MISFIT:
        each[TIMES_MOVED] += 1.0
        each[SUSPECT] = 1.0
    together[CLOUD_FIT] += 0.5 * FIT_SHARE * (fit - together[CLOUD_FIT])
    if together[CLOUD_FIT] < LOST_FIT:
        together[CLOUD_FIT] = RECOVERED_FIT
        together[RECOVERIES] += 1.0
        _recover(particles, beliefs, measurement, model, rng)
    return size


@lean_kernel
def reweight(
    particles: ParticleArrays, beliefs: BeaconBeliefs, measurement: BeaconMeasurement, model: BeaconModel, walls: WallIndex
) -> tuple[float, float]:  # fmt: skip
    """Reweight the particles by one measurement, correct their beliefs of the beacon, and bring the greatest log-weight to 0.

    The likelihood mixes two hypotheses: the beacon is where the particle believes it, or it was moved and any measurement is equally likely. The
    particle's `doubt` gives the odds of the second; a particle that considers it more likely does not correct its belief.
    Returns the cloud's mean probability of the first hypothesis, and the effective size after.
    """
    k, log_weight = measurement.slot, particles.log_weight
    top, in_place, total, after, squares = -np.inf, 0.0, 0.0, 0.0, 0.0
    prior = model.moved / (1.0 - model.moved)
    has_bearing = not math.isnan(measurement.bearing_rad)
    if_moved = 1.0 / (
        model.span_m * (TWO_PI if has_bearing else 1.0)
    )  # density of the measurement, per metre (and radian)
    for i in range(len(log_weight)):
        w = math.exp(log_weight[i])
        x, y, mean, cov = particles.x_m[i], particles.y_m[i], beliefs.mean[i, k], beliefs.cov[i, k]
        odds = prior * beliefs.doubt[i, k]
        moved = odds / (1.0 + odds)
        outliers = model.range_outliers
        if len(walls.walls) and crosses_wall(x, y, mean[X], mean[Y], walls):
            outliers = 1.0 - model.hidden * (1.0 - outliers)
        density = _range_density(mean, cov, x, y, measurement.range_m, model, outliers, 1.0 - moved)
        if has_bearing:
            density *= _bearing_density(mean, cov, x, y, measurement.bearing_rad, model, moved < 0.5)
        there = (1.0 - moved) * density
        either = there + moved * if_moved
        log_weight[i] += math.log(either)
        top = max(top, log_weight[i])
        beliefs.doubt[i, k] = min(max(beliefs.doubt[i, k] * if_moved / density, LEAST_DOUBT), GREATEST_ODDS / prior)
        in_place += w * there / either
        total += w
        w *= either
        after += w
        squares += w * w
        cov[XX] += model.drift_m**2
        cov[YY] += model.drift_m**2
    for i in range(len(log_weight)):
        log_weight[i] -= top
    return in_place / total, after * after / squares


@lean_part
def _range_density(
    mean: Floats, cov: Floats, x: float, y: float, range_m: float, model: BeaconModel, outliers: float, in_place: float
) -> float:
    """Density of a range (1/m): normal, or with probability `outliers` uniform over `span_m`; corrects the belief by a range that is an inlier.

    Expected range and its variance come from the moments of the belief. Near the beacon the variance across the line of sight makes the mean range
    longer than the distance of the means; nearer than its own spread, the direction to it is not known, and the range corrects nothing.
    `in_place`: the particle's probability that the beacon was not moved.
    """
    dx, dy = x - mean[X], y - mean[Y]
    square = dx * dx + dy * dy + 1e-6
    inverse = 1.0 / math.sqrt(square)
    ux, uy = inverse * dx, inverse * dy
    along = ux * ux * cov[XX] + 2.0 * ux * uy * cov[XY] + uy * uy * cov[YY]
    across = max(cov[XX] + cov[YY] - along, 0.0)
    expected = math.sqrt(square + across)
    longer_var, inverse = 0.5 * across * across, 1.0 / (square + across)
    variance = (along * square + longer_var) * inverse + model.range_sd_m**2
    innovation = range_m - expected
    inlier = (1.0 - outliers) * (math.exp(-0.5 * innovation * innovation / variance) / math.sqrt(TWO_PI * variance))
    density = inlier + outliers / model.span_m
    if square > across and in_place * inlier > 0.5 * density:
        noise_var = model.range_sd_m**2 + longer_var * inverse
        slope = math.sqrt(square) / expected  # of the expected range, by the distance of the means
        correct(mean, cov, -slope * ux, -slope * uy, 0.0, innovation, noise_var)
    return density


@lean_part
def _bearing_density(
    mean: Floats, cov: Floats, x: float, y: float, bearing: float, model: BeaconModel, learn: bool
) -> float:
    """Density of a bearing (1/rad); with `learn` it corrects the belief, unless it is an outlier. The first one of an unknown axis sets the axis.

    The axis is then correlated with the place: a beacon further to the left has another axis.
    """
    dx, dy = x - mean[X], y - mean[Y]
    square = dx * dx + dy * dy
    if square < CLOSE_BEARING_M2 or square < cov[XX] + cov[YY]:
        return 1.0 / TWO_PI
    direction = math.atan2(dy, dx)
    inverse = 1.0 / square
    hx, hy = inverse * dy, -inverse * dx
    if cov[AXIS_AXIS] > UNKNOWN_AXIS_RAD2:
        if learn:
            mean[AXIS] = wrap_angle(direction - bearing)
            cov[X_AXIS], cov[Y_AXIS] = hx * cov[XX] + hy * cov[XY], hx * cov[XY] + hy * cov[YY]
            cov[AXIS_AXIS] = model.bearing_sd_rad**2 + hx * cov[X_AXIS] + hy * cov[Y_AXIS]
        return 1.0 / TWO_PI
    innovation = wrap_angle(bearing - direction + mean[AXIS])
    variance = hx * hx * cov[XX] + 2.0 * hx * hy * cov[XY] + hy * hy * cov[YY]
    variance = variance - 2.0 * (hx * cov[X_AXIS] + hy * cov[Y_AXIS]) + cov[AXIS_AXIS]
    variance += model.bearing_sd_rad**2
    near = math.exp(-0.5 * innovation * innovation / variance) / math.sqrt(TWO_PI * variance)
    if learn and innovation * innovation <= THREE_SD2 * variance:
        correct(mean, cov, hx, hy, -1.0, innovation, model.bearing_sd_rad**2)
    return (1.0 - model.bearing_outliers) * near + model.bearing_outliers / TWO_PI


@kernel
def propose_heading_jumps(
    turn: Floats, log_weight: Floats, length_m: float, model: BeaconModel, rng: np.random.Generator
) -> None:
    """Over a path of this length turn some particles by a random jump of the heading; their log-weight falls by the rarity of jumps."""
    tried, price = model.tries_per_m * length_m, math.log(model.kick_per_m / model.tries_per_m)
    for i in range(len(turn)):
        if rng.random() < tried:
            turn[i] += model.kick_rad * rng.standard_normal()
            log_weight[i] += price


@part
def _recover(
    particles: ParticleArrays, beliefs: BeaconBeliefs, measurement: BeaconMeasurement, model: BeaconModel,
    rng: np.random.Generator,
) -> None:  # fmt: skip
    """Put RECOVERED_SHARE of the particles where the measurement allows, with any heading; the others are unchanged."""
    range_m, bearing = measurement.range_m, measurement.bearing_rad
    for i in range(len(particles.x_m)):
        if rng.random() >= RECOVERED_SHARE:
            continue
        mean, cov = beliefs.mean[i, measurement.slot], beliefs.cov[i, measurement.slot]
        direction = TWO_PI * rng.random()
        if cov[AXIS_AXIS] < KNOWN_AXIS_RAD2 and not math.isnan(bearing):
            sd = math.sqrt(cov[AXIS_AXIS] + model.bearing_sd_rad**2)
            direction = mean[AXIS] + bearing + RECOVERY_WIDTH * sd * rng.standard_normal()
        particles.x_m[i] = mean[X] + range_m * math.cos(direction)
        particles.y_m[i] = mean[Y] + range_m * math.sin(direction)
        particles.turn_rad[i] = TWO_PI * rng.random()
        particles.log_weight[i] = 0.0
        beliefs.doubt[i] = 1.0
