# SPDX-License-Identifier: MIT
"""Vertical motion from pressure: a filter over hypotheses on the wearer's level, way of moving and the state of the air.

In: rows of observations: claimed heights (m) and their noise. Out: a weight and a Gaussian for each hypothesis.
Owns the kernels only; the state lies in the caller's arrays, so results do not depend on how a record is cut into portions.

A hypothesis is (level k, mode). k is the level the wearer is on, or the one where the climb or ride began. The mode combines the way of moving and
the air: calm, or in a gust that is held or fades. Its Gaussian and its constants are in `vertical_model`. Each pair of a hypothesis and a successor
is updated on its own and then merged: the generalised pseudo-Bayesian filter of second order [Bar-Shalom, Li and Kirubarajan 2001, 11.6.5].
Without levels (`free`) k is 0 alone, and level ground is wherever a climb ends.
A whole record is filtered forward and smoothed backward, in blocks of BLOCK samples.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from echostep.arrays import Floats
from echostep.jit import kernel, part
from echostep_studies.barometer import vertical_model as model


def start(heights_m: Floats, prior: Floats, claimed_m: float, noise_m: float) -> tuple[Floats, Floats, Floats]:
    """Weights (15 k,), means (15 k, 4), covariances (15 k, 4, 4): standing on one of the levels, with these probabilities."""
    n = model.MODES * len(heights_m)
    weights, means, covariances = np.zeros(n), np.zeros((n, model.SIZE)), np.zeros((n, model.SIZE, model.SIZE))
    weights[model.ON :: model.MODES] = prior / prior.sum()
    means[model.ON :: model.MODES, model.HEIGHT] = heights_m
    means[model.ON :: model.MODES, model.WEATHER] = claimed_m - heights_m
    covariances[model.ON :: model.MODES, model.WEATHER, model.WEATHER] = noise_m**2
    return weights, means, covariances


@kernel
def filter_samples(
    state: model.State, heights_m: Floats, free: bool, seen: Floats, states: Floats, joint: Floats
) -> None:
    """All samples of a portion; `state` (weights, means, covariances) goes on from them.

    `seen`: (n, 5) time since the sample before (s), claimed height, its noise, lowest and highest level. `free`: level ground is anywhere.
    Filled: `states` (n, 15 k, 3) with weight, height and its variance; `joint` (n, 15 k, 15 k) with p(now, before) for `smooth_backward`, unless it
    has length 0.
    """
    size = len(state[0])
    merged = (
        np.zeros(size),
        np.zeros((size, model.SIZE)),
        np.zeros((size, model.SIZE, model.SIZE)),
        np.zeros((size, size)),
        np.zeros(model.SIZE),
        np.zeros((model.SIZE, model.SIZE)),
    )
    chain = np.zeros((size, size))
    for i in range(len(seen)):
        gap = seen[i, model.DT] > model.GAP_S
        steps = 1 if gap else max(1, math.ceil(seen[i, model.DT] / model.LONGEST_STEP_S - 1e-9))
        for piece in range(steps):
            now = seen[i].copy()
            now[model.DT] /= steps
            if piece < steps - 1:
                now[model.CLAIMED] = np.nan
            _step(state, heights_m, free, gap, now[model.DT], now, merged)
            if len(joint):
                chain = merged[3].copy() if piece == 0 else _chain_joint(merged[3], chain)
        for s in range(size):
            states[i, s, model.RESULT_WEIGHT] = state[0][s]
            states[i, s, model.RESULT_HEIGHT], states[i, s, model.RESULT_VARIANCE] = (
                state[1][s, model.HEIGHT],
                state[2][s, model.HEIGHT, model.HEIGHT],
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
def _step(
    state: model.State, heights_m: Floats, free: bool, gap: bool, dt: float, seen: Floats, merged: model.Merged
) -> None:
    """One step of time: every hypothesis with each of its successors, updated and merged into the state."""
    weights, means, covariances = state
    w, m, p, xi, _, _ = merged
    w[:], m[:], p[:], xi[:] = 0.0, 0.0, 0.0, 0.0
    for s in range(len(weights)):
        if weights[s] < model.TINY:
            continue
        if gap:
            _reinitialise_after_gap(state, s, heights_m, free, dt, seen, merged)
            continue
        left = weights[s] - _air_transitions(state, s, dt, seen, merged)
        if s % model.WAYS == model.ON:
            left -= _departures(state, s, free, dt, seen, merged)
        else:
            left -= _arrivals(state, s, heights_m, free, dt, seen, merged)
            left *= math.exp(-dt / model.BETWEEN_S)
        x, c = model.copy_hypothesis(state, s, merged)
        model.merge_successor(x, c, left, s, s, seen, merged)
    total = w.sum()
    if not total > 0.0:  # no hypothesis has weight: the sample is skipped
        xi[:] = np.diag(weights)
        return
    xi /= total
    for s in range(len(w)):
        weights[s] = w[s] / total
        if w[s] > 0.0:
            for a in range(model.SIZE):
                means[s, a] = m[s, a] / w[s]
            for a in range(model.SIZE):
                for b in range(model.SIZE):
                    covariances[s, a, b] = p[s, a, b] / w[s] - means[s, a] * means[s, b]


@part
def _departures(state: model.State, s: int, free: bool, dt: float, seen: Floats, merged: model.Merged) -> float:
    """Transitions from level ground to stairs and lifts; returns the weight that leaves s."""
    weights, here = state[0], s - s % model.WAYS
    often = model.FREE_RATES if free else 1.0
    gone = 0.0
    for target in range(model.STAIRS_UP, model.WAYS):
        share = weights[s] * model.probability_within(
            often * (model.CLIMB_BEGINS if target < model.LIFT_UP else model.RIDE_BEGINS), dt
        )
        x, c = model.copy_hypothesis(state, s, merged)
        model.reset_component(
            x, c, model.RATE, model.CLIMB_STOPS_M_S if target < model.LIFT_UP else model.RIDE_STOPS_M_S
        )
        model.merge_successor(x, c, share, here + target, s, seen, merged)
        gone += share
    return gone


@part
def _air_transitions(state: model.State, s: int, dt: float, seen: Floats, merged: model.Merged) -> float:
    """Transitions of the air from hypothesis s to all others; returns the weight that leaves s.

    calm --GUST_BEGINS/2--> held, fading        level ground only:
    held <--HELD_FADES, FADING_HOLDS--> fading    calm --SHIFTS, SEALED--> calm, weather jumps
    held, fading --GUST_ENDS--> calm              held --GUST_SHIFTS--> calm, the gust becomes weather
    held, fading --GUST_JUMPS--> the same, a new gust
    """
    if s % model.MODES // model.WAYS == model.CALM:
        return _from_calm(state, s, dt, seen, merged)
    return _from_gust(state, s, dt, seen, merged)


@part
def _from_calm(state: model.State, s: int, dt: float, seen: Floats, merged: model.Merged) -> float:
    """A gust begins; on level ground the weather term may jump. Returns the weight that leaves s."""
    weights = state[0]
    gone = 0.0
    for kind in (model.HELD, model.FADING):
        share = weights[s] * model.probability_within(0.5 * model.GUST_BEGINS, dt)
        x, c = model.copy_hypothesis(state, s, merged)
        model.reset_component(x, c, model.GUST, model.GUST_M)
        model.merge_successor(x, c, share, s + kind * model.WAYS, s, seen, merged)
        gone += share
    if s % model.WAYS != model.ON:
        return gone
    share = weights[s] * model.probability_within(model.SHIFTS, dt)
    _jump_weather(state, s, share, model.SHIFT_M, seen, merged)
    gone += share
    off = abs(
        seen[model.CLAIMED] - state[1][s, model.HEIGHT] - state[1][s, model.WEATHER]
    )  # NaN for a sample without pressure
    if off > model.SEALED_OFF_M:
        share = weights[s] * model.probability_within(model.SEALED, dt)
        _jump_weather(state, s, share, model.SEALED_M, seen, merged)
        gone += share
    return gone


@part
def _jump_weather(state: model.State, s: int, share: float, sd: float, seen: Floats, merged: model.Merged) -> None:
    """Hypothesis s with this share of the weight and a jump (sd, m) of the weather term."""
    x, c = model.copy_hypothesis(state, s, merged)
    c[model.WEATHER, model.WEATHER] += sd**2
    model.merge_successor(x, c, share, s, s, seen, merged)


@part
def _from_gust(state: model.State, s: int, dt: float, seen: Floats, merged: model.Merged) -> float:
    """A gust jumps, changes between held and fading, becomes weather, or ends. Returns the weight that leaves s."""
    weights, level, air = state[0], s % model.WAYS == model.ON, s % model.MODES // model.WAYS
    calm = s - air * model.WAYS
    gone = 0.0
    share = weights[s] * model.probability_within(model.GUST_JUMPS, dt)
    x, c = model.copy_hypothesis(state, s, merged)
    model.reset_component(x, c, model.GUST, model.GUST_M)
    model.merge_successor(x, c, share, s, s, seen, merged)
    gone += share
    share = weights[s] * model.probability_within(model.HELD_FADES if air == model.HELD else model.FADING_HOLDS, dt)
    x, c = model.copy_hypothesis(state, s, merged)
    model.merge_successor(
        x, c, share, calm + (model.FADING if air == model.HELD else model.HELD) * model.WAYS, s, seen, merged
    )
    gone += share
    if level and air == model.HELD:
        x, c = model.copy_hypothesis(state, s, merged)
        share = (
            weights[s]
            * model.probability_within(model.GUST_SHIFTS, dt)
            * model.condition_on_value(x, c, model.GUST, 0.0, model.SHIFT_M)
        )
        model.move_component(x, c, model.WEATHER, model.GUST, 0.0)
        model.merge_successor(x, c, share, calm, s, seen, merged)
        gone += share
    x, c = model.copy_hypothesis(state, s, merged)
    share = (
        weights[s]
        * model.probability_within(model.GUST_ENDS, dt)
        * model.condition_on_value(x, c, model.GUST, 0.0, model.GUST_OVER_M)
    )
    model.reset_component(x, c, model.GUST, 0.0)
    model.merge_successor(x, c, share, calm, s, seen, merged)
    return gone + share


@part
def _arrivals(
    state: model.State, s: int, heights_m: Floats, free: bool, dt: float, seen: Floats, merged: model.Merged
) -> float:
    """Transitions from stairs and lifts to level ground, and of stairs to the other direction; returns the weight that leaves s."""
    weights, means, covariances = state
    here, way, gone = s - s % model.WAYS, s % model.WAYS, 0.0
    air = s % model.MODES - way
    stairs = way < model.LIFT_UP
    ends = weights[s] * model.probability_within(model.CLIMB_ENDS if stairs else model.RIDE_ENDS, dt)
    for j in range(len(heights_m)):
        wide = math.hypot(model.LEVEL_SD_M, model.SCALE * (heights_m[j] - heights_m[s // model.MODES]))
        if not free and abs(means[s, model.HEIGHT] - heights_m[j]) > 5.0 * math.sqrt(
            covariances[s, model.HEIGHT, model.HEIGHT] + wide**2
        ):
            continue
        x, c = model.copy_hypothesis(state, s, merged)
        share = ends * model.condition_on_value(
            x, c, model.RATE, 0.0, model.CLIMB_STOPS_M_S if stairs else model.RIDE_STOPS_M_S
        )
        if not free:
            share *= model.condition_on_value(x, c, model.HEIGHT, heights_m[j], wide)
            model.move_component(x, c, model.WEATHER, model.HEIGHT, heights_m[j])
        model.reset_component(x, c, model.RATE, 0.0)
        model.merge_successor(x, c, share, j * model.MODES + air + model.ON, s, seen, merged)
        gone += share
    if stairs:
        share = weights[s] * model.probability_within(model.CLIMB_TURNS, dt)
        other = model.STAIRS_DOWN if way == model.STAIRS_UP else model.STAIRS_UP
        x, c = model.copy_hypothesis(state, s, merged)
        model.merge_successor(x, c, share, here + other, s, seen, merged)
        gone += share
    return gone


@part
def _reinitialise_after_gap(
    state: model.State, s: int, heights_m: Floats, free: bool, dt: float, seen: Floats, merged: model.Merged
) -> None:
    """Successors of hypothesis s after a gap: same level, another level, or stairs and lifts; weather propagated, pressure shifted or not."""
    count, own, weight = len(heights_m), s // model.MODES, state[0][s]
    stays = (
        max(model.RESTS, math.exp(-dt * 2.0 * (model.CLIMB_BEGINS + model.RIDE_BEGINS)))
        if s % model.WAYS == model.ON
        else 0.0
    )
    last = seen.copy()
    last[model.DT] = 0.0
    for j in range(2 if free else count):
        home = j == (0 if free else own)
        share = stays * home + (1.0 - stays) * (1.0 - model.UNDER_WAY) * ((not home) if free else 1.0 / count)
        for shifted in range(2):
            x, c = _after_gap(state, s, dt, shifted == 1, merged)
            if not free:
                model.reset_component(x, c, model.HEIGHT, 0.0)
                x[model.HEIGHT] = heights_m[j]
            elif not home:
                c[model.HEIGHT, model.HEIGHT] += model.WANDERED_M**2
            model.merge_successor(
                x,
                c,
                weight * share * _shift_probability(dt, shifted),
                (0 if free else j) * model.MODES + model.ON,
                s,
                last,
                merged,
            )
    for target in range(model.STAIRS_UP, model.WAYS):
        x, c = _after_gap(state, s, dt, False, merged)
        wide = model.WANDERED_M if free else 0.5 * (heights_m[count - 1] - heights_m[0]) + model.LEVEL_SD_M
        model.reset_component(x, c, model.HEIGHT, wide)
        x[model.HEIGHT] = state[1][s, model.HEIGHT] if free else 0.5 * (heights_m[count - 1] + heights_m[0])
        stairs = target < model.LIFT_UP
        c[model.RATE, model.RATE] = (model.CLIMB_SD_M_S if stairs else model.RIDE_SD_M_S) ** 2
        x[model.RATE] = (model.CLIMB_M_S if stairs else model.RIDE_M_S) * (
            1.0 if target in (model.STAIRS_UP, model.LIFT_UP) else -1.0
        )
        share = (1.0 - stays) * model.UNDER_WAY / 4.0
        model.merge_successor(x, c, weight * share, own * model.MODES + target, s, last, merged)


@part
def _after_gap(state: model.State, s: int, dt: float, shifted: bool, merged: model.Merged) -> tuple[Floats, Floats]:
    """Copy of hypothesis s after a gap: at rest, no gust, weather propagated, with a shift of the building's pressure if `shifted`."""
    x, c = model.copy_hypothesis(state, s, merged)
    c[model.WEATHER, model.WEATHER] += model.WEATHER_M**2 * dt + (model.TREND_M_S * dt) ** 2
    model.reset_component(x, c, model.RATE, 0.0)
    model.reset_component(x, c, model.GUST, 0.0)
    if shifted:
        c[model.WEATHER, model.WEATHER] += model.SHIFT_M**2
    return x, c


@part
def _shift_probability(dt: float, shifted: int) -> float:
    """Probability over dt that the building's pressure shifted (`shifted` 1), or did not (0)."""
    share = model.probability_within(model.SHIFTS + 0.5 * model.GUST_BEGINS, dt)
    return share if shifted else 1.0 - share


BLOCK = 256  # samples whose joint weights are in memory at once


def smooth(seen: Floats, heights_m: Floats, prior: Floats, *, free: bool) -> tuple[Floats, Floats]:
    """Height and its variance of each hypothesis by the samples so far (n, 15 k, 3), and its weight given all samples (n, 15 k).

    Hypotheses are over levels at `heights_m` (k,), or over level ground at any height (`free`); `prior` (k,) of the level at the start.
    """
    size = len(heights_m) * model.MODES
    filtered, before = np.zeros((len(seen), size, model.RESULTS)), list[model.State]()
    state = start(heights_m, prior, seen[0, model.CLAIMED], seen[0, model.NOISE])
    for block in _blocks(len(seen)):
        before.append((state[0].copy(), state[1].copy(), state[2].copy()))
        filter_samples(state, heights_m, free, seen[block], filtered[block], np.zeros((0, size, size)))
    smoothed = filtered[:, :, model.RESULT_WEIGHT].copy()
    for block, state_before in zip(reversed(list(_blocks(len(seen)))), reversed(before), strict=True):
        joint = np.zeros((block.stop - block.start, size, size))
        filter_samples(state_before, heights_m, free, seen[block], filtered[block], joint)
        earlier = smooth_backward(joint, smoothed[block.stop - 1])
        smoothed[block.start : block.stop - 1] = earlier[1:]
        if block.start:
            smoothed[block.start - 1] = earlier[0]
    return filtered, smoothed


def _blocks(n: int) -> Iterator[slice]:
    for first in range(0, n, BLOCK):
        yield slice(first, min(first + BLOCK, n))
