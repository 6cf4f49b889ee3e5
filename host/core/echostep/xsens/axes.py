# SPDX-License-Identifier: MIT
"""Orientations of an MT -> quaternions in its world frame. No other module converts MT axes.

In: Euler angles, matrices or quaternions in one of the MT's worlds. Out: quaternions w x y z, sensor -> MT world. Owns nothing.
MT world: x magnetic north, y west, z up [Manual 2.2, the default of the MTx].
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Bools, Floats
from echostep.elementary import cos, sin

ENU, NED, NWU = 0x0, 0x4, 0x8  # coordinate bits of an MTData2 identifier [LLCP, MTData2]
EULER_LIMITS = np.array([180.01, 90.01, 180.01])  # degrees of roll, pitch, yaw: the range and some rounding
ROTATION_ERROR = 0.02  # largest error of an element of R R^T and of the right-handed frame; assumed
IDENTITY = np.eye(3).ravel()
_HALF = math.sqrt(0.5)
FROM_WORLD = {  # ENU or NED -> north, west, up
    ENU: np.array([_HALF, 0.0, 0.0, -_HALF]),
    NED: np.array([0.0, 1.0, 0.0, 0.0]),
}


def to_mt_world(q: Floats, world: int) -> Floats:
    """Sensor -> ENU, NED or NWU (n, 4) into sensor -> MT world (north, west, up)."""
    return q if world == NWU else product(FROM_WORLD[world], q)


def product(p: Floats, q: Floats) -> Floats:
    """Hamilton products p q (n, 4) of one quaternion p (4,) with many q (n, 4): the rotation q first, then p."""
    w, x, y, z = p
    a, b, c, d = q[:, 0], q[:, 1], q[:, 2], q[:, 3]
    return np.stack(
        [
            w * a - x * b - y * c - z * d,
            w * b + x * a + y * d - z * c,
            w * c - x * d + y * a + z * b,
            w * d + x * c - y * b + z * a,
        ],
        axis=1,
    )


def from_values(orientation: Floats) -> Floats:
    """Quaternions (n, 4) of orientations as an MT sends them: quaternions (n, 4), Euler angles (n, 3) or matrices (n, 9)."""
    if orientation.shape[1] == 4:
        return orientation
    return from_euler(orientation) if orientation.shape[1] == 3 else from_matrix(orientation)


def from_euler(degrees: Floats) -> Floats:
    """Quaternions of roll, pitch, yaw (n, 3) in degrees, R = Rz(yaw) Ry(pitch) Rx(roll) [Manual 2.3, aerospace sequence].

    Impossible angles give 0, which fails the gate on |q| = 1.
    """
    possible = np.all(np.abs(degrees) <= EULER_LIMITS, axis=1)
    half = np.radians(np.where(possible[:, None], degrees, 0.0)) * 0.5
    cr, cp, cy = cos(half).T
    sr, sp, sy = sin(half).T
    return possible[:, None] * np.stack(
        [
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ],
        axis=1,
    )


def from_matrix(columns: Floats) -> Floats:
    """Quaternions of rotation matrices sent column by column (n, 9) [Manual, definition of a to i]; a matrix that is no rotation gives 0.

    The branch of the largest component is used, so that no divisor is small [Shepperd 1978].
    """
    rotation = _are_rotations(columns)
    columns = np.where(rotation[:, None], columns, IDENTITY)
    a, b, c, d, e, f, g, h, i = columns.T
    squares = np.stack([1 + a + e + i, 1 + a - e - i, 1 - a + e - i, 1 - a - e + i], axis=1)
    largest = np.argmax(squares, axis=1)
    rows = np.empty((4, len(columns), 4))
    rows[0] = np.stack([squares[:, 0], f - h, g - c, b - d], axis=1)
    rows[1] = np.stack([f - h, squares[:, 1], b + d, c + g], axis=1)
    rows[2] = np.stack([g - c, b + d, squares[:, 2], f + h], axis=1)
    rows[3] = np.stack([b - d, c + g, f + h, squares[:, 3]], axis=1)
    index = np.arange(len(columns))
    return rotation[:, None] * rows[largest, index] / (2.0 * np.sqrt(squares[index, largest]))[:, None]


def _are_rotations(columns: Floats) -> Bools:
    """Whether the columns (n, 9) are orthonormal and right-handed."""
    with np.errstate(all="ignore"):
        first, second, third = columns[:, 0:3], columns[:, 3:6], columns[:, 6:9]
        error = np.abs(np.cross(first, second) - third).max(axis=1)
        error = np.maximum(error, np.abs(np.einsum("ni,ni->n", first, second)))
        error = np.maximum(error, np.abs(np.einsum("ni,ni->n", first, first) - 1.0))
        return error <= ROTATION_ERROR
