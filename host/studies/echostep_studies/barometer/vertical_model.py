# SPDX-License-Identifier: MIT
"""One hypothesis of the vertical filter: its state, its constants, propagation and likelihoods.

In: mean x (4,) and covariance c (4, 4) of a hypothesis, a row of observations. Out: both propagated and updated in place, the likelihood, and their
sum into the next state (`Merged`). Owns the constants of the model, no state.

x = [HEIGHT, RATE, WEATHER, GUST]: height (m), vertical speed (m/s), slow and quick errors of the height that pressure claims (m).
The claimed height measures HEIGHT + WEATHER + GUST.
"""

from __future__ import annotations

import math

from echostep.arrays import Floats
from echostep.jit import part

State = tuple[Floats, Floats, Floats]  # weights, means, covariances
Merged = tuple[
    Floats, Floats, Floats, Floats, Floats, Floats
]  # the next state times its weights, joint weights, scratch

ON, STAIRS_UP, STAIRS_DOWN, LIFT_UP, LIFT_DOWN = range(5)  # ways of moving
WAYS = 5
CALM, HELD, FADING = range(3)  # air: no gust, one that stays, one that dies away
MODES = 3 * WAYS  # each way in calm air, then each in held and in fading gusts
HEIGHT, RATE, WEATHER, GUST = range(
    4
)  # state x: height (m), vertical speed (m/s), weather and gust terms of the claimed height (m)
SIZE = 4
RESULTS = 3
RESULT_WEIGHT, RESULT_HEIGHT, RESULT_VARIANCE = range(RESULTS)  # columns of a result
DT, CLAIMED, NOISE, LOWEST, HIGHEST = range(5)  # columns of a row of observations

LONGEST_STEP_S = 0.5  # longest step of the mode transitions
GAP_S = 5.0  # of missing samples: longer gaps reinitialise the modes
TINY, TINIEST = 1e-9, 1e-14  # least weights of a hypothesis and of a successor; smaller ones are pruned

# Rates of transitions, 1/s; assumed
GUST_BEGINS, GUST_ENDS, GUST_JUMPS = 1 / 40, 0.5, 0.3
HELD_FADES, FADING_HOLDS = 0.3, 0.1
SHIFTS, GUST_SHIFTS = 1 / 1200, 1 / 60  # the pressure of the building changes for good
CLIMB_BEGINS, CLIMB_ENDS, CLIMB_TURNS = 1 / 150, 0.5, 1 / 60
RIDE_BEGINS, RIDE_ENDS = 1 / 200, 1.0
# After a gap: least probability of the same level; of stairs or a lift otherwise; sd of the height without levels
RESTS, UNDER_WAY, WANDERED_M = (0.5, 0.2, 10.0)
BETWEEN_S = 40.0  # mean time on stairs and in lifts

WEATHER_M = 0.015  # random walk in a second
TREND_M_S = 0.0023  # 1 hPa/h, over gaps
GUST_M = 1.5  # sd of doors and fans: 18 Pa
HELD_WANDERS_M, FADING_WANDERS_M, FADING_WANDERS = 0.2, 0.4, 0.2  # in a second; the last one times the gust
FADES_S = 1.5
SHIFT_M = 0.8  # fans and stack effect: 10 Pa
# Loss of the weather term by an air lock or a spike in the first sample: rate (1/s), sd, and least innovation at which it is considered
SEALED, SEALED_M, SEALED_OFF_M = 1e-6, 100.0, 15.0
FREE_RATES = 0.5  # factor on the rates of departure without levels, where a climb may end at any height
GUST_OVER_M = 0.3
CLIMB_M_S, CLIMB_SD_M_S, CLIMB_S = 0.25, 0.25, 1.5  # mean, sd, time constant of vertical speed
RIDE_M_S, RIDE_SD_M_S, RIDE_S = 1.0, 0.7, 2.0
CLIMB_STOPS_M_S, RIDE_STOPS_M_S = 0.3, 0.15
LEVEL_SD_M = 0.3  # sd of the stated level heights and of the carried barometer
SCALE = 0.02  # of the rise: temperature of the air
OUTLIER, OUTLIER_M = 0.003, 4.0
RANGE_COST = 2.0  # nats per second and metre beyond the range of levels


@part
def copy_hypothesis(state: State, s: int, merged: Merged) -> tuple[Floats, Floats]:
    """Mean and covariance of hypothesis s, to be changed."""
    x, c = merged[4], merged[5]
    for a in range(SIZE):
        x[a] = state[1][s, a]
        for b in range(SIZE):
            c[a, b] = state[2][s, a, b]
    return x, c


@part
def probability_within(rate: float, dt: float) -> float:
    """Probability that an event of this rate (1/s) happens within dt."""
    return 1.0 - math.exp(-rate * dt)


@part
def reset_component(x: Floats, c: Floats, a: int, sd: float) -> None:
    """Set component a to 0 with this sd, uncorrelated."""
    x[a] = 0.0
    c[a, :] = 0.0
    c[:, a] = 0.0
    c[a, a] = sd**2


@part
def move_component(x: Floats, c: Floats, a: int, b: int, rest: float) -> None:
    """Set component b to exactly `rest` and add the difference to component a, with its covariance."""
    x[a] += x[b] - rest
    c[a, :] += c[b, :]
    c[:, a] += c[:, b]
    reset_component(x, c, b, 0.0)
    x[b] = rest


@part
def condition_on_value(x: Floats, c: Floats, a: int, value: float, width: float) -> float:
    """Multiply the Gaussian by exp(-(x_a - value)^2 / (2 width^2)); returns the mean of that factor."""
    spread = c[a, a] + width**2
    off = value - x[a]
    gain = (c[HEIGHT, a] / spread, c[RATE, a] / spread, c[WEATHER, a] / spread, c[GUST, a] / spread)
    for i in range(SIZE):
        x[i] += gain[i] * off
        for j in range(SIZE):
            c[i, j] -= gain[i] * gain[j] * spread
    return width / math.sqrt(spread) * math.exp(-0.5 * off**2 / spread)


@part
def merge_successor(
    x: Floats, c: Floats, weight: float, target: int, source: int, seen: Floats, merged: Merged
) -> None:
    """Propagate a successor in mode `target` over dt, reweight and update it by the observations, and add it to the merged state."""
    w, m, p, xi, _, _ = merged
    if weight < TINIEST:
        return
    way, air, dt = target % WAYS, target % MODES // WAYS, seen[DT]
    _propagate(x, c, way, air, dt)
    if way != ON:
        beyond = max(0.0, x[HEIGHT] - seen[HIGHEST] - 1.0) + max(0.0, seen[LOWEST] - 1.0 - x[HEIGHT])
        weight *= math.exp(-dt * RANGE_COST * beyond)
    if seen[CLAIMED] == seen[CLAIMED]:
        weight *= _pressure_likelihood(x, c, seen)
    w[target] += weight
    for a in range(SIZE):
        m[target, a] += weight * x[a]
        for b in range(SIZE):
            p[target, a, b] += weight * (c[a, b] + x[a] * x[b])
    xi[target, source] += weight


@part
def _propagate(x: Floats, c: Floats, way: int, air: int, dt: float) -> None:
    """Propagate: random walk of the weather, decay of a fading gust, vertical speed towards the mean of stairs or lift."""
    c[WEATHER, WEATHER] += WEATHER_M**2 * dt
    if air == HELD:
        c[GUST, GUST] += HELD_WANDERS_M**2 * dt
    elif air == FADING:
        fades = math.exp(-dt / FADES_S)
        wanders_m2 = (FADING_WANDERS_M**2 + (FADING_WANDERS * x[GUST]) ** 2) * 0.5 * FADES_S * (1.0 - fades**2)
        x[GUST] *= fades
        for a in range(SIZE):
            c[GUST, a] *= fades
            c[a, GUST] *= fades
        c[GUST, GUST] += wanders_m2
    if way == ON:
        return
    stairs = way < LIFT_UP
    speed = (CLIMB_M_S if stairs else RIDE_M_S) * (1.0 if way in (STAIRS_UP, LIFT_UP) else -1.0)
    sd, tau = (CLIMB_SD_M_S, CLIMB_S) if stairs else (RIDE_SD_M_S, RIDE_S)
    keeps = math.exp(-dt / tau)
    far, noise = tau * (1.0 - keeps), sd**2 * (1.0 - keeps**2)
    x[HEIGHT] += speed * dt + far * (x[RATE] - speed)
    x[RATE] = speed + keeps * (x[RATE] - speed)
    for a in range(SIZE):
        c[HEIGHT, a] += far * c[RATE, a]
        c[RATE, a] *= keeps
    for a in range(SIZE):
        c[a, HEIGHT] += far * c[a, RATE]
        c[a, RATE] *= keeps
    c[HEIGHT, HEIGHT] += noise * dt**2 / 3.0
    c[HEIGHT, RATE] += noise * dt / 2.0
    c[RATE, HEIGHT] += noise * dt / 2.0
    c[RATE, RATE] += noise


@part
def _pressure_likelihood(x: Floats, c: Floats, seen: Floats) -> float:
    """Likelihood of the claimed height as a mixture of a good sample and an outlier; the update is weighted by the good share."""
    h0, h1, h2, h3 = (
        c[HEIGHT, HEIGHT] + c[HEIGHT, WEATHER] + c[HEIGHT, GUST],
        c[RATE, HEIGHT] + c[RATE, WEATHER] + c[RATE, GUST],
        c[WEATHER, HEIGHT] + c[WEATHER, WEATHER] + c[WEATHER, GUST],
        c[GUST, HEIGHT] + c[GUST, WEATHER] + c[GUST, GUST],
    )
    spread = h0 + h2 + h3 + seen[NOISE] ** 2
    off = seen[CLAIMED] - (x[HEIGHT] + x[WEATHER] + x[GUST])
    wide = spread + OUTLIER_M**2
    good = (1.0 - OUTLIER) * math.exp(-0.5 * off**2 / spread) / math.sqrt(2.0 * math.pi * spread)
    spike = OUTLIER * math.exp(-0.5 * min(off**2 / wide, 50.0)) / math.sqrt(2.0 * math.pi * wide)
    share = good / (good + spike)
    gain = (h0 / spread, h1 / spread, h2 / spread, h3 / spread)
    less = share * spread - share * (1.0 - share) * off**2
    for a in range(SIZE):
        x[a] += share * off * gain[a]
        for b in range(SIZE):
            c[a, b] -= gain[a] * gain[b] * less
    return good + spike
