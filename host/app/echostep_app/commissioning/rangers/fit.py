# SPDX-License-Identifier: MIT
"""The settings that explain known pings best, with their standard deviations, and the log-score on pings that were not used.

In: `KnownPings` in order of time, the settings to begin with. Out: `RangerFit`s. Owns nothing.

Maximum likelihood on a scale on which each value is free (logarithm, logit), held by a weak prior about the settings to begin with. Errors of pings
that follow one another are alike, so the covariance is taken over blocks of pings: H^-1 J H^-1, H the curvature, J of the blocks' slopes
[White 1982, maximum likelihood of misspecified models].
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from echostep.arrays import Floats
from echostep.echoes.likelihood import EchoSettings, echo_model
from echostep.walls.index import EAR_REACH_M
from echostep_app.commissioning.rangers.known_pings import KnownPings, log_densities

BIAS, MISSED = "bias_m", "missed"  # of one ranger; the others are names of `EchoSettings`
SHARES = (MISSED, "stray", "outlier", "hidden")
OWN = (BIAS, "maximum_m", "rim_db", "sd_m", "stray")  # properties of a ranger
NUISANCE = (MISSED, "outlier", "hidden")  # effects of building, people and connections
FITTED = OWN + NUISANCE
# Assumed: rangers of one kind differ by this much, on the scale of the fit; a bias by 5 cm [real rangers: -0.3 to 5 cm]
PRIOR_SD, PRIOR_BIAS_M = 1.0, 0.05
START_MISSED = 0.02
LEAST_REACH = 2.5  # of the shortest range: `EchoSettings` asks for more than 2
BLOCK = 20  # pings whose errors are alike: two seconds, 2 m of way
STEP = 0.02  # of a slope, on the scale of the fit
LEAST_PINGS = 200  # of one ranger: twenty seconds of walking


@dataclass(frozen=True, slots=True)
class RangerFit:
    """`values` and standard deviations `sd` by name. `score`, `score_before`: mean log-density of pings that were not fitted, and of the same pings
    by the settings to begin with, of which only NUISANCE was fitted; `gain_sd`: standard deviation of their difference.
    """

    values: dict[str, float]
    sd: dict[str, float]
    score: float
    score_before: float
    gain_sd: float
    pings: int

    def settings(self, base: EchoSettings) -> EchoSettings:
        """The settings with these values."""
        own = {name: value for name, value in self.values.items() if name not in (BIAS, MISSED)}
        return replace(base, **own)


def fit_ranger(pings: KnownPings, base: EchoSettings, names: Sequence[str] = FITTED) -> RangerFit:
    """Fit the named values to the pings of one ranger; the score of each half of the blocks is by a fit to the other."""
    folds = np.arange(len(pings.range_m)) // BLOCK % 2
    held_out, before = np.empty(len(folds)), np.empty(len(folds))
    for fold in (0, 1):
        other, own = pings.rows(folds != fold), folds == fold
        for scores, fitted in ((held_out, names), (before, NUISANCE)):
            scores[own] = _log_p(pings.rows(own), base, fitted, _best(other, base, fitted))
    x = _best(pings, base, names)
    gain = _block_sums(held_out - before)
    return RangerFit(
        {name: _value(name, v) for name, v in zip(names, x.tolist(), strict=True)},
        _deviations(pings, base, names, x),
        float(held_out.mean()),
        float(before.mean()),
        float(gain.std() * math.sqrt(len(gain)) / len(before)),
        len(before),
    )


def score(pings: KnownPings, values: dict[str, float], base: EchoSettings) -> Floats:
    """Log-density (n,) of pings by these values."""
    names = tuple(values)
    return _log_p(pings, base, names, np.array([_free(name, values[name]) for name in names]))


def _start(base: EchoSettings, names: Sequence[str]) -> Floats:
    usual = {BIAS: 0.0, MISSED: START_MISSED}
    return np.array([_free(name, usual.get(name, getattr(base, name, 0.0))) for name in names])


def _free(name: str, value: float) -> float:
    """A value on the scale of the fit."""
    if name == BIAS:
        return value / PRIOR_BIAS_M
    return math.log(value / (1.0 - value)) if name in SHARES else math.log(value)


def _value(name: str, free: float) -> float:
    if name == BIAS:
        return PRIOR_BIAS_M * free
    if name == "maximum_m":
        return min(math.exp(free), EAR_REACH_M)
    return 1.0 / (1.0 + math.exp(-free)) if name in SHARES else math.exp(free)


def _log_p(pings: KnownPings, base: EchoSettings, names: Sequence[str], x: Floats) -> Floats:
    """Log-density (n,) at a place of the fit's scale; a reach too short for the settings counts as their shortest."""
    values = {name: _value(name, v) for name, v in zip(names, x.tolist(), strict=True)}
    bias_m, missed = values.pop(BIAS, 0.0), values.pop(MISSED, 0.0)
    reach_m = max(values.get("maximum_m", base.maximum_m), LEAST_REACH * base.minimum_m)
    settings = replace(base, **values | {"maximum_m": reach_m})
    return log_densities(pings, bias_m, missed, echo_model(settings))


def _best(pings: KnownPings, base: EchoSettings, names: Sequence[str]) -> Floats:
    """The maximum of the posterior, by simplex [Nelder and Mead 1965]: the likelihood has steps at the reach."""
    from scipy.optimize import minimize

    start = _start(base, names)

    def cost(x: Floats) -> float:
        return 0.5 * float(np.sum((x - start) ** 2)) / PRIOR_SD**2 - float(_log_p(pings, base, names, x).sum())

    simplex = np.vstack([start, start + 0.3 * np.eye(len(start))])
    options = {"maxfev": 250 * len(names), "xatol": 5e-3, "fatol": 1e-2, "initial_simplex": simplex}
    found = minimize(cost, start, method="Nelder-Mead", options=options)
    best: Floats = found.x
    return best


def _deviations(pings: KnownPings, base: EchoSettings, names: Sequence[str], x: Floats) -> dict[str, float]:
    """Standard deviation of each value, in its own unit."""
    k = len(x)
    at, steps = _log_p(pings, base, names, x), STEP * np.eye(k)
    up, down = ([_log_p(pings, base, names, x + sign * step) for step in steps] for sign in (1.0, -1.0))
    slopes = np.array([_block_sums(a - b) / (2.0 * STEP) for a, b in zip(up, down, strict=True)])
    curvature = np.array([float((2.0 * at - a - b).sum()) / STEP**2 for a, b in zip(up, down, strict=True)])
    inverse = np.diag(1.0 / (np.maximum(curvature, 0.0) + 1.0 / PRIOR_SD**2))
    spread = np.sqrt(np.diag(inverse @ (slopes @ slopes.T + np.eye(k) / PRIOR_SD**2) @ inverse))
    return {
        name: 0.5 * abs(_value(name, v + s) - _value(name, v - s)) for name, v, s in zip(names, x, spread, strict=True)
    }


def _block_sums(values: Floats) -> Floats:
    return np.add.reduceat(values, np.arange(0, len(values), BLOCK))
