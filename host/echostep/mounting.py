"""How the sensor sits on the foot: up from gravity, the toe from how the foot tips while it swings.

In: the attitude at each sample of a swing. Out: the angle from the foot's yaw to the direction of its toe. The caller owns the sums.

Gravity at rest gives the level (`ins.set_level`). A foot tips about the axis from its right to its left, and it tips toe down much further than
toe up: over the ball at push-off, forward, backward and sideways alike, and towards the floor on stairs [Perry 1992]. So the second moment of the
tilt gives the axis, its third moment the sign, and the direction of the steps is not needed.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from echostep import ins
from echostep.ins import Nav

Floats = NDArray[np.float64]

ENOUGH_RAD2_S = 0.1  # less than one whole stride: the first half step of a walk may tip toe up only
ROUND = 0.6  # a tilt about one axis has squares along it only; noise and twisting feet add some across
MEMORY = 0.95  # of a swing, at the next


@njit(cache=True)
def tilt(nav: Nav) -> Floats:
    """How far the foot is tipped from its level: rotation vector (3,), z = 0, in the levelled axes of the foot itself."""
    r = ins.rotation(nav.attitude)
    yaw = ins.heading(nav)
    c, s = math.cos(yaw), math.sin(yaw)
    tipped = np.zeros((3, 3))  # yaw undone on both sides
    for i in range(3):
        for j in range(3):
            for k in range(3):
                turned = c * r[i, k] + s * r[1, k] if i == 0 else (c * r[1, k] - s * r[0, k] if i == 1 else r[2, k])
                tipped[i, j] += turned * nav.level[j, k]
    x, y = 0.5 * (tipped[2, 1] - tipped[1, 2]), 0.5 * (tipped[0, 2] - tipped[2, 0])
    size = math.hypot(x, y)
    angle = math.atan2(size, 0.5 * (tipped[0, 0] + tipped[1, 1] + tipped[2, 2] - 1.0))
    found = np.zeros(3)
    if size > 1e-9:
        found[0], found[1] = x / size * angle, y / size * angle
    return found


@njit(cache=True)
def watch(square: Floats, cube: Floats, tipped: Floats, dt: float) -> None:
    """Add a sample of a swing, tipped by (3,) rad since the last stance: second moments xx, xy, yy and third moment times the vector."""
    x, y = tipped[0], tipped[1]
    square[0] += dt * x * x
    square[1] += dt * x * y
    square[2] += dt * y * y
    cube[0] += dt * (x * x + y * y) * x
    cube[1] += dt * (x * x + y * y) * y


@njit(cache=True)
def toe(square: Floats, cube: Floats) -> float:
    """Angle (rad) from the foot's yaw to its toe; NaN as long as the foot has not tipped enough to tell."""
    whole = square[0] + square[2]
    along = math.hypot(square[0] - square[2], 2.0 * square[1])
    if whole < ENOUGH_RAD2_S or along < ROUND * whole:
        return math.nan
    left = 0.5 * math.atan2(2.0 * square[1], square[0] - square[2])
    if cube[0] * math.cos(left) + cube[1] * math.sin(left) < 0.0:
        left += math.pi
    found = left - 0.5 * math.pi
    return math.atan2(math.sin(found), math.cos(found))
