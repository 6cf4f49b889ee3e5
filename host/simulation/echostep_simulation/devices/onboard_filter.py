# SPDX-License-Identifier: MIT
"""Model of the orientation filter on board of an MTx, a closed filter with known weaknesses [Fischer 2008, 3.2.2].

In: specific force, angular rate and magnetic field in the sensor's axes. Out: matrices sensor -> MTx world (x magnetic north, y west, z up).
Owns nothing. It is used for the simulated MTx and for recordings without an orientation.

A complementary filter [Mahony et al. 2008]: the gyros propagate the attitude, the specific force corrects the tilt, and the horizontal part of
the field corrects the heading. It has the errors that [Fischer 2008] reports:
- the acceleration of a swing, which is short against the time constant, is taken for a tilt [Foxlin 2002];
- gyro biases add a tilt error as long as the foot walks;
- iron and machines turn magnetic north;
- a tilt error turns the steep dip of the field into a heading error, most of all in fast turns of the foot.

The time constants were fitted once to the figures printed in [Fischer 2008]. `level_s`: ten simulated walkers (seeds 1 to 10, 100 Hz, sensor
errors by the manual) have the printed mean distance error of the line, the L and the rectangle, -4.3 %, within half a percent, and each printed
error (+2, -8, -7 %) is within their range. 10 s gave -5.7 %, 15 s -4.6 %, 20 s -3.9 % but no rectangle as bad as -7 %. `north_s` has the
size at which machines a few metres away matter; their moments (`simulation.trails`) then give Figures 5 and 6.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats
from echostep.jit import kernel, part

GRAVITY_M_S2 = 9.81
GAP_S = 0.25  # over a longer time between two samples the attitude is not propagated: samples are missing
NEAR_ZERO = 1e-6  # of a norm whose direction is undefined, m/s2 or the field's unit
SMALL_RAD = 1e-9  # below this angle the limits of sin(a)/a and (1 - cos(a))/a^2 are used


class OnBoardFilter(NamedTuple):
    """`level_s`, `north_s`: time constants of the corrections of tilt and heading.

    `calm_field`: relative deviation from the first field strength at which the heading correction is halved: "attempts to compensate for magnetic
    interference" [Fischer 2008].
    """

    level_s: float = 15.0
    north_s: float = 5.0
    calm_field: float = 0.5


class _Samples(NamedTuple):
    """t_s (n,), accel m/s2, gyro rad/s, mag in any unit (n, 3), sensor frame; mag is 0 without a magnetometer."""

    t_s: Floats
    accel: Floats
    gyro: Floats
    mag: Floats


def orientations(
    t_s: Floats, accel: Floats, gyro: Floats, mag: Floats | None = None, settings: OnBoardFilter | None = None
) -> Floats:
    """Matrices (n, 3, 3) sensor -> MTx world after each sample of t_s (n,), accel (n, 3) m/s2, gyro (n, 3) rad/s, mag (n, 3) in any unit.

    Over a gap the attitude stays. Without a magnetometer, x is the first horizontal direction of the sensor's x axis, and the heading drifts with
    the gyros.
    """
    import scipy  # noqa: F401  # numba multiplies matrices with its BLAS

    field = np.zeros((len(t_s), 3)) if mag is None else np.nan_to_num(mag, nan=0.0, posinf=0.0, neginf=0.0)
    matrices = np.empty((len(t_s), 3, 3))
    samples = _Samples(*(np.ascontiguousarray(v, np.float64) for v in (t_s, accel, gyro, field)))
    _filter(samples, settings or OnBoardFilter(), matrices)
    return matrices


@kernel
def _filter(samples: _Samples, gains: OnBoardFilter, matrices: Floats) -> None:
    """Fill `matrices` (n, 3, 3), sample by sample: propagate by the gyros, then correct tilt and heading."""
    t_s, accel, gyro, mag = samples
    level_s, north_s, calm_field = gains
    r, strength = np.eye(3), 0.0
    for k in range(len(t_s)):
        field = math.sqrt(mag[k, 0] ** 2 + mag[k, 1] ** 2 + mag[k, 2] ** 2)
        if k == 0:
            r = _attitude_at_rest(accel[0], mag[0])
        else:
            dt = t_s[k] - t_s[k - 1]
            dt = dt if 0.0 < dt <= GAP_S else 0.0
            r = r @ _rotation_matrix(0.5 * dt * (gyro[k - 1] + gyro[k]))
            correction = _tilt_error(r, accel[k]) * min(dt / level_s, 1.0)
            if strength > 0.0 and field > 0.0:
                deviation = (field - strength) / (calm_field * strength)
                correction += _heading_error(r, mag[k]) * min(dt / north_s, 1.0) / (1.0 + deviation * deviation)
            r = _rotation_matrix(correction) @ r
        strength = strength if strength > 0.0 else field
        matrices[k] = r


@part
def _attitude_at_rest(accel: Floats, mag: Floats) -> Floats:
    """Attitude (3, 3) of a sensor at rest from one sample; without a field the sensor's x axis is taken as north."""
    force = math.sqrt(np.sum(accel**2))
    up = accel / force if force > NEAR_ZERO else np.array([0.0, 0.0, 1.0])
    toward = mag if np.sum(mag**2) > 0.0 else np.array([1.0, 0.0, 0.0])
    north = toward - up * np.sum(up * toward)
    size = math.sqrt(np.sum(north**2))
    if size < NEAR_ZERO:  # no horizontal part: any horizontal direction
        axis = np.zeros(3)
        axis[np.argmin(np.abs(up))] = 1.0
        north = axis - up * np.sum(up * axis)
        size = math.sqrt(np.sum(north**2))
    north = north / size
    r = np.empty((3, 3))
    r[0] = north
    r[1] = np.cross(up, north)
    r[2] = up
    return r


@part
def _rotation_matrix(v: Floats) -> Floats:
    """Rotation matrix (3, 3) of a rotation vector (3,) [Rodrigues]."""
    angle = math.sqrt(v[0] ** 2 + v[1] ** 2 + v[2] ** 2)
    a = 1.0 if angle < SMALL_RAD else math.sin(angle) / angle
    b = 0.5 if angle < SMALL_RAD else (1.0 - math.cos(angle)) / (angle * angle)
    cross = np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
    return np.eye(3) + a * cross + b * (cross @ cross)


@part
def _tilt_error(r: Floats, accel: Floats) -> Floats:
    """Rotation vector (3,) in the world that turns the specific force to the vertical, as if the sensor did not accelerate."""
    up = r @ accel / GRAVITY_M_S2
    return np.array([up[1], -up[0], 0.0])


@part
def _heading_error(r: Floats, mag: Floats) -> Floats:
    """Rotation vector (3,) about the vertical that turns the horizontal part of the field to the north."""
    field = r @ mag
    return np.array([0.0, 0.0, -math.atan2(field[1], field[0])])
