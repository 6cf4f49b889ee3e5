"""Stance: when the foot stands, how still a standing foot is, and what it says about velocity and gyro bias.

In: the latest samples and the navigation state. Out: verdicts, and corrections of that state. Owns a `Window` of samples and a `Rest`.

One setting serves walking, running, stairs and shuffling at any rate, because a stance is decided by two witnesses. The sensors alone (SHOE
[Skog et al. 2010], in physical units) are asked leniently, as a runner's foot never lies still; then the filter, which knows the foot's velocity
to a few cm/s at the end of a swing, must find rest believable. In the middle of a swing it never does: the foot moves at metres a second.
A standing foot rolls about its contact with the floor: a sensor above it moves with the rate times its height, and what remains unknown of
the lever arm matters in proportion to the rate, too. So a calm mid-stance counts for much, a heel rise for little, and strides are not short.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.foot import ins
from echostep.foot.ins import GYRO_BIAS, TILT, VEL, Nav, Vector
from echostep.jit import lean_kernel

RING = 32  # samples
WINDOW_S = 0.03
REST_RAD_S, REST_M_S2 = 1.6, 6.0  # rms over the window: `unrest` is 1 on the ellipse between them
CALM, STILL = 0.25, 0.03  # `unrest` of a foot that stands, and of one that nobody moves on purpose
BELIEF = 16.8  # chi-square of three velocities and three accelerations, exceeded by one in a hundred
ROLL_M_S2 = 2.0  # acceleration of a sensor on a foot that rolls
MOST_EXCESS = 1e3
LASTING_S = 0.15  # no swing is calm for so long: this stance is real, the velocity is not
OVERDUE_S = 2.0  # nor does a swing last so long
PART_S, PARTS = 0.1, 5  # gyro bias: rest is cut into parts
SWAY_S = 0.3  # the mean of a sway is as good as one part in so long
BIAS_FLOOR_RAD_S = 1e-3
BIAS_BELIEF = 16.0  # chi-square of one rate, four sigma
BIAS_DOUBT = 0.3  # of the error, from the second refusal in a row on, so that the third is none; a first one is a foot that gets going


class Window(NamedTuple):
    """The latest samples in a ring: `t_s` (RING,), `accel` and `gyro` (RING, 3); `taken` (1,) samples ever put in."""

    t_s: Floats
    accel: Floats
    gyro: Floats
    taken: Ints


class Rest(NamedTuple):
    """Sums over the present rest: `part` (3,) rad and `part_s` (1,), `whole` (3,) rad, `squares` (1,) rad2/s, `whole_s` (1,).

    `refused` (3,): how often in a row each axis was not believed; it outlives the rest.
    """

    part: Floats
    part_s: Floats
    whole: Floats
    squares: Floats
    whole_s: Floats
    refused: Floats


def new_window() -> Window:
    """An empty window."""
    return Window(np.zeros(RING), np.zeros((RING, 3)), np.zeros((RING, 3)), np.zeros(1, np.int64))


def new_rest() -> Rest:
    """No rest so far."""
    return Rest(np.zeros(3), np.zeros(1), np.zeros(3), np.zeros(1), np.zeros(1), np.zeros(3))


@lean_kernel
def put(window: Window, t_s: float, accel: Floats, gyro: Floats) -> None:
    """Add a sample."""
    at = window.taken[0] % RING
    window.t_s[at] = t_s
    for i in range(3):
        window.accel[at, i], window.gyro[at, i] = accel[i], gyro[i]
    window.taken[0] += 1


@lean_kernel
def mean_force(window: Window) -> Vector:
    """Mean specific force (3,) over the window."""
    newest, n = window.taken[0] - 1, _length(window)
    x, y, z = 0.0, 0.0, 0.0
    for k in range(n):
        at = (newest - k) % RING
        x, y, z = x + window.accel[at, 0], y + window.accel[at, 1], z + window.accel[at, 2]
    return x / n, y / n, z / n


@lean_kernel
def _length(window: Window) -> int:
    """How many of the latest samples the window holds."""
    newest = window.taken[0] - 1
    begin = window.t_s[newest % RING] - WINDOW_S - 1e-6
    n = 1
    while n < min(newest + 1, RING) and window.t_s[(newest - n) % RING] >= begin:
        n += 1
    return n


@lean_kernel
def activity(window: Window, bias: Floats) -> tuple[float, float]:
    """Mean squared angular rate (rad/s)2, and specific force less gravity along its own mean (m/s2)2 [Skog et al. 2010, eq. 12]."""
    newest, n = window.taken[0] - 1, _length(window)
    mean = mean_force(window)
    scale = ins.GRAVITY_M_S2 / max(math.sqrt(ins.dot(mean, mean)), 1e-9)
    rate2, force2 = 0.0, 0.0
    for k in range(n):
        at = (newest - k) % RING
        for i in range(3):
            rate2 += (window.gyro[at, i] - bias[i]) ** 2
            force2 += (window.accel[at, i] - scale * mean[i]) ** 2
    return rate2 / n, force2 / n


@lean_kernel
def unrest(rate2: float, force2: float) -> float:
    """The sensors' verdict on their own: below 1 they would allow a stance."""
    return rate2 / REST_RAD_S**2 + force2 / REST_M_S2**2


@lean_kernel
def rolling(nav: Nav, gyro: Floats, height_m: float) -> Vector:
    """Velocity (3,) of a sensor at this height above the contact of a foot that rolls without sliding: rate x height."""
    rate = ins.apply(ins.rotation(nav.attitude), ins.difference(gyro, nav.gyro_bias))
    return rate[1] * height_m, -rate[0] * height_m, 0.0


@lean_kernel
def surprise(nav: Nav, expected: Vector, variance: float, force: Vector) -> float:
    """Chi-square of velocity and acceleration, were the foot at rest under this mean specific force (3,)."""
    f = ins.apply(ins.rotation(nav.attitude), ins.difference(force, nav.accel_bias))
    accel = (f[0], f[1], f[2] - ins.GRAVITY_M_S2)
    lean = ins.GRAVITY_M_S2**2 * (nav.P[TILT, TILT] + nav.P[TILT + 1, TILT + 1])
    total = 0.0
    for i in range(3):
        total += (nav.velocity[i] - expected[i]) ** 2 / (nav.P[VEL + i, VEL + i] + variance)
        total += accel[i] ** 2 / (ROLL_M_S2**2 + lean)
    return total


@lean_kernel
def rest_variance(nav: Nav, rate2: float) -> float:
    """Variance (m/s)2 of the velocity of a standing foot about `rolling`."""
    return nav.noise.rest_m_s**2 + nav.noise.lever_m**2 * rate2


@lean_kernel
def haste_variance(force2: float) -> float:
    """Variance (m/s)2 that comes on top while the foot may still be stopping: what its acceleration does within the window."""
    return WINDOW_S**2 * force2


@lean_kernel
def hold(nav: Nav, expected: Vector, variance: float, dt: float) -> None:
    """Zero-velocity update; what it is worth depends on the time it covers, not on the number of samples."""
    worth = max(1.0, nav.noise.kept_s / dt)
    for i in range(3):
        ins.observe(nav, VEL + i, expected[i] - nav.velocity[i], variance * worth)


@lean_kernel
def distrust(nav: Nav, excess: float) -> None:
    """The foot rests although the filter cannot believe it: whatever made velocity, attitude and way wrong since the last rest was worse
    than the filter knew. Their covariance grows by the `excess`, so that they are corrected together, in the proportions in which they went wrong.
    """
    more = math.sqrt(min(excess, MOST_EXCESS))
    for i in range(ins.SIZE):
        if i < ins.GYRO_BIAS or i == ins.YAW:
            for j in range(ins.SIZE):
                nav.P[i, j] *= more
                nav.P[j, i] *= more


@lean_kernel
def end_rest(rest: Rest) -> None:
    """The foot moves: an unfinished rest says nothing about the gyros."""
    for i in range(3):
        rest.part[i] = rest.whole[i] = 0.0
    rest.part_s[0] = rest.whole_s[0] = rest.squares[0] = 0.0


@lean_kernel
def learn_bias(nav: Nav, rest: Rest, dt: float, gyro0: Floats, gyro1: Floats) -> bool:
    """Zero-angular-rate update after each half second of rest; true when there was one."""
    for i in range(3):
        rest.part[i] += 0.5 * dt * (gyro0[i] + gyro1[i])
    rest.part_s[0] += dt
    if rest.part_s[0] < PART_S - 1e-6:
        return False
    for i in range(3):
        rest.whole[i] += rest.part[i]
        rest.squares[0] += rest.part[i] ** 2 / rest.part_s[0]
        rest.part[i] = 0.0
    rest.whole_s[0] += rest.part_s[0]
    rest.part_s[0] = 0.0
    if rest.whole_s[0] < PARTS * PART_S - 1e-6:
        return False
    span_s: float = rest.whole_s[0]
    mean = (rest.whole[0] / span_s, rest.whole[1] / span_s, rest.whole[2] / span_s)
    _observe_bias(nav, rest, mean, _bias_variance(rest, mean))
    end_rest(rest)
    return True


@lean_kernel
def _bias_variance(rest: Rest, mean: Vector) -> float:
    """Variance of the mean rate (3,), by how still this rest was: its scatter holds the sensor's noise and the person's sway alike."""
    span_s: float = rest.whole_s[0]
    scatter: float = rest.squares[0] / span_s - ins.dot(mean, mean)
    return BIAS_FLOOR_RAD_S**2 + max(scatter, 0.0) / 3.0 * PARTS / (PARTS - 1) * SWAY_S / span_s


@lean_kernel
def _observe_bias(nav: Nav, rest: Rest, mean: Vector, variance: float) -> None:
    """A mean rate that nobody believes (a foot that turns slowly) is refused; refused again, it makes the next one more credible."""
    for i in range(3):
        error = mean[i] - nav.gyro_bias[i]
        if error * error < BIAS_BELIEF * (nav.P[GYRO_BIAS + i, GYRO_BIAS + i] + variance):
            ins.observe(nav, GYRO_BIAS + i, error, variance)
            rest.refused[i] = 0.0
        else:
            rest.refused[i] += 1.0
            if rest.refused[i] > 1.0:
                nav.P[GYRO_BIAS + i, GYRO_BIAS + i] += (BIAS_DOUBT * error) ** 2
