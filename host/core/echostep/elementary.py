# SPDX-License-Identifier: MIT
"""Angles, elementary functions and products, with the same bits on processors with narrow and wide vectors.

In: arrays. Out: arrays. Owns nothing.

numpy's exp, log, sin and cos differ in the last bit by the width of the processor's vectors, the sums of its products by the BLAS that it comes with
and the processor that this finds; an estimate shall not.
"""

from __future__ import annotations

import math
from typing import TypeVar

import numpy as np

from echostep.arrays import Bools, Floats
from echostep.jit import kernel, lean_kernel

Angle = TypeVar("Angle", float, Floats)
_EXP, _LOG, _SIN, _COS = range(4)


def wrap(angle_rad: Angle) -> Angle:
    """The same angle, or angles, in [-pi, pi)."""
    return (angle_rad + math.pi) % (2.0 * math.pi) - math.pi


@lean_kernel
def wrap_angle(angle: float) -> float:
    """The same angle in [-pi, pi), for kernels. It rounds differently from `wrap`, and results depend on the last bit."""
    return angle - (2.0 * math.pi) * math.floor((angle + math.pi) / (2.0 * math.pi))


def exp(x: Floats) -> Floats:
    """e^x, of any shape."""
    return _of_each(x.ravel(), _EXP).reshape(x.shape)


def log(x: Floats) -> Floats:
    """Natural logarithms, of any shape."""
    return _of_each(x.ravel(), _LOG).reshape(x.shape)


def sin(angle_rad: Floats) -> Floats:
    """Sines, of any shape."""
    return _of_each(angle_rad.ravel(), _SIN).reshape(angle_rad.shape)


def cos(angle_rad: Floats) -> Floats:
    """Cosines, of any shape."""
    return _of_each(angle_rad.ravel(), _COS).reshape(angle_rad.shape)


def dot(a: Floats, b: Floats | Bools) -> float:
    """Sum of the products of two vectors (n,)."""
    return float((a * b).sum())


def product(a: Floats, b: Floats) -> Floats:
    """The product of a matrix or vector and a matrix, or of a matrix and a vector."""
    return np.asarray((a * b).sum(axis=-1) if b.ndim == 1 else (a[..., None] * b).sum(axis=-2))


def weighted_covariance(values: Floats, weight: Floats) -> Floats:
    """Covariance (k, k) of values (n, k) with weights (n,) that sum to 1."""
    away = values - product(weight, values)
    return product(away.T * weight, away)


def determinant(matrix: Floats) -> float:
    """Of a matrix (2, 2)."""
    return float(matrix[0, 0] * matrix[1, 1] - matrix[0, 1] * matrix[1, 0])


def inverse(matrix: Floats) -> Floats:
    """Of a matrix (2, 2)."""
    (a, b), (c, d) = matrix.tolist()
    return np.array([[d, -b], [-c, a]]) / determinant(matrix)


def mean_angle(angle_rad: Floats, weight: Floats) -> float:
    """Direction of the weighted sum (rad) of unit vectors with these angles (n,)."""
    return math.atan2(dot(weight, sin(angle_rad)), dot(weight, cos(angle_rad)))


@kernel
def _of_each(x: Floats, function: int) -> Floats:
    """The function of each number (n,), by the C library: one kernel for all, so that one is loaded."""
    if function == _EXP:
        return np.exp(x)
    if function == _LOG:
        return np.log(x)
    return np.sin(x) if function == _SIN else np.cos(x)
