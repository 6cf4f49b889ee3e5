# SPDX-License-Identifier: MIT
"""Vertical motion from pressure: a filter over hypotheses on the wearer's level, way of moving and the state of the air.

In: rows of observations: claimed heights (m) and their noise. Out: a weight and a Gaussian for each hypothesis.
Owns the kernels only; the state lies in the caller's arrays, so results do not depend on how a record is cut into portions.

A hypothesis is (level k, mode). k is the level the wearer is on, or the one where the climb or ride began. The mode combines the way of moving and
the air: calm, or in a gust that is held or fades. Its Gaussian and its constants are in `vertical_model`. Each pair of a hypothesis and a successor
is updated on its own and then merged: the generalised pseudo-Bayesian filter of second order [Bar-Shalom, Li and Kirubarajan 2001, 11.6.5].
Without levels (`free`) k is 0 alone, and level ground is wherever a climb ends.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Floats
from echostep.jit import kernel, part
from echostep_studies.barometer.vertical_model import (
    BETWEEN_S,
    CALM,
    CLAIMED,
    CLIMB_BEGINS,
    CLIMB_ENDS,
    CLIMB_M_S,
    CLIMB_SD_M_S,
    CLIMB_STOPS_M_S,
    CLIMB_TURNS,
    DT,
    FADING,
    FADING_HOLDS,
    FREE_RATES,
    GAP_S,
    GUST,
    GUST_BEGINS,
    GUST_ENDS,
    GUST_JUMPS,
    GUST_M,
    GUST_OVER_M,
    GUST_SHIFTS,
    HEIGHT,
    HELD,
    HELD_FADES,
    LEVEL_SD_M,
    LIFT_UP,
    LONGEST_STEP_S,
    MODES,
    ON,
    RATE,
    RESTS,
    RESULT_HEIGHT,
    RESULT_VARIANCE,
    RESULT_WEIGHT,
    RIDE_BEGINS,
    RIDE_ENDS,
    RIDE_M_S,
    RIDE_SD_M_S,
    RIDE_STOPS_M_S,
    SCALE,
    SEALED,
    SEALED_M,
    SEALED_OFF_M,
    SHIFT_M,
    SHIFTS,
    SIZE,
    STAIRS_DOWN,
    STAIRS_UP,
    TINY,
    TREND_M_S,
    UNDER_WAY,
    WANDERED_M,
    WAYS,
    WEATHER,
    WEATHER_M,
    Merged,
    State,
    condition_on_value,
    copy_hypothesis,
    merge_successor,
    move_component,
    probability_within,
    reset_component,
)


def start(heights_m: Floats, prior: Floats, claimed_m: float, noise_m: float) -> tuple[Floats, Floats, Floats]:
    """Weights (15 k,), means (15 k, 4), covariances (15 k, 4, 4): standing on one of the levels, with these probabilities."""
    n = MODES * len(heights_m)
    weights, means, covariances = np.zeros(n), np.zeros((n, SIZE)), np.zeros((n, SIZE, SIZE))
    weights[ON::MODES] = prior / prior.sum()
    means[ON::MODES, HEIGHT] = heights_m
    means[ON::MODES, WEATHER] = claimed_m - heights_m
    covariances[ON::MODES, WEATHER, WEATHER] = noise_m**2
    return weights, means, covariances


@kernel
def filter_samples(state: State, heights_m: Floats, free: bool, seen: Floats, states: Floats, joint: Floats) -> None:
    """All samples of a portion; `state` (weights, means, covariances) goes on from them.

    `seen`: (n, 5) time since the sample before (s), claimed height, its noise, lowest and highest level. `free`: level ground is anywhere.
    Filled: `states` (n, 15 k, 3) with weight, height and its variance; `joint` (n, 15 k, 15 k) with p(now, before) for `smooth_backward`, unless it
    has length 0.
    """
    size = len(state[0])
    merged = (
        np.zeros(size),
        np.zeros((size, SIZE)),
        np.zeros((size, SIZE, SIZE)),
        np.zeros((size, size)),
        np.zeros(SIZE),
        np.zeros((SIZE, SIZE)),
    )
    chain = np.zeros((size, size))
    for i in range(len(seen)):
        gap = seen[i, DT] > GAP_S
        steps = 1 if gap else max(1, math.ceil(seen[i, DT] / LONGEST_STEP_S - 1e-9))
        for piece in range(steps):
            now = seen[i].copy()
            now[DT] /= steps
            if piece < steps - 1:
                now[CLAIMED] = np.nan
            _step(state, heights_m, free, gap, now[DT], now, merged)
            if len(joint):
                chain = merged[3].copy() if piece == 0 else _chain_joint(merged[3], chain)
        for s in range(size):
            states[i, s, RESULT_WEIGHT] = state[0][s]
            states[i, s, RESULT_HEIGHT], states[i, s, RESULT_VARIANCE] = (
                state[1][s, HEIGHT],
                state[2][s, HEIGHT, HEIGHT],
            )
        if len(joint):
            joint[i] = chain


@part
def _chain_joint(later: Floats, earlier: Floats) -> Floats:
    """p(now, long before) from p(now, before) and p(before, long before)."""
    total = earlier.sum(axis=1)
    conditional = np.zeros_like(earlier)
    for s in range(len(total)):
        if total[s] > 0.0:
            conditional[s] = earlier[s] / total[s]
    return later @ conditional


@kernel
def smooth_backward(joint: Floats, last: Floats) -> Floats:
    """Probabilities (n, 15 k) at the samples *before* those of `joint`, given all samples, and `last` (15 k,) at its last one [Kim 1994]."""
    n, size = len(joint), len(last)
    smoothed = np.zeros((n, size))
    later = last.copy()
    for i in range(n - 1, -1, -1):
        for s in range(size):
            if later[s] <= 0.0:
                continue
            total = joint[i, s].sum()
            if total > 0.0:
                smoothed[i] += later[s] / total * joint[i, s]
        later = smoothed[i] / smoothed[i].sum()
        smoothed[i] = later
    return smoothed


@part
def _step(state: State, heights_m: Floats, free: bool, gap: bool, dt: float, seen: Floats, merged: Merged) -> None:
    """One step of time: every hypothesis with each of its successors, updated and merged into the state."""
    weights, means, covariances = state
    w, m, p, xi, _, _ = merged
    w[:], m[:], p[:], xi[:] = 0.0, 0.0, 0.0, 0.0
    for s in range(len(weights)):
        if weights[s] < TINY:
            continue
        if gap:
            _reinitialise_after_gap(state, s, heights_m, free, dt, seen, merged)
            continue
        left = weights[s] - _air_transitions(state, s, dt, seen, merged)
        if s % WAYS == ON:
            left -= _departures(state, s, free, dt, seen, merged)
        else:
            left -= _arrivals(state, s, heights_m, free, dt, seen, merged)
            left *= math.exp(-dt / BETWEEN_S)
        x, c = copy_hypothesis(state, s, merged)
        merge_successor(x, c, left, s, s, seen, merged)
    total = w.sum()
    if not total > 0.0:  # no hypothesis has weight: the sample is skipped
        xi[:] = np.diag(weights)
        return
    xi /= total
    for s in range(len(w)):
        weights[s] = w[s] / total
        if w[s] > 0.0:
            for a in range(SIZE):
                means[s, a] = m[s, a] / w[s]
            for a in range(SIZE):
                for b in range(SIZE):
                    covariances[s, a, b] = p[s, a, b] / w[s] - means[s, a] * means[s, b]


@part
def _departures(state: State, s: int, free: bool, dt: float, seen: Floats, merged: Merged) -> float:
    """Transitions from level ground to stairs and lifts; returns the weight that leaves s."""
    weights, here = state[0], s - s % WAYS
    often = FREE_RATES if free else 1.0
    gone = 0.0
    for target in range(STAIRS_UP, WAYS):
        share = weights[s] * probability_within(often * (CLIMB_BEGINS if target < LIFT_UP else RIDE_BEGINS), dt)
        x, c = copy_hypothesis(state, s, merged)
        reset_component(x, c, RATE, CLIMB_STOPS_M_S if target < LIFT_UP else RIDE_STOPS_M_S)
        merge_successor(x, c, share, here + target, s, seen, merged)
        gone += share
    return gone


@part
def _air_transitions(state: State, s: int, dt: float, seen: Floats, merged: Merged) -> float:
    """Transitions of the air from hypothesis s to all others; returns the weight that leaves s.

    calm --GUST_BEGINS/2--> held, fading        level ground only:
    held <--HELD_FADES, FADING_HOLDS--> fading    calm --SHIFTS, SEALED--> calm, weather jumps
    held, fading --GUST_ENDS--> calm              held --GUST_SHIFTS--> calm, the gust becomes weather
    held, fading --GUST_JUMPS--> the same, a new gust
    """
    if s % MODES // WAYS == CALM:
        return _from_calm(state, s, dt, seen, merged)
    return _from_gust(state, s, dt, seen, merged)


@part
def _from_calm(state: State, s: int, dt: float, seen: Floats, merged: Merged) -> float:
    """A gust begins; on level ground the weather term may jump. Returns the weight that leaves s."""
    weights = state[0]
    gone = 0.0
    for kind in (HELD, FADING):
        share = weights[s] * probability_within(0.5 * GUST_BEGINS, dt)
        x, c = copy_hypothesis(state, s, merged)
        reset_component(x, c, GUST, GUST_M)
        merge_successor(x, c, share, s + kind * WAYS, s, seen, merged)
        gone += share
    if s % WAYS != ON:
        return gone
    share = weights[s] * probability_within(SHIFTS, dt)
    _jump_weather(state, s, share, SHIFT_M, seen, merged)
    gone += share
    off = abs(seen[CLAIMED] - state[1][s, HEIGHT] - state[1][s, WEATHER])  # NaN for a sample without pressure
    if off > SEALED_OFF_M:
        share = weights[s] * probability_within(SEALED, dt)
        _jump_weather(state, s, share, SEALED_M, seen, merged)
        gone += share
    return gone


@part
def _jump_weather(state: State, s: int, share: float, sd: float, seen: Floats, merged: Merged) -> None:
    """Hypothesis s with this share of the weight and a jump (sd, m) of the weather term."""
    x, c = copy_hypothesis(state, s, merged)
    c[WEATHER, WEATHER] += sd**2
    merge_successor(x, c, share, s, s, seen, merged)


@part
def _from_gust(state: State, s: int, dt: float, seen: Floats, merged: Merged) -> float:
    """A gust jumps, changes between held and fading, becomes weather, or ends. Returns the weight that leaves s."""
    weights, level, air = state[0], s % WAYS == ON, s % MODES // WAYS
    calm = s - air * WAYS
    gone = 0.0
    share = weights[s] * probability_within(GUST_JUMPS, dt)
    x, c = copy_hypothesis(state, s, merged)
    reset_component(x, c, GUST, GUST_M)
    merge_successor(x, c, share, s, s, seen, merged)
    gone += share
    share = weights[s] * probability_within(HELD_FADES if air == HELD else FADING_HOLDS, dt)
    x, c = copy_hypothesis(state, s, merged)
    merge_successor(x, c, share, calm + (FADING if air == HELD else HELD) * WAYS, s, seen, merged)
    gone += share
    if level and air == HELD:
        x, c = copy_hypothesis(state, s, merged)
        share = weights[s] * probability_within(GUST_SHIFTS, dt) * condition_on_value(x, c, GUST, 0.0, SHIFT_M)
        move_component(x, c, WEATHER, GUST, 0.0)
        merge_successor(x, c, share, calm, s, seen, merged)
        gone += share
    x, c = copy_hypothesis(state, s, merged)
    share = weights[s] * probability_within(GUST_ENDS, dt) * condition_on_value(x, c, GUST, 0.0, GUST_OVER_M)
    reset_component(x, c, GUST, 0.0)
    merge_successor(x, c, share, calm, s, seen, merged)
    return gone + share


@part
def _arrivals(state: State, s: int, heights_m: Floats, free: bool, dt: float, seen: Floats, merged: Merged) -> float:
    """Transitions from stairs and lifts to level ground, and of stairs to the other direction; returns the weight that leaves s."""
    weights, means, covariances = state
    here, way, gone = s - s % WAYS, s % WAYS, 0.0
    air = s % MODES - way
    stairs = way < LIFT_UP
    ends = weights[s] * probability_within(CLIMB_ENDS if stairs else RIDE_ENDS, dt)
    for j in range(len(heights_m)):
        wide = math.hypot(LEVEL_SD_M, SCALE * (heights_m[j] - heights_m[s // MODES]))
        if not free and abs(means[s, HEIGHT] - heights_m[j]) > 5.0 * math.sqrt(
            covariances[s, HEIGHT, HEIGHT] + wide**2
        ):
            continue
        x, c = copy_hypothesis(state, s, merged)
        share = ends * condition_on_value(x, c, RATE, 0.0, CLIMB_STOPS_M_S if stairs else RIDE_STOPS_M_S)
        if not free:
            share *= condition_on_value(x, c, HEIGHT, heights_m[j], wide)
            move_component(x, c, WEATHER, HEIGHT, heights_m[j])
        reset_component(x, c, RATE, 0.0)
        merge_successor(x, c, share, j * MODES + air + ON, s, seen, merged)
        gone += share
    if stairs:
        share = weights[s] * probability_within(CLIMB_TURNS, dt)
        other = STAIRS_DOWN if way == STAIRS_UP else STAIRS_UP
        x, c = copy_hypothesis(state, s, merged)
        merge_successor(x, c, share, here + other, s, seen, merged)
        gone += share
    return gone


@part
def _reinitialise_after_gap(
    state: State, s: int, heights_m: Floats, free: bool, dt: float, seen: Floats, merged: Merged
) -> None:
    """Successors of hypothesis s after a gap: same level, another level, or stairs and lifts; weather propagated, pressure shifted or not."""
    count, own, weight = len(heights_m), s // MODES, state[0][s]
    stays = max(RESTS, math.exp(-dt * 2.0 * (CLIMB_BEGINS + RIDE_BEGINS))) if s % WAYS == ON else 0.0
    last = seen.copy()
    last[DT] = 0.0
    for j in range(2 if free else count):
        home = j == (0 if free else own)
        share = stays * home + (1.0 - stays) * (1.0 - UNDER_WAY) * ((not home) if free else 1.0 / count)
        for shifted in range(2):
            x, c = _after_gap(state, s, dt, shifted == 1, merged)
            if not free:
                reset_component(x, c, HEIGHT, 0.0)
                x[HEIGHT] = heights_m[j]
            elif not home:
                c[HEIGHT, HEIGHT] += WANDERED_M**2
            merge_successor(
                x, c, weight * share * _shift_probability(dt, shifted), (0 if free else j) * MODES + ON, s, last, merged
            )
    for target in range(STAIRS_UP, WAYS):
        x, c = _after_gap(state, s, dt, False, merged)
        wide = WANDERED_M if free else 0.5 * (heights_m[count - 1] - heights_m[0]) + LEVEL_SD_M
        reset_component(x, c, HEIGHT, wide)
        x[HEIGHT] = state[1][s, HEIGHT] if free else 0.5 * (heights_m[count - 1] + heights_m[0])
        stairs = target < LIFT_UP
        c[RATE, RATE] = (CLIMB_SD_M_S if stairs else RIDE_SD_M_S) ** 2
        x[RATE] = (CLIMB_M_S if stairs else RIDE_M_S) * (1.0 if target in (STAIRS_UP, LIFT_UP) else -1.0)
        share = (1.0 - stays) * UNDER_WAY / 4.0
        merge_successor(x, c, weight * share, own * MODES + target, s, last, merged)


@part
def _after_gap(state: State, s: int, dt: float, shifted: bool, merged: Merged) -> tuple[Floats, Floats]:
    """Copy of hypothesis s after a gap: at rest, no gust, weather propagated, with a shift of the building's pressure if `shifted`."""
    x, c = copy_hypothesis(state, s, merged)
    c[WEATHER, WEATHER] += WEATHER_M**2 * dt + (TREND_M_S * dt) ** 2
    reset_component(x, c, RATE, 0.0)
    reset_component(x, c, GUST, 0.0)
    if shifted:
        c[WEATHER, WEATHER] += SHIFT_M**2
    return x, c


@part
def _shift_probability(dt: float, shifted: int) -> float:
    """Probability over dt that the building's pressure shifted (`shifted` 1), or did not (0)."""
    share = probability_within(SHIFTS + 0.5 * GUST_BEGINS, dt)
    return share if shifted else 1.0 - share
