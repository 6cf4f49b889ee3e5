# SPDX-License-Identifier: MIT
"""Slow, obviously right twin of the beacons in the cloud: one particle, one matrix equation at a time [Montemerlo 2002].

In: particles with their beliefs, one measurement. Out: the same after it. Owns `Particle` and `Belief`; constants are those of the kernels.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from echostep.arrays import Floats
from echostep.beacons.beliefs import BeaconMeasurement
from echostep.beacons.model import BeaconModel
from echostep.beacons.slam import (
    CLOSE_BEARING_M2,
    GREATEST_ODDS,
    KNOWN_AXIS_RAD2,
    LEAST_DOUBT,
    RECOVERED_SHARE,
    RECOVERY_WIDTH,
    UNKNOWN_AXIS_RAD2,
)
from echostep.particles.limits import THREE_SD2
from naive import walls as naive_walls

CIRCLE = 2.0 * math.pi
SOFT_M2 = 1e-6  # added to the squared distance, so that a direction exists on top of the beacon


@dataclass
class Belief:
    """Of one particle about one beacon: x, y, axis (3,), their covariance (3, 3), and the doubt about its place."""

    mean: Floats
    cov: Floats
    doubt: float = 1.0


@dataclass
class Particle:
    """Place (m), turn (rad), log-weight, and a belief of each beacon."""

    place: Floats
    turn: float
    log_weight: float
    beliefs: list[Belief]


def wrapped(angle: float) -> float:
    """The angle within half a circle of 0."""
    return math.remainder(angle, CIRCLE)


def normal(off: float, variance: float) -> float:
    """Density of a Gaussian at this distance from its mean."""
    return math.exp(-0.5 * off**2 / variance) / math.sqrt(CIRCLE * variance)


def correct(belief: Belief, h: Floats, innovation: float, noise_var: float) -> None:
    """Kalman filter in Joseph's form."""
    gain = belief.cov @ h / (h @ belief.cov @ h + noise_var)
    rest = np.eye(3) - np.outer(gain, h)
    belief.mean = belief.mean + gain * innovation
    belief.cov = rest @ belief.cov @ rest.T + noise_var * np.outer(gain, gain)


def expected_range(belief: Belief, place: Floats) -> tuple[float, float, float, float]:
    """Mean and variance of the range by the moments of its square, the variance's part from across the line of sight, and the variance across.

    For a place that is normal along and across the line: E r^2 = d^2 + across, var r^2 = 4 d^2 along + 2 across^2, sd r = sd r^2 / (2 r).
    """
    away = place - belief.mean[:2]
    square = float(away @ away) + SOFT_M2
    line = away / math.sqrt(square)
    along = float(line @ belief.cov[:2, :2] @ line)
    across = max(float(np.trace(belief.cov[:2, :2])) - along, 0.0)
    mean_square = square + across
    curved = 2.0 * across**2 / (4.0 * mean_square)
    return math.sqrt(mean_square), 4.0 * square * along / (4.0 * mean_square) + curved, curved, across


def take_range(
    belief: Belief, place: Floats, range_m: float, model: BeaconModel, outliers: float, in_place: float
) -> float:
    """Density of the range; it corrects the belief where an inlier of a beacon in its place is likelier than all else."""
    expected, variance, curved, across = expected_range(belief, place)
    inlier = (1.0 - outliers) * normal(range_m - expected, variance + model.range_sd_m**2)
    density = inlier + outliers / model.span_m
    away = place - belief.mean[:2]
    if away @ away + SOFT_M2 > across and in_place * inlier / density > 0.5:
        by_place = -(place - belief.mean[:2]) / expected  # of the root of E r^2
        correct(belief, np.array([*by_place, 0.0]), range_m - expected, model.range_sd_m**2 + curved)
    return density


def take_bearing(belief: Belief, place: Floats, bearing: float, model: BeaconModel, learn: bool) -> float:
    """Density of the bearing, which is the direction from beacon to boot from the beacon's axis; the first one sets an unknown axis."""
    (dx, dy), square = place - belief.mean[:2], float(np.sum((place - belief.mean[:2]) ** 2))
    if square < max(CLOSE_BEARING_M2, float(np.trace(belief.cov[:2, :2]))):
        return 1.0 / CIRCLE
    direction, by_place = math.atan2(dy, dx), np.array([dy, -dx]) / square
    if belief.cov[2, 2] > UNKNOWN_AXIS_RAD2:
        if learn:  # axis = direction(place) - bearing: a linear map of the place, and the bearing's own error
            spread = np.array([[1.0, 0.0], [0.0, 1.0], by_place])
            belief.cov = spread @ belief.cov[:2, :2] @ spread.T + np.diag([0.0, 0.0, model.bearing_sd_rad**2])
            belief.mean = np.array([*belief.mean[:2], direction - bearing])
        return 1.0 / CIRCLE
    h = np.array([*by_place, -1.0])
    innovation = wrapped(bearing - (direction - belief.mean[2]))
    variance = float(h @ belief.cov @ h) + model.bearing_sd_rad**2
    density = (1.0 - model.bearing_outliers) * normal(innovation, variance) + model.bearing_outliers / CIRCLE
    if learn and innovation**2 <= THREE_SD2 * variance:
        correct(belief, h, innovation, model.bearing_sd_rad**2)
    return density


def reweight(
    cloud: list[Particle], measurement: BeaconMeasurement, model: BeaconModel, walls: Floats
) -> tuple[float, float]:
    """Bayes' rule for "in its place or moved" and for the weights; returns the cloud's probability of the first, and the effective size."""
    prior_odds = model.moved / (1.0 - model.moved)
    has_bearing = not math.isnan(measurement.bearing_rad)
    anything = 1.0 / (model.span_m * CIRCLE) if has_bearing else 1.0 / model.span_m
    before = np.exp([p.log_weight for p in cloud])
    in_place, likelihood = np.zeros(len(cloud)), np.zeros(len(cloud))
    for i, p in enumerate(cloud):
        belief = p.beliefs[measurement.slot]
        odds = prior_odds * belief.doubt
        moved = odds / (1.0 + odds)
        inliers = 1.0 - model.range_outliers
        if naive_walls.crosses(p.place[0], p.place[1], belief.mean[0], belief.mean[1], walls):
            inliers *= model.hidden
        density = take_range(belief, p.place, measurement.range_m, model, 1.0 - inliers, 1.0 - moved)
        if has_bearing:
            density *= take_bearing(belief, p.place, measurement.bearing_rad, model, moved < 0.5)
        likelihood[i] = (1.0 - moved) * density + moved * anything
        in_place[i] = (1.0 - moved) * density / likelihood[i]
        belief.doubt = float(np.clip(belief.doubt * anything / density, LEAST_DOUBT, GREATEST_ODDS / prior_odds))
        belief.cov = belief.cov + np.diag([model.drift_m**2, model.drift_m**2, 0.0])
    after = before * likelihood
    log_weight = np.log(likelihood) + [p.log_weight for p in cloud]
    for p, value in zip(cloud, log_weight.tolist(), strict=True):
        p.log_weight = value - log_weight.max()
    return float(np.average(in_place, weights=before)), float(after.sum() ** 2 / (after**2).sum())


def recover(
    cloud: list[Particle], measurement: BeaconMeasurement, model: BeaconModel, rng: np.random.Generator
) -> None:
    """A share of the particles goes to where the measurement allows, and trusts all beacons again; draws as the fast one does."""
    for p in cloud:
        if rng.random() >= RECOVERED_SHARE:
            continue
        belief = p.beliefs[measurement.slot]
        direction, variance = CIRCLE * rng.random(), belief.cov[2, 2]
        if variance < KNOWN_AXIS_RAD2 and not math.isnan(measurement.bearing_rad):
            sd = RECOVERY_WIDTH * math.sqrt(variance + model.bearing_sd_rad**2)
            direction = belief.mean[2] + measurement.bearing_rad + sd * rng.standard_normal()
        p.place = belief.mean[:2] + measurement.range_m * np.array([math.cos(direction), math.sin(direction)])
        p.turn, p.log_weight = CIRCLE * rng.random(), 0.0
        for each in p.beliefs:
            each.doubt = 1.0


def jump(turn: Floats, log_weight: Floats, length_m: float, model: BeaconModel, rng: np.random.Generator) -> None:
    """Importance sampling: jumps of the heading are tried more often than they happen, and each pays the ratio; draws as the fast one does."""
    for i in range(len(turn)):
        if rng.random() < model.tries_per_m * length_m:
            turn[i] += model.kick_rad * rng.standard_normal()
            log_weight[i] += math.log(model.kick_per_m) - math.log(model.tries_per_m)


def moments(cloud: list[Particle], slot: int) -> tuple[Floats, Floats, float]:
    """Mean place, its covariance (2, 2), and mean axis of a beacon over all particles: of a mixture of Gaussians."""
    weight = np.exp([p.log_weight for p in cloud])
    weight /= weight.sum()
    place = np.array([p.beliefs[slot].mean[:2] for p in cloud])
    mean = weight @ place
    cov = sum(
        w * (p.beliefs[slot].cov[:2, :2] + np.outer(at - mean, at - mean))
        for w, p, at in zip(weight.tolist(), cloud, place, strict=True)
    )
    axis = np.angle(weight @ np.exp([1j * p.beliefs[slot].mean[2] for p in cloud]))
    return mean, np.asarray(cov), float(axis)
