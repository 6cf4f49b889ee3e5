# SPDX-License-Identifier: MIT
"""Slow, obviously right twin of the vertical filter: one matrix equation at a time [Bar-Shalom, Li and Kirubarajan 2001, 11.6.5; Kim 1994].

In: weights and Gaussians of the hypotheses, rows of observations. Out: the same after the sample, joint weights. Owns nothing; the constants of the
model are those of `vertical_model`.
"""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats
from echostep_studies.barometer import vertical_model as model

UNIT = np.eye(model.SIZE)
SUM = UNIT[model.HEIGHT] + UNIT[model.WEATHER] + UNIT[model.GUST]  # what pressure measures


class Gaussian(NamedTuple):
    """Mean (4,) and covariance (4, 4) of height, rate, weather and gust."""

    mean: Floats
    cov: Floats


class Successor(NamedTuple):
    """What may follow a hypothesis: its level, air and way of moving, the share of the weight that goes there, and its Gaussian."""

    level: int
    air: int
    way: int
    share: float
    gaussian: Gaussian


def normal(off: float, variance: float) -> float:
    """Density of a Gaussian at this distance from its mean."""
    return math.exp(-0.5 * off**2 / variance) / math.sqrt(2.0 * math.pi * variance)


def within(rate: float, dt: float) -> float:
    """Probability that an event of this rate happens within dt."""
    return 1.0 - math.exp(-rate * dt)


def updated(g: Gaussian, h: Floats, value: float, noise_var: float) -> Gaussian:
    """The Gaussian given a measurement of h @ x: the Kalman filter in Joseph's form."""
    gain = g.cov @ h / (h @ g.cov @ h + noise_var)
    rest = UNIT - np.outer(gain, h)
    return Gaussian(g.mean + gain * (value - h @ g.mean), rest @ g.cov @ rest.T + noise_var * np.outer(gain, gain))


def mixed(shares: list[float], parts: list[Gaussian]) -> Gaussian:
    """Mean and covariance of a mixture of Gaussians; the shares sum to 1."""
    mean = np.sum([s * g.mean for s, g in zip(shares, parts, strict=True)], axis=0)
    spread = [g.cov + np.outer(g.mean - mean, g.mean - mean) for g in parts]
    return Gaussian(mean, np.sum([s * c for s, c in zip(shares, spread, strict=True)], axis=0))


def set_to(g: Gaussian, a: int, value: float, sd: float) -> Gaussian:
    """Component a is a new variable of this mean and standard deviation."""
    keep = UNIT - np.outer(UNIT[a], UNIT[a])
    return Gaussian(keep @ g.mean + value * UNIT[a], keep @ g.cov @ keep + sd**2 * np.outer(UNIT[a], UNIT[a]))


def wider(g: Gaussian, a: int, variance: float) -> Gaussian:
    """Independent noise on component a."""
    return Gaussian(g.mean, g.cov + variance * np.outer(UNIT[a], UNIT[a]))


def handed_over(g: Gaussian, a: int, b: int, rest: float) -> Gaussian:
    """Component b becomes exactly `rest`, component a takes the difference: a linear map."""
    change = UNIT.copy()
    change[a, b], change[b, b] = 1.0, 0.0
    offset = rest * (UNIT[b] - UNIT[a])
    return Gaussian(change @ g.mean + offset, change @ g.cov @ change.T)


def near(g: Gaussian, a: int, value: float, width: float) -> tuple[float, Gaussian]:
    """Mean of exp(-(x_a - value)^2 / (2 width^2)) over the Gaussian, and the Gaussian times that factor."""
    factor = math.sqrt(2.0 * math.pi) * width * normal(value - g.mean[a], g.cov[a, a] + width**2)
    return factor, updated(g, UNIT[a], value, width**2)


def motion(way: int) -> tuple[float, float, float]:
    """Mean, standard deviation and time constant of the vertical speed on stairs or in a lift."""
    up = 1.0 if way in (model.STAIRS_UP, model.LIFT_UP) else -1.0
    if way < model.LIFT_UP:
        return up * model.CLIMB_M_S, model.CLIMB_SD_M_S, model.CLIMB_S
    return up * model.RIDE_M_S, model.RIDE_SD_M_S, model.RIDE_S


def propagated(g: Gaussian, air: int, way: int, dt: float) -> Gaussian:
    """New mean F x + b, new covariance F P F^T + Q: weather wanders, a gust wanders or fades, the speed returns to its mean."""
    g = wider(g, model.WEATHER, model.WEATHER_M**2 * dt)
    f, b, q = UNIT.copy(), np.zeros(model.SIZE), np.zeros((model.SIZE, model.SIZE))
    if air == model.HELD:
        g = wider(g, model.GUST, model.HELD_WANDERS_M**2 * dt)
    if air == model.FADING:
        f[model.GUST, model.GUST] = fades = math.exp(-dt / model.FADES_S)
        rate = model.FADING_WANDERS_M**2 + (model.FADING_WANDERS * g.mean[model.GUST]) ** 2
        q[model.GUST, model.GUST] = 0.5 * model.FADES_S * (1.0 - fades**2) * rate
    if way != model.ON:
        speed, sd, tau = motion(way)
        keeps = math.exp(-dt / tau)
        f[model.HEIGHT, model.RATE], f[model.RATE, model.RATE] = tau * (1.0 - keeps), keeps
        b[model.HEIGHT], b[model.RATE] = speed * (dt - tau * (1.0 - keeps)), speed * (1.0 - keeps)
        pair = np.ix_([model.HEIGHT, model.RATE], [model.HEIGHT, model.RATE])
        q[pair] = sd**2 * (1.0 - keeps**2) * np.array([[dt**2 / 3.0, dt / 2.0], [dt / 2.0, 1.0]])
    return Gaussian(f @ g.mean + b, f @ g.cov @ f.T + q)


def evidence(g: Gaussian, way: int, seen: Floats, dt: float) -> float:
    """Likelihood of a height beyond the range of levels: only stairs and lifts pay."""
    height = g.mean[model.HEIGHT]
    beyond = max(height - (seen[model.HIGHEST] + 1.0), (seen[model.LOWEST] - 1.0) - height, 0.0)
    return 1.0 if way == model.ON else math.exp(-dt * model.RANGE_COST * beyond)


def observed(g: Gaussian, way: int, seen: Floats, dt: float) -> tuple[float, Gaussian]:
    """Likelihood of the sample, and the Gaussian after it."""
    likelihood = evidence(g, way, seen, dt)
    claimed = seen[model.CLAIMED]
    if math.isnan(claimed):
        return likelihood, g
    noise_var = seen[model.NOISE] ** 2
    off, variance = claimed - SUM @ g.mean, SUM @ g.cov @ SUM + noise_var
    wide = variance + model.OUTLIER_M**2
    good = (1.0 - model.OUTLIER) * normal(off, variance)
    spike = model.OUTLIER * max(normal(off, wide), math.exp(-25.0) / math.sqrt(2.0 * math.pi * wide))
    share = good / (good + spike)
    return likelihood * (good + spike), mixed([share, 1.0 - share], [updated(g, SUM, claimed, noise_var), g])


def smoothed(joint: Floats, last: Floats) -> Floats:
    """Probabilities at the samples before those of `joint`: the sum over every path of hypotheses from there to the last sample."""
    n, size = len(joint), len(last)
    chances = [[row / row.sum() if row.any() else row for row in pairs] for pairs in joint]  # p(before | now)
    found = np.zeros((n, size))
    for first in range(n):
        for path in itertools.product(range(size), repeat=n - first + 1):
            pairs = zip(chances[first:], path[1:], path[:-1], strict=True)
            found[first, path[0]] += last[path[-1]] * math.prod(chance[now][before] for chance, now, before in pairs)
    return np.asarray(found / found.sum(axis=1, keepdims=True))


def started(heights_m: Floats, prior: Floats, claimed_m: float, noise_m: float) -> tuple[Floats, list[Gaussian]]:
    """On one of the levels, at rest: what pressure claims beyond the level's height is the weather's."""
    weights, gaussians = np.zeros(len(heights_m) * model.MODES), list[Gaussian]()
    for level, air, way in itertools.product(range(len(heights_m)), range(3), range(model.WAYS)):
        mean, cov = np.zeros(model.SIZE), np.zeros((model.SIZE, model.SIZE))
        if (air, way) == (model.CALM, model.ON):
            weights[len(gaussians)] = prior[level] / prior.sum()
            mean[model.HEIGHT], mean[model.WEATHER] = heights_m[level], claimed_m - heights_m[level]
            cov[model.WEATHER, model.WEATHER] = noise_m**2
        gaussians.append(Gaussian(mean, cov))
    return weights, gaussians
