# SPDX-License-Identifier: MIT
"""Each particle's estimate of each beacon: a Kalman filter of three states per particle and beacon [Montemerlo 2002, FastSLAM].

In: innovations of one measurement. Out: means, covariances, and their moments over all particles. Owns `BeaconBeliefs`. Given a particle's path,
the beacons do not depend on each other, so each has a covariance of its own.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats
from echostep.elementary import product, weighted_covariance, wrap_angle
from echostep.jit import kernel, lean_part, part

X, Y, AXIS = 0, 1, 2  # states: place on the sheet (m), direction of the beacon's axis (rad)
XX, XY, X_AXIS, YY, Y_AXIS, AXIS_AXIS = 0, 1, 2, 3, 4, 5  # stored terms of the symmetric covariance


class BeaconBeliefs(NamedTuple):
    """Beliefs of n particles about b beacons.

    `mean` (n, b, 3): X, Y, AXIS. `cov` (n, b, 6): XX to AXIS_AXIS. `doubt` (n, b): odds that the beacon was moved, relative to one that has
    just been placed.
    """

    mean: Floats
    cov: Floats
    doubt: Floats


class BeaconMeasurement(NamedTuple):
    """One measurement by the beacon in column `slot`: range to the boot, and bearing from the beacon's own axis (NaN: not measured)."""

    slot: int
    range_m: float
    bearing_rad: float


def empty_beliefs(particles: int, beacons: int) -> BeaconBeliefs:
    """Room for beacons of which nothing is known yet."""
    return BeaconBeliefs(
        np.zeros((particles, beacons, 3)), np.zeros((particles, beacons, 6)), np.ones((particles, beacons))
    )


@kernel
def set_beliefs(
    beliefs: BeaconBeliefs, slot: int, x: float, y: float, axis: float, place_var: float, axis_var: float
) -> None:
    """Give all particles the same belief of one beacon: its place and axis, with variances in m2 and rad2."""
    for i in range(len(beliefs.mean)):
        beliefs.mean[i, slot] = x, y, axis
        beliefs.cov[i, slot] = place_var, 0.0, 0.0, place_var, 0.0, axis_var
        beliefs.doubt[i, slot] = 1.0


@part
def place_beacon(beliefs: BeaconBeliefs, slot: int, x: Floats, y: Floats, place_var: float) -> None:
    """Give each particle a belief of its own of one beacon: it lies about (x, y), each (n,), within this variance (m2); its axis is unknown."""
    for i in range(len(beliefs.mean)):
        beliefs.mean[i, slot] = x[i], y[i], 0.0
        beliefs.cov[i, slot] = place_var, 0.0, 0.0, place_var, 0.0, math.pi * math.pi
        beliefs.doubt[i, slot] = 1.0


@lean_part
def correct(
    mean: Floats, cov: Floats, hx: float, hy: float, h_axis: float, innovation: float, noise_var: float
) -> None:
    """Kalman update of one belief, mean (3,) and cov (6,), by a scalar whose gradient is (hx, hy, h_axis)."""
    px = cov[XX] * hx + cov[XY] * hy + cov[X_AXIS] * h_axis
    py = cov[XY] * hx + cov[YY] * hy + cov[Y_AXIS] * h_axis
    p_axis = cov[X_AXIS] * hx + cov[Y_AXIS] * hy + cov[AXIS_AXIS] * h_axis
    inverse = 1.0 / (hx * px + hy * py + h_axis * p_axis + noise_var)
    gx, gy, g_axis = inverse * px, inverse * py, inverse * p_axis
    mean[X] += gx * innovation
    mean[Y] += gy * innovation
    mean[AXIS] = wrap_angle(mean[AXIS] + g_axis * innovation)
    cov[XX] -= gx * px
    cov[XY] -= gx * py
    cov[X_AXIS] -= gx * p_axis
    cov[YY] -= gy * py
    cov[Y_AXIS] -= gy * p_axis
    cov[AXIS_AXIS] -= g_axis * p_axis


def place_covariance(beliefs: BeaconBeliefs, slot: int, weight: Floats) -> Floats:
    """Covariance (2, 2) of the place of a beacon (m2): mean of the particles' own, and scatter of their means; `weight` (n,) sums to 1."""
    cov = product(weight, beliefs.cov[:, slot][:, [XX, XY, XY, YY]])
    return cov.reshape(2, 2) + weighted_covariance(beliefs.mean[:, slot, :AXIS], weight)


@kernel
def moments(beliefs: BeaconBeliefs, weight: Floats) -> Floats:
    """Mean belief of all particles of each beacon (b, 4): x, y (m), standard deviation per axis (m), axis (rad).

    `weight` (n,) sums to 1. One pass over the particles as they lie in memory; squares are of offsets from the first particle's belief.
    """
    mean, cov, _ = beliefs
    beacons = mean.shape[1]
    # Sums of offset x, offset y, their squares with the variances, sine and cosine of the axis
    sums = np.zeros((beacons, 5))
    for i in range(len(mean)):
        w = weight[i]
        for k in range(beacons):
            m, c, s = mean[i, k], cov[i, k], sums[k]
            dx, dy = m[X] - mean[0, k, X], m[Y] - mean[0, k, Y]
            s[0] += w * dx
            s[1] += w * dy
            s[2] += w * (dx * dx + dy * dy + c[XX] + c[YY])
            s[3] += w * math.sin(m[AXIS])
            s[4] += w * math.cos(m[AXIS])
    result = np.empty((beacons, 4))
    for k in range(beacons):
        s = sums[k]
        result[k, 0] = mean[0, k, X] + s[0]
        result[k, 1] = mean[0, k, Y] + s[1]
        result[k, 2] = math.sqrt(0.5 * max(s[2] - s[0] * s[0] - s[1] * s[1], 0.0))
        result[k, 3] = math.atan2(s[3], s[4])
    return result
