"""Going up and down, heard by a barometer: one filter over what the wearer and the air may be doing, with storeys or without.

In: heights that pressure claims (m), their noise, what gait, foot and plan know. Out: a weight and a Gaussian for each hypothesis.
Owns the kernels only; the state lies in plain arrays, so that cutting a record into portions changes nothing.

A hypothesis is (storey k, mode): the storey that he is on, or where he set off; the way of moving; the air, which is calm or in a gust that is
held or fades. Its Gaussian is over x = [height h, vertical speed v, weather d, gust u] in metres and m/s; pressure says h + d + u. Each pair of a
hypothesis and its successor is updated on its own and merged afterwards: the generalised pseudo-Bayesian filter of second order
[Bar-Shalom, Li and Kirubarajan 2001, 11.6.5]. Without storeys k is 0 alone, and level ground is wherever he stops.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Floats
from echostep.jit import kernel

State = tuple[Floats, Floats, Floats]  # weights, means, covariances
Merged = tuple[
    Floats, Floats, Floats, Floats, Floats, Floats
]  # the next state times its weights, joint weights, scratch

ON, STAIRS_UP, STAIRS_DOWN, LIFT_UP, LIFT_DOWN = range(5)  # ways of moving
WAYS = 5
CALM, HELD, FADING = range(3)  # air: no gust, one that stays, one that dies away
MODES = 3 * WAYS  # each way in calm air, then each in held and in fading gusts
UNKNOWN, WALKING, STILL = range(3)  # gait
CONNECTOR, OUTSIDE = 1, 2  # place: on stairs or in a lift by the plan, or certainly not
DT, CLAIMED, NOISE, GAIT, PLACE, FOOT, FOOT_SD, LOWEST, HIGHEST = range(9)  # what is seen in a step

LONGEST_STEP_S = 0.5  # modes may change so often
GAP_S = 5.0  # of silence: what happened meanwhile is not followed, but weighed
TINY, TINIEST = 1e-9, 1e-14  # hypotheses below are forgotten; successors below are not looked at

# How often what begins and ends, 1/s
GUST_BEGINS, GUST_ENDS, GUST_JUMPS = 1 / 40, 0.5, 0.3
HELD_FADES, FADING_HOLDS = 0.3, 0.1
SHIFTS, GUST_SHIFTS = 1 / 1200, 1 / 60  # the pressure of the building changes for good
CLIMB_BEGINS, CLIMB_ENDS, CLIMB_TURNS = 1 / 150, 0.5, 1 / 60
RIDE_BEGINS, RIDE_ENDS = 1 / 200, 1.0
RESTS, UNDER_WAY, WANDERED_M = (
    0.5,
    0.2,
    10.0,
)  # after a silence: still there; else on stairs or in a lift; how far, without storeys
BETWEEN_S = 40.0  # mean time on stairs and in lifts

WEATHER_M = 0.015  # random walk in a second
TREND_M_S = 0.0023  # 1 hPa/h, for times that nobody saw
GUST_M = 1.5  # sd of doors and fans: 18 Pa
HELD_WANDERS_M, FADING_WANDERS_M, FADING_WANDERS = 0.2, 0.4, 0.2  # in a second; the last one times the gust
FADES_S = 1.5
SHIFT_M = 0.8  # fans and stack effect: 10 Pa
# All that was known of the weather is wrong: an air lock, a first sample that was a spike. How often, 1/s; sd; only for what is far off
SEALED, SEALED_M, SEALED_OFF_M = 1e-6, 100.0, 15.0
FREE_RATES = 0.5  # without storeys each metre is a place to stop at, so setting off is the rarer
GUST_OVER_M = 0.3
CLIMB_M_S, CLIMB_SD_M_S, CLIMB_S = 0.25, 0.25, 1.5  # mean, sd, time constant of vertical speed
RIDE_M_S, RIDE_SD_M_S, RIDE_S = 1.0, 0.7, 2.0
CLIMB_STOPS_M_S, RIDE_STOPS_M_S = 0.3, 0.15
STOREY_M = 0.3  # stated storeys and the carried barometer, sd
SCALE = 0.02  # of the rise: temperature of the air
OUTLIER, OUTLIER_M = 0.003, 4.0
PLACE_COST, GAIT_COST, RANGE_COST = 3.0, 1.5, 2.0  # nats a second against what evidence contradicts
FOOT_LEVEL_M_S = 0.1  # what a foot on level ground may claim, over a second


def start(heights_m: Floats, prior: Floats, claimed_m: float, noise_m: float) -> tuple[Floats, Floats, Floats]:
    """Weights (15 k,), means (15 k, 4), covariances (15 k, 4, 4): he stands on one of the storeys, with these probabilities."""
    n = MODES * len(heights_m)
    weights, means, covariances = np.zeros(n), np.zeros((n, 4)), np.zeros((n, 4, 4))
    weights[ON::MODES] = prior / prior.sum()
    means[ON::MODES, 0] = heights_m
    means[ON::MODES, 2] = claimed_m - heights_m
    covariances[ON::MODES, 2, 2] = noise_m**2
    return weights, means, covariances


@kernel
def follow(state: State, heights_m: Floats, free: bool, seen: Floats, found: Floats, joint: Floats) -> None:
    """All samples of a portion; `state` (weights, means, covariances) goes on from them.

    `seen`: (n, 9) time since the sample before (s), claimed height, its noise, gait, place, the foot's vertical speed and its sd over a
    second (NaN: unknown), lowest and highest storey. `free`: level ground is anywhere.
    Filled: `found` (n, 15 k, 5) with weight, h, v, d and the variance of h; `joint`
    (n, 15 k, 15 k) with p(now, before) for `backward`, unless it has length 0.
    """
    size = len(state[0])
    merged = (
        np.zeros(size),
        np.zeros((size, 4)),
        np.zeros((size, 4, 4)),
        np.zeros((size, size)),
        np.zeros(4),
        np.zeros((4, 4)),
    )
    chain = np.zeros((size, size))
    for i in range(len(seen)):
        gap = seen[i, DT] > GAP_S
        steps = 1 if gap else max(1, math.ceil(seen[i, DT] / LONGEST_STEP_S - 1e-9))
        for part in range(steps):
            now = seen[i].copy()
            now[DT] /= steps
            if part < steps - 1:
                now[CLAIMED] = np.nan
            _step(state, heights_m, free, gap, now[DT], now, merged)
            if len(joint):
                chain = merged[3].copy() if part == 0 else _chained(merged[3], chain)
        for s in range(size):
            found[i, s, 0] = state[0][s]
            found[i, s, 1:4] = state[1][s, :3]
            found[i, s, 4] = state[2][s, 0, 0]
        if len(joint):
            joint[i] = chain


@kernel
def _chained(later: Floats, earlier: Floats) -> Floats:
    """p(now, long before) from p(now, before) and p(before, long before)."""
    total = earlier.sum(axis=1)
    conditional = np.zeros_like(earlier)
    for s in range(len(total)):
        if total[s] > 0.0:
            conditional[s] = earlier[s] / total[s]
    return later @ conditional


@kernel
def backward(joint: Floats, last: Floats) -> Floats:
    """Probabilities (n, 15 k) at the samples *before* those of `joint`, given all samples, and `last` (15 k,) at its last one [Kim 1994]."""
    n, size = len(joint), len(last)
    found = np.zeros((n, size))
    later = last.copy()
    for i in range(n - 1, -1, -1):
        for s in range(size):
            if later[s] <= 0.0:
                continue
            total = joint[i, s].sum()
            if total > 0.0:
                found[i] += later[s] / total * joint[i, s]
        later = found[i] / found[i].sum()
        found[i] = later
    return found


@kernel
def _step(state: State, heights_m: Floats, free: bool, gap: bool, dt: float, seen: Floats, merged: Merged) -> None:
    """One step of time: every hypothesis with each of its successors, updated and merged into the state."""
    weights, means, covariances = state
    w, m, p, xi, _, _ = merged
    w[:], m[:], p[:], xi[:] = 0.0, 0.0, 0.0, 0.0
    for s in range(len(weights)):
        if weights[s] < TINY:
            continue
        if gap:
            _reappears(state, s, heights_m, free, dt, seen, merged)
            continue
        left = weights[s] - _air(state, s, dt, seen, merged)
        if s % WAYS == ON:
            left -= _sets_off(state, s, free, dt, seen, merged)
        else:
            left -= _arrives(state, s, heights_m, free, dt, seen, merged)
            left *= math.exp(-dt / BETWEEN_S)
        x, c = _copied(state, s, merged)
        _take(x, c, left, s, s, seen, merged)
    total = w.sum()
    if not total > 0.0:  # nothing explains this sample: it is skipped
        xi[:] = np.diag(weights)
        return
    xi /= total
    for s in range(len(w)):
        weights[s] = w[s] / total
        if w[s] > 0.0:
            for a in range(4):
                means[s, a] = m[s, a] / w[s]
            for a in range(4):
                for b in range(4):
                    covariances[s, a, b] = p[s, a, b] / w[s] - means[s, a] * means[s, b]


@kernel
def _sets_off(state: State, s: int, free: bool, dt: float, seen: Floats, merged: Merged) -> float:
    """From level ground to stairs and lifts; the weight that goes."""
    weights, here = state[0], s - s % WAYS
    often = (10.0 if seen[PLACE] == CONNECTOR else 1.0) * (FREE_RATES if free else 1.0)
    gone = 0.0
    for target in range(STAIRS_UP, WAYS):
        share = weights[s] * _share(often * (CLIMB_BEGINS if target < LIFT_UP else RIDE_BEGINS), dt)
        x, c = _copied(state, s, merged)
        _forget(x, c, 1, CLIMB_STOPS_M_S if target < LIFT_UP else RIDE_STOPS_M_S)
        _take(x, c, share, here + target, s, seen, merged)
        gone += share
    return gone


@kernel
def _air(state: State, s: int, dt: float, seen: Floats, merged: Merged) -> float:
    """Gusts begin, jump, end, and leave a shifted pressure behind; the weight that goes."""
    weights, level, air = state[0], s % WAYS == ON, s % MODES // WAYS
    calm = s - air * WAYS
    gone = 0.0
    if air == CALM:
        for kind in (HELD, FADING):
            share = weights[s] * _share(0.5 * GUST_BEGINS, dt)
            x, c = _copied(state, s, merged)
            _forget(x, c, 3, GUST_M)
            _take(x, c, share, calm + kind * WAYS, s, seen, merged)
            gone += share
        if level:
            share = weights[s] * _share(SHIFTS, dt)
            x, c = _copied(state, s, merged)
            c[2, 2] += SHIFT_M**2
            _take(x, c, share, s, s, seen, merged)
            gone += share
            if (
                abs(seen[CLAIMED] - state[1][s, 0] - state[1][s, 2]) > SEALED_OFF_M
            ):  # never for a sample without pressure
                share = weights[s] * _share(SEALED, dt)
                x, c = _copied(state, s, merged)
                c[2, 2] += SEALED_M**2
                _take(x, c, share, s, s, seen, merged)
                gone += share
        return gone
    share = weights[s] * _share(GUST_JUMPS, dt)
    x, c = _copied(state, s, merged)
    _forget(x, c, 3, GUST_M)
    _take(x, c, share, s, s, seen, merged)
    gone += share
    share = weights[s] * _share(HELD_FADES if air == HELD else FADING_HOLDS, dt)
    x, c = _copied(state, s, merged)
    _take(x, c, share, calm + (FADING if air == HELD else HELD) * WAYS, s, seen, merged)
    gone += share
    if level and air == HELD:
        x, c = _copied(state, s, merged)
        share = weights[s] * _share(GUST_SHIFTS, dt) * _pinned(x, c, 3, 0.0, SHIFT_M)
        _add(x, c, 2, 3, 0.0)
        _take(x, c, share, calm, s, seen, merged)
        gone += share
    x, c = _copied(state, s, merged)
    share = weights[s] * _share(GUST_ENDS, dt) * _pinned(x, c, 3, 0.0, GUST_OVER_M)
    _forget(x, c, 3, 0.0)
    _take(x, c, share, calm, s, seen, merged)
    return gone + share


@kernel
def _arrives(state: State, s: int, heights_m: Floats, free: bool, dt: float, seen: Floats, merged: Merged) -> float:
    """From stairs and lifts to level ground, and about on the stairs; the weight that goes."""
    weights, means, covariances = state
    here, way, gone = s - s % WAYS, s % WAYS, 0.0
    air = s % MODES - way
    stairs = way < LIFT_UP
    ends = weights[s] * _share(CLIMB_ENDS if stairs else RIDE_ENDS, dt)
    for j in range(len(heights_m)):
        wide = math.hypot(STOREY_M, SCALE * (heights_m[j] - heights_m[s // MODES]))
        if not free and abs(means[s, 0] - heights_m[j]) > 5.0 * math.sqrt(covariances[s, 0, 0] + wide**2):
            continue
        x, c = _copied(state, s, merged)
        share = ends * _pinned(x, c, 1, 0.0, CLIMB_STOPS_M_S if stairs else RIDE_STOPS_M_S)
        if not free:
            share *= _pinned(x, c, 0, heights_m[j], wide)
            _add(x, c, 2, 0, heights_m[j])
        _forget(x, c, 1, 0.0)
        _take(x, c, share, j * MODES + air + ON, s, seen, merged)
        gone += share
    if stairs:
        share = weights[s] * _share(CLIMB_TURNS, dt)
        other = STAIRS_DOWN if way == STAIRS_UP else STAIRS_UP
        x, c = _copied(state, s, merged)
        _take(x, c, share, here + other, s, seen, merged)
        gone += share
    return gone


@kernel
def _reappears(state: State, s: int, heights_m: Floats, free: bool, dt: float, seen: Floats, merged: Merged) -> None:
    """After a silence he is where he was, on another storey or on a way; the weather has walked on, in a building with any pressure."""
    count, own, weight = len(heights_m), s // MODES, state[0][s]
    stays = max(RESTS, math.exp(-dt * 2.0 * (CLIMB_BEGINS + RIDE_BEGINS))) if s % WAYS == ON else 0.0
    last = seen.copy()
    last[DT], last[FOOT] = 0.0, math.nan
    for j in range(2 if free else count):
        home = j == (0 if free else own)
        share = stays * home + (1.0 - stays) * (1.0 - UNDER_WAY) * ((not home) if free else 1.0 / count)
        for shifted in range(2):
            x, c = _gone_by(state, s, dt, shifted == 1, merged)
            if not free:
                _forget(x, c, 0, 0.0)
                x[0] = heights_m[j]
            elif not home:
                c[0, 0] += WANDERED_M**2
            _take(x, c, weight * share * _shift_share(dt, shifted), (0 if free else j) * MODES + ON, s, last, merged)
    for target in range(STAIRS_UP, WAYS):
        x, c = _gone_by(state, s, dt, False, merged)
        wide = WANDERED_M if free else 0.5 * (heights_m[count - 1] - heights_m[0]) + STOREY_M
        _forget(x, c, 0, wide)
        x[0] = state[1][s, 0] if free else 0.5 * (heights_m[count - 1] + heights_m[0])
        stairs = target < LIFT_UP
        c[1, 1] = (CLIMB_SD_M_S if stairs else RIDE_SD_M_S) ** 2
        x[1] = (CLIMB_M_S if stairs else RIDE_M_S) * (1.0 if target in (STAIRS_UP, LIFT_UP) else -1.0)
        share = (1.0 - stays) * UNDER_WAY / 4.0
        _take(x, c, weight * share, own * MODES + target, s, last, merged)


@kernel
def _gone_by(state: State, s: int, dt: float, shifted: bool, merged: Merged) -> tuple[Floats, Floats]:
    """Hypothesis s after a time that nobody saw: at rest, no gust, the weather walked on."""
    x, c = _copied(state, s, merged)
    c[2, 2] += WEATHER_M**2 * dt + (TREND_M_S * dt) ** 2
    _forget(x, c, 1, 0.0)
    _forget(x, c, 3, 0.0)
    if shifted:
        c[2, 2] += SHIFT_M**2
    return x, c


@kernel
def _shift_share(dt: float, shifted: int) -> float:
    """Probability that the building's pressure has shifted, or not, in so long."""
    share = _share(SHIFTS + 0.5 * GUST_BEGINS, dt)
    return share if shifted else 1.0 - share


@kernel
def _copied(state: State, s: int, merged: Merged) -> tuple[Floats, Floats]:
    """Mean and covariance of hypothesis s, to be changed."""
    x, c = merged[4], merged[5]
    for a in range(4):
        x[a] = state[1][s, a]
        for b in range(4):
            c[a, b] = state[2][s, a, b]
    return x, c


@kernel
def _share(rate: float, dt: float) -> float:
    """Probability that what happens so often happens within dt."""
    return 1.0 - math.exp(-rate * dt)


@kernel
def _forget(x: Floats, c: Floats, a: int, sd: float) -> None:
    """Component a is 0 with this sd, whatever it was."""
    x[a] = 0.0
    c[a, :] = 0.0
    c[:, a] = 0.0
    c[a, a] = sd**2


@kernel
def _add(x: Floats, c: Floats, a: int, b: int, rest: float) -> None:
    """Component b becomes exactly `rest`; what it was beyond goes to a."""
    x[a] += x[b] - rest
    c[a, :] += c[b, :]
    c[:, a] += c[:, b]
    _forget(x, c, b, 0.0)
    x[b] = rest


@kernel
def _pinned(x: Floats, c: Floats, a: int, value: float, width: float) -> float:
    """Mean of exp(-(x_a - value)^2 / (2 width^2)) over the Gaussian, which is then multiplied by it."""
    spread = c[a, a] + width**2
    off = value - x[a]
    _drawn(x, c, a, off, spread)
    return width / math.sqrt(spread) * math.exp(-0.5 * off**2 / spread)


@kernel
def _drawn(x: Floats, c: Floats, a: int, off: float, spread: float) -> None:
    """Component a is drawn by a measurement of it that is `off`, with this variance in all."""
    gain = (c[0, a] / spread, c[1, a] / spread, c[2, a] / spread, c[3, a] / spread)
    for i in range(4):
        x[i] += gain[i] * off
        for j in range(4):
            c[i, j] -= gain[i] * gain[j] * spread


@kernel
def _take(x: Floats, c: Floats, weight: float, target: int, source: int, seen: Floats, merged: Merged) -> None:
    """A hypothesis goes on as `target` for dt, meets what was seen, and is merged."""
    w, m, p, xi, _, _ = merged
    if weight < TINIEST:
        return
    way, air, dt = target % WAYS, target % MODES // WAYS, seen[DT]
    _predict(x, c, way, air, dt)
    weight *= math.exp(-dt * _contradiction(x, way, seen))
    if seen[FOOT] == seen[FOOT]:
        weight *= _meets_foot(x, c, way, seen)
    if seen[CLAIMED] == seen[CLAIMED]:
        weight *= _meets_pressure(x, c, seen)
    w[target] += weight
    for a in range(4):
        m[target, a] += weight * x[a]
        for b in range(4):
            p[target, a, b] += weight * (c[a, b] + x[a] * x[b])
    xi[target, source] += weight


@kernel
def _predict(x: Floats, c: Floats, way: int, air: int, dt: float) -> None:
    """Weather walks, gusts fade, vertical speed returns to what stairs and lifts have."""
    c[2, 2] += WEATHER_M**2 * dt
    if air == HELD:
        c[3, 3] += HELD_WANDERS_M**2 * dt
    elif air == FADING:
        c[3, 3] += (FADING_WANDERS_M**2 + (FADING_WANDERS * x[3]) ** 2) * dt
        fades = math.exp(-dt / FADES_S)
        x[3] *= fades
        for a in range(4):
            c[3, a] *= fades
            c[a, 3] *= fades
    if way == ON:
        return
    stairs = way < LIFT_UP
    speed = (CLIMB_M_S if stairs else RIDE_M_S) * (1.0 if way in (STAIRS_UP, LIFT_UP) else -1.0)
    sd, tau = (CLIMB_SD_M_S, CLIMB_S) if stairs else (RIDE_SD_M_S, RIDE_S)
    keeps = math.exp(-dt / tau)
    far, noise = tau * (1.0 - keeps), sd**2 * (1.0 - keeps**2)
    x[0] += speed * dt + far * (x[1] - speed)
    x[1] = speed + keeps * (x[1] - speed)
    for a in range(4):
        c[0, a] += far * c[1, a]
        c[1, a] *= keeps
    for a in range(4):
        c[a, 0] += far * c[a, 1]
        c[a, 1] *= keeps
    c[0, 0] += noise * dt**2 / 3.0
    c[0, 1] += noise * dt / 2.0
    c[1, 0] += noise * dt / 2.0
    c[1, 1] += noise


@kernel
def _contradiction(x: Floats, way: int, seen: Floats) -> float:
    """Nats a second against this mode by gait, plan and the range of storeys."""
    cost = 0.0
    if way != ON:
        cost += PLACE_COST * (seen[PLACE] == OUTSIDE)
        cost += GAIT_COST * (seen[GAIT] == (STILL if way < LIFT_UP else WALKING))
        cost += RANGE_COST * (max(0.0, x[0] - seen[HIGHEST] - 1.0) + max(0.0, seen[LOWEST] - 1.0 - x[0]))
    return cost


@kernel
def _meets_foot(x: Floats, c: Floats, way: int, seen: Floats) -> float:
    """Likelihood of the foot's vertical speed, which on stairs is the wearer's; elsewhere, in a lift too, the foot claims none."""
    stairs = STAIRS_UP <= way < LIFT_UP
    noise = seen[FOOT_SD] ** 2 / seen[DT] + (0.0 if stairs else FOOT_LEVEL_M_S**2)
    off = seen[FOOT] - (x[1] if stairs else 0.0)
    spread = noise + (c[1, 1] if stairs else 0.0)
    if stairs:
        _drawn(x, c, 1, off, spread)
    return math.exp(-0.5 * off**2 / spread) / math.sqrt(2.0 * math.pi * spread)


@kernel
def _meets_pressure(x: Floats, c: Floats, seen: Floats) -> float:
    """Likelihood of the claimed height, which may be a spike; the update is shared between both readings of it."""
    h0, h1, h2, h3 = (
        c[0, 0] + c[0, 2] + c[0, 3],
        c[1, 0] + c[1, 2] + c[1, 3],
        c[2, 0] + c[2, 2] + c[2, 3],
        c[3, 0] + c[3, 2] + c[3, 3],
    )
    spread = h0 + h2 + h3 + seen[NOISE] ** 2
    off = seen[CLAIMED] - (x[0] + x[2] + x[3])
    wide = spread + OUTLIER_M**2
    good = (1.0 - OUTLIER) * math.exp(-0.5 * off**2 / spread) / math.sqrt(2.0 * math.pi * spread)
    spike = OUTLIER * math.exp(-0.5 * min(off**2 / wide, 50.0)) / math.sqrt(2.0 * math.pi * wide)
    share = good / (good + spike)
    gain = (h0 / spread, h1 / spread, h2 / spread, h3 / spread)
    less = share * spread - share * (1.0 - share) * off**2
    for a in range(4):
        x[a] += share * off * gain[a]
        for b in range(4):
            c[a, b] -= gain[a] * gain[b] * less
    return good + spike
