# SPDX-License-Identifier: MIT
"""Mounting of the sensor on the foot: the direction of the toe, from how the foot tips while it swings.

In: the attitude at each sample of a swing. Out: the angle from the foot's yaw to the direction of its toe. The caller owns the sums.

Gravity at rest gives the level (`ins.set_level`). The foot tips about the axis from its right to its left, and much further toe down than
toe up: over the ball at push-off in steps forward, backward and sideways, and towards the floor on stairs [Perry 1992]. So the second
moment of the tilt gives the axis, and its third moment the sign. The direction of the steps is not used.
"""

from __future__ import annotations

import math

from echostep.arrays import Floats
from echostep.foot import ins
from echostep.foot.ins import Nav, Vector
from echostep.jit import lean_part

# A whole stride has a larger second moment of the tilt; the first half step of a walk has less, and may tip toe up only.
ENOUGH_RAD2_S = 0.1
# Of the second moment: 1 is a tilt about one axis, 0 one about all axes alike. 0.6 is a tilt twice as large (rms) along as across.
LEAST_ANISOTROPY = 0.6
# Weight of the sums of earlier swings, per swing: a mean over 20, so that a sensor that slips is followed
MEMORY = 0.95


@lean_part
def tilt(nav: Nav) -> Vector:
    """Tilt of the foot against its level: rotation vector (3,), z = 0, in the levelled axes of the foot itself."""
    r = ins.rotation(nav.attitude)
    yaw = ins.heading(nav)
    c, s = math.cos(yaw), math.sin(yaw)
    # Rows of the attitude without its yaw.
    ahead = (c * r[0][0] + s * r[1][0], c * r[0][1] + s * r[1][1], c * r[0][2] + s * r[1][2])
    left = (c * r[1][0] - s * r[0][0], c * r[1][1] - s * r[0][1], c * r[1][2] - s * r[0][2])
    level_x, level_y, level_z = nav.level[0], nav.level[1], nav.level[2]
    x = 0.5 * (ins.dot(r[2], level_y) - ins.dot(left, level_z))
    y = 0.5 * (ins.dot(ahead, level_z) - ins.dot(r[2], level_x))
    size = math.hypot(x, y)
    upright = ins.dot(ahead, level_x) + ins.dot(left, level_y) + ins.dot(r[2], level_z)
    angle = math.atan2(size, 0.5 * (upright - 1.0))
    return (x / size * angle, y / size * angle, 0.0) if size > 1e-9 else (0.0, 0.0, 0.0)


@lean_part
def accumulate(square: Floats, cube: Floats, tipped: Vector, dt: float) -> None:
    """Add a sample of a swing, tipped by (3,) rad since the last stance: second moments xx, xy, yy and third moment times the vector."""
    x, y, _ = tipped
    square[0] += dt * x * x
    square[1] += dt * x * y
    square[2] += dt * y * y
    cube[0] += dt * (x * x + y * y) * x
    cube[1] += dt * (x * x + y * y) * y


@lean_part
def toe(square: Floats, cube: Floats) -> float:
    """Angle (rad) from the foot's yaw to its toe; NaN while the foot has not tipped enough."""
    whole = square[0] + square[2]
    along = math.hypot(square[0] - square[2], 2.0 * square[1])
    if whole < ENOUGH_RAD2_S or along < LEAST_ANISOTROPY * whole:
        return math.nan
    left = 0.5 * math.atan2(2.0 * square[1], square[0] - square[2])
    if cube[0] * math.cos(left) + cube[1] * math.sin(left) < 0.0:
        left += math.pi
    toe_rad = left - 0.5 * math.pi
    return math.atan2(math.sin(toe_rad), math.cos(toe_rad))
