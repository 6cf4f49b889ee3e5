# SPDX-License-Identifier: MIT
"""Whether the sensor is on a foot, by its unrest while the foot is taken to stand; and whether that foot is pushed.

In: the samples of rest, and the stances. Out: the unrest, a mean over stances; above 1 it is no foot. `pushed`. The caller owns the sums.

A foot lies flat before its heel rises. A shank leans over it all through the stance, and a thigh moves on: they turn further and faster, or
their velocity is not that of a foot which rolls about its contact, so the innovations are larger than the filter expects.
The start of a trolley, a chair on wheels or a car is taken for a tilt by the zero-velocity update; but a tilt is a turn, which the gyro shows.
"""

from __future__ import annotations

import math

from echostep.arrays import Floats
from echostep.foot import ins
from echostep.foot.ins import Nav
from echostep.foot.zupt_state import ZuptState
from echostep.jit import lean_part

# Means of ten stances in public recordings: at most 0.95 of these for 35 feet, running too, 1.17 and more for shanks and thighs.
# Rad per root s, the geometric mean of angle and rate; normalized innovation per degree of freedom
MOST_ROLL, MOST_STRAIN = 0.46, 0.73
LEVEL_DEGREES = 4.0  # of freedom of the innovation's level part
LONGEST_S = 1.5  # of a stance in walking
LONGEST_FLIGHT_S = 5.0  # without a rest, for a foot: a slow step over an obstacle takes 3; assumed
FEWEST, MEMORY = 4, 10  # stances for a judgement, and of its mean
MOST = 5.0  # of one stance
PUSH_S = 3.0  # memory of the force that is taken for gravity, and of the velocity
# Speed that no resting foot reaches: an unknown gyro bias of 3 mrad/s makes 0.26 m/s; who pushes a trolley walks at 1 m/s
PUSHED_M_S = 0.4


@lean_part
def accumulate(s: ZuptState, nav: Nav, gyro: Floats, innovation: float, dt: float) -> None:
    """Add a sample of rest: its rate (3,) rad/s, the normalized innovation of the level axes."""
    rate = ins.apply(ins.rotation(nav.attitude), ins.difference(gyro, nav.gyro_bias))
    s.roll[0] += dt * rate[0]
    s.roll[1] += dt * rate[1]
    s.strain += innovation / LEVEL_DEGREES
    s.strained += 1


@lean_part
def judge(s: ZuptState, span_s: float) -> None:
    """Take a stance of this duration into the mean, if the foot walks; clear its sums."""
    if s.strained > 2 and 0.0 < span_s < LONGEST_S:
        roll = math.hypot(s.roll[0], s.roll[1]) / math.sqrt(span_s)
        s.judged = min(s.judged + 1, MEMORY)
        s.unrest += (min(max(roll / MOST_ROLL, s.strain / s.strained / MOST_STRAIN), MOST) - s.unrest) / s.judged
    s.roll[0] = s.roll[1] = s.strain = 0.0
    s.strained = 0


@lean_part
def feel_push(s: ZuptState, nav: Nav, force: Floats, gyro: Floats, dt: float) -> None:
    """Add a sample of a stance, (3,) m/s2 and rad/s, to the gravity, which turns with the foot, and to the velocity: from when it has settled."""
    s.push_s = min(s.push_s + dt, PUSH_S) if s.settled else 0.0
    gain = dt / s.push_s if s.push_s > 0.0 else 1.0
    gravity, v, rate = s.push_gravity, s.push_m_s, ins.difference(gyro, nav.gyro_bias)
    x, y, z = gravity
    turned = y * rate[2] - z * rate[1], z * rate[0] - x * rate[2], x * rate[1] - y * rate[0]
    for i in range(3):
        gravity[i] += dt * turned[i]
        gravity[i] += gain * (force[i] - gravity[i])
        v[i] += dt * (force[i] - gravity[i]) - gain * v[i]
    level = ins.dot(v, v) - ins.dot(v, gravity) ** 2 / ins.dot(gravity, gravity)
    s.pushed = 1 if s.rest_s > 0.0 and level > PUSHED_M_S**2 else s.pushed
