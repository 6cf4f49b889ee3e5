"""Beacons in the cloud: what each particle believes of each beacon, and what a measurement says of both [Montemerlo 2002, FastSLAM].

In: particles, and what beacons measure to the boot: a range, and a bearing from the beacon's own axis. Out: log-weights, and the beacons' places.
Owns each particle's beliefs, `Beliefs`. A beacon is a state of three (x, y in the map, axis) with a covariance, one small Kalman filter for each
particle and beacon: given the particle's path, beacons do not depend on each other.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from echostep.arrays import Bools, Floats, Ints
from echostep.jit import kernel
from echostep.walls.index import WallIndex, crosses_wall

TWO_PI = 2.0 * math.pi
SURE = 3.0  # log-odds that one doubt, or one trust, can gain


@dataclass(frozen=True, slots=True)
class BeaconSettings:
    """What a beacon's measurement is worth.

    `range_sd_m` is wider than the beacon's own 5 cm by what boot, body and cloud leave out; `bearing_sd_deg` [Fischer 2008, 4.1.1]. `range_outliers`,
    `bearing_outliers`: shares of measurements that may be anything within `span_m` and the circle. `hidden`: share of inliers through a wall.
    `drop_sd_m`: of the place of a beacon about him who drops it. `drift_m`: what a beacon's place grows by, per square root of a measurement.
    `kick_per_m`, `kick_deg`: how often the heading jumps (a slipping mount; iron, where a compass leads), and the standard deviation of such a jump;
    `tries_per_m`: how often particles try it. `step_sd`: of the length of a move on open ground, per square root of a metre. `moved`: share of
    beacons that are not where they are believed to be.
    """

    range_sd_m: float = 0.4
    bearing_sd_deg: float = 30.0
    range_outliers: float = 0.2
    bearing_outliers: float = 0.05
    hidden: float = 0.1
    span_m: float = 15.0
    drop_sd_m: float = 0.5
    drift_m: float = 0.003
    kick_per_m: float = 0.01
    tries_per_m: float = 0.05
    kick_deg: float = 45.0
    step_sd: float = 0.05
    moved: float = 0.03


class BeaconModel(NamedTuple):
    """The settings as a kernel takes them, in radians."""

    range_sd_m: float
    bearing_sd_rad: float
    range_outliers: float
    bearing_outliers: float
    hidden: float
    span_m: float
    drift_m: float
    kick_per_m: float
    tries_per_m: float
    kick_rad: float
    moved: float


def beacon_model(settings: BeaconSettings) -> BeaconModel:
    """The kernel's form of the settings."""
    return BeaconModel(
        settings.range_sd_m, math.radians(settings.bearing_sd_deg), settings.range_outliers, settings.bearing_outliers,
        settings.hidden, settings.span_m, settings.drift_m,
        settings.kick_per_m, settings.tries_per_m, math.radians(settings.kick_deg), settings.moved,
    )  # fmt: skip


class Beliefs(NamedTuple):
    """Of n particles about b beacons: `mean` (n, b, 3): x, y (m), axis (rad); `cov` (n, b, 6): xx, xy, xa, yy, ya, aa; `doubt` (n, b): log-odds that

    the beacon is not there any more, above those of one that has just been placed.
    """

    mean: Floats
    cov: Floats
    doubt: Floats


def no_beliefs(particles: int, beacons: int) -> Beliefs:
    """Room for beacons of which nothing is known yet."""
    return Beliefs(np.zeros((particles, beacons, 3)), np.zeros((particles, beacons, 6)), np.zeros((particles, beacons)))


@kernel
def place(beliefs: Beliefs, k: int, x: float, y: float, axis: float, place_var: float, axis_var: float) -> None:
    """All particles believe the same of beacon k: where it is, within variances in m2 and rad2."""
    for i in range(len(beliefs.mean)):
        beliefs.mean[i, k] = x, y, axis
        beliefs.cov[i, k] = place_var, 0.0, 0.0, place_var, 0.0, axis_var
        beliefs.doubt[i, k] = 0.0


@kernel
def drop(
    beliefs: Beliefs, k: int, x: Floats, y: Floats, range_m: float, bearing: float, model: BeaconModel, drop_var: float, dropped: float,
    rng: np.random.Generator,
) -> None:  # fmt: skip
    """Beacon k is heard for the first time. Each particle puts it at the range that was heard, in a direction of its own.

    A near one was just dropped and lies about him; of a far one each particle's direction is a guess that the next measurements judge.
    """
    near = range_m * range_m < 4.0 * drop_var
    for i in range(len(beliefs.mean)):
        beliefs.doubt[i, k] = 0.0
        if near or rng.random() < dropped:
            beliefs.mean[i, k] = x[i], y[i], 0.0
            beliefs.cov[i, k] = drop_var, 0.0, 0.0, drop_var, 0.0, math.pi * math.pi
            continue
        direction = TWO_PI * rng.random()
        beliefs.mean[i, k, 0] = x[i] + range_m * math.cos(direction)
        beliefs.mean[i, k, 1] = y[i] + range_m * math.sin(direction)
        beliefs.mean[i, k, 2] = direction + math.pi - bearing
        sd = 0.3 + 0.1 * range_m
        beliefs.cov[i, k] = sd * sd, 0.0, 0.0, sd * sd, 0.0, model.bearing_sd_rad**2 + 0.01


@kernel
def wrapped(angle: float) -> float:
    """An angle in (-pi, pi]."""
    return angle - TWO_PI * math.floor((angle + math.pi) / TWO_PI)


@kernel
def weigh(
    x: Floats, y: Floats, log_weight: Floats, beliefs: Beliefs, k: int, range_m: float, bearing: float, model: BeaconModel,
    walls: WallIndex,
) -> tuple[float, float]:  # fmt: skip
    """Reweight the particles by what beacon k measured, and let each correct its belief of the beacon.

    A range is normal about its distance, or anything; a bearing likewise. NaN for a bearing that was not measured. Expected range and its
    variance come from the moments of the belief: of a near beacon the sideways variance makes the mean range longer than the distance of the
    means. A wall on the line of sight leaves few inliers. Who doubts that the beacon is
    still there neither learns of it nor loses weight. Returns the cloud's mean belief that it is, and the effective size after.
    """
    top, trust, total = -np.inf, 0.0, 0.0
    prior = math.log(model.moved / (1.0 - model.moved))
    told = not math.isnan(bearing)
    strange = 1.0 / (model.span_m * (TWO_PI if told else 1.0))  # density of what a beacon says that lies anywhere
    for i in range(len(x)):
        w = math.exp(log_weight[i])
        m, c = beliefs.mean[i, k], beliefs.cov[i, k]
        dx, dy = x[i] - m[0], y[i] - m[1]
        square = dx * dx + dy * dy + 1e-6
        distance = math.sqrt(square)
        ux, uy = dx / distance, dy / distance
        along = ux * ux * c[0] + 2.0 * ux * uy * c[1] + uy * uy * c[3]
        aside = max(c[0] + c[3] - along, 0.0)
        expected = math.sqrt(square + aside)
        variance = (along * square + 0.5 * aside * aside) / (square + aside) + model.range_sd_m**2
        off = range_m - expected
        fits = math.exp(-0.5 * off * off / variance) / math.sqrt(TWO_PI * variance)
        bad = model.range_outliers
        if len(walls.walls) and crosses_wall(x[i], y[i], m[0], m[1], walls):
            bad = 1.0 - model.hidden * (1.0 - bad)
        inlier = (1.0 - bad) * fits
        density = inlier + bad / model.span_m
        inlier /= density
        elsewhere = 1.0 / (1.0 + math.exp(-prior - beliefs.doubt[i, k]))
        if (1.0 - elsewhere) * inlier > 0.5:
            _correct(m, c, -ux, -uy, 0.0, off, model.range_sd_m**2 + 0.5 * aside * aside / (square + aside))
        if told:
            density *= _bearing_density(m, c, x[i], y[i], bearing, model, elsewhere < 0.5)
        there = (1.0 - elsewhere) * density
        either = there + elsewhere * strange
        log_weight[i] += math.log(either)
        beliefs.doubt[i, k] = min(max(beliefs.doubt[i, k] + math.log(strange / density), -SURE), SURE - prior)
        top = max(top, log_weight[i])
        trust += w * there / either
        total += w
        c[0] += model.drift_m**2
        c[3] += model.drift_m**2
    weights, squares = 0.0, 0.0
    for i in range(len(x)):
        log_weight[i] -= top
        w = math.exp(log_weight[i])
        weights += w
        squares += w * w
    return trust / total, weights * weights / squares


@kernel
def _bearing_density(
    m: Floats, c: Floats, x: float, y: float, bearing: float, model: BeaconModel, learn: bool
) -> float:
    """Density of a bearing (1/rad), and correct the belief by it unless it is an outlier; the first one of an unknown axis sets it.

    The first one ties the axis to the place: whoever believes the beacon more to the left believes another axis.
    """
    dx, dy = x - m[0], y - m[1]
    square = dx * dx + dy * dy
    if square < 0.25 or square < c[0] + c[3]:
        return 1.0 / TWO_PI  # a bearing from where the beacon may be itself says nothing
    direction = math.atan2(dy, dx)
    hx, hy = dy / square, -dx / square
    if c[5] > 3.0:
        if not learn:
            return 1.0 / TWO_PI
        m[2] = wrapped(direction - bearing)
        c[2], c[4] = hx * c[0] + hy * c[1], hx * c[1] + hy * c[3]
        c[5] = model.bearing_sd_rad**2 + hx * c[2] + hy * c[4]
        return 1.0 / TWO_PI
    gap = wrapped(bearing - direction + m[2])
    spread = hx * hx * c[0] + 2.0 * hx * hy * c[1] + hy * hy * c[3] - 2.0 * (hx * c[2] + hy * c[4]) + c[5]
    spread += model.bearing_sd_rad**2
    near = math.exp(-0.5 * gap * gap / spread) / math.sqrt(TWO_PI * spread)
    if learn and gap * gap <= 9.0 * spread:
        _correct(m, c, hx, hy, -1.0, gap, model.bearing_sd_rad**2)
    return (1.0 - model.bearing_outliers) * near + model.bearing_outliers / TWO_PI


@kernel
def _correct(m: Floats, c: Floats, hx: float, hy: float, ha: float, off: float, noise_var: float) -> None:
    """Kalman's correction of one belief by a scalar with gradient (hx, hy, ha)."""
    px = c[0] * hx + c[1] * hy + c[2] * ha
    py = c[1] * hx + c[3] * hy + c[4] * ha
    pa = c[2] * hx + c[4] * hy + c[5] * ha
    spread = hx * px + hy * py + ha * pa + noise_var
    gx, gy, ga = px / spread, py / spread, pa / spread
    m[0] += gx * off
    m[1] += gy * off
    m[2] = wrapped(m[2] + ga * off)
    c[0] -= gx * px
    c[1] -= gx * py
    c[2] -= gx * pa
    c[3] -= gy * py
    c[4] -= gy * pa
    c[5] -= ga * pa


@kernel
def moments(beliefs: Beliefs, weight: Floats) -> Floats:
    """What all particles together believe of each beacon (b, 4): x, y (m), standard deviation per axis (m), axis (rad).

    `weight` (n,) sums to 1. One pass over the particles as they lie in memory; squares are of offsets from the first particle's belief.
    """
    mean, cov, _ = beliefs
    sums = np.zeros((mean.shape[1], 5))
    for i in range(len(mean)):
        w = weight[i]
        for k in range(mean.shape[1]):
            m, c, s = mean[i, k], cov[i, k], sums[k]
            dx, dy = m[0] - mean[0, k, 0], m[1] - mean[0, k, 1]
            s[0] += w * dx
            s[1] += w * dy
            s[2] += w * (dx * dx + dy * dy + c[0] + c[3])
            s[3] += w * math.sin(m[2])
            s[4] += w * math.cos(m[2])
    found = np.empty((mean.shape[1], 4))
    for k in range(mean.shape[1]):
        s = sums[k]
        found[k, 0] = mean[0, k, 0] + s[0]
        found[k, 1] = mean[0, k, 1] + s[1]
        found[k, 2] = math.sqrt(0.5 * max(s[2] - s[0] * s[0] - s[1] * s[1], 0.0))
        found[k, 3] = math.atan2(s[3], s[4])
    return found


@kernel
def kick(turn: Floats, log_weight: Floats, way_m: float, model: BeaconModel, rng: np.random.Generator) -> None:
    """Let some particles try a heading that has just jumped, at the price of how seldom that happens: only they can follow it."""
    tried, price = model.tries_per_m * way_m, math.log(model.kick_per_m / model.tries_per_m)
    for i in range(len(turn)):
        if rng.random() < tried:
            turn[i] += model.kick_rad * rng.standard_normal()
            log_weight[i] += price


@kernel
def inherit(beliefs: Beliefs, chosen: Ints) -> None:
    """The particles chosen by a resampling go on with what they believed; their number stays."""
    mean, cov = beliefs.mean[chosen], beliefs.cov[chosen]
    beliefs.mean[:] = mean
    beliefs.cov[:] = cov
    beliefs.doubt[:] = beliefs.doubt[chosen]


@kernel
def stride(
    x: Floats, y: Floats, turn: Floats, scale: Floats, dx: float, dy: float, sd_m: float, turn_sd: float, scale_sd: float, rng: np.random.Generator
) -> None:  # fmt: skip
    """Move all particles by a piece of the path in the walk frame on open ground, where no wall is asked (else: `particles.Cloud`)."""
    for i in range(len(x)):
        turn[i] += turn_sd * rng.standard_normal()
        scale[i] += scale_sd * rng.standard_normal()
        c, s = math.cos(turn[i]), math.sin(turn[i])
        x[i] += scale[i] * (c * dx - s * dy) + sd_m * rng.standard_normal()
        y[i] += scale[i] * (s * dx + c * dy) + sd_m * rng.standard_normal()


DROPPED = 0.7  # share of beacons that are heard for the first time because they have just been dropped, whatever range is heard
FIT, HEARD, UNFIT_RUNS = 0, 1, 2  # columns of `Health.each`
FIT_SHARE = 0.12  # of the newest measurement in a running mean
MISFIT = 0.25  # belief below which a beacon is not where it was
LOST_FIT = 0.4  # belief in all beacons below which it is the cloud that is wrong
REGAINED = 0.25  # share of a lost cloud that is put where the newest measurement allows


class Health(NamedTuple):
    """How well beacons are explained.

    `each` (b, 3): running belief that it is where it was, measurements, how often it was found moved. `all` (2,): the same belief of whatever
    beacons were heard last, times regained. `known` (b,): whether it has been heard.
    """

    each: Floats
    all: Floats
    known: Bools


def unheard(beacons: int) -> Health:
    """Nothing has been heard yet."""
    each = np.zeros((beacons, 3))
    each[:, FIT] = 1.0
    return Health(each, np.array([1.0, 0.0]), np.zeros(beacons, np.bool_))


@kernel
def hear(
    x: Floats, y: Floats, turn: Floats, log_weight: Floats, beliefs: Beliefs, health: Health, k: int, range_m: float, bearing: float,
    model: BeaconModel, drop_var: float, walls: WallIndex, rng: np.random.Generator,
) -> float:  # fmt: skip
    """Take in one measurement of beacon k: place it when it is new, else weigh the particles and learn.

    Notices a beacon that was moved, and a cloud that is wrong. Returns the effective size after it.
    """
    if not health.known[k]:
        health.known[k] = True
        health.each[k, FIT] = 1.0
        drop(beliefs, k, x, y, range_m, bearing, model, drop_var, DROPPED, rng)
        return float(len(x))
    fit, size = weigh(x, y, log_weight, beliefs, k, range_m, bearing, model, walls)
    each, everything = health.each[k], health.all
    each[HEARD] += 1.0
    each[FIT] += FIT_SHARE * (fit - each[FIT])
    if each[FIT] < MISFIT and everything[0] > LOST_FIT:
        each[UNFIT_RUNS] += 1.0
        each[FIT] = 1.0
    everything[0] += 0.5 * FIT_SHARE * (fit - everything[0])
    if everything[0] < LOST_FIT:
        everything[0] = 0.7
        everything[1] += 1.0
        _regain(x, y, turn, log_weight, beliefs, k, range_m, bearing, model, rng)
    return size


@kernel
def _regain(
    x: Floats, y: Floats, turn: Floats, log_weight: Floats, beliefs: Beliefs, k: int, range_m: float, bearing: float, model: BeaconModel,
    rng: np.random.Generator,
) -> None:  # fmt: skip
    """Put a share of the particles where the measurement allows, with any heading; the rest goes on as it was."""
    for i in range(len(x)):
        if rng.random() >= REGAINED:
            continue
        m, c = beliefs.mean[i, k], beliefs.cov[i, k]
        direction = TWO_PI * rng.random()
        if c[5] < 1.0 and not math.isnan(bearing):
            direction = m[2] + bearing + 1.5 * math.sqrt(c[5] + model.bearing_sd_rad**2) * rng.standard_normal()
        x[i] = m[0] + range_m * math.cos(direction)
        y[i] = m[1] + range_m * math.sin(direction)
        turn[i] = TWO_PI * rng.random()
        log_weight[i] = 0.0
        beliefs.doubt[i] = 0.0
