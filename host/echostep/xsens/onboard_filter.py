"""The orientation that an MTx computes on board: a model of its filter, which is a black box with known weaknesses [Fischer 2008, 3.2.2].

In: specific force, angular rate and magnetic field in the sensor's axes. Out: matrices sensor -> the MTx world (x magnetic north, y west, z up).
Owns nothing. It stands beside `xsens`: what the device does, for the simulated MTx and for recordings that hold no matrix.

A complementary filter [Mahony et al. 2008]: the gyros turn the attitude, the specific force pulls "up" to the vertical and the horizontal part of
the field pulls "north" to x. So it is fooled as theirs was: a swing is short against the time constant, and its acceleration passes for a
lean [Foxlin 2002]; what the gyros' biases add leans for as long as one walks; iron and machines turn its north; a lean turns the field's
steep dip into a false heading, most of all where the foot turns fast.

How it was set, once, by the figures printed in [Fischer 2008]: `level_s` such that ten simulated walkers (seeds 1 to 10, 100 Hz, the sensor's
errors as in its manual) have the printed mean of the distance errors of the line, the L and the rectangle, -4.3 %, to within half a
percent, and each printed error (+2, -8, -7 %) within their range. 10 s gave -5.7 %, 15 s -4.6 %, 20 s -3.9 % but no rectangle as bad as
-7 %. `north_s` is of the size at which a few metres of machines matter; their moments (`simulation.trails`) then give Figures 5 and 6.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from echostep.arrays import Floats
from echostep.jit import kernel

GRAVITY_M_S2 = 9.81
GAP_S = 0.25  # samples are missing


@dataclass(frozen=True, slots=True)
class OnBoardFilter:
    """`level_s`, `north_s`: time constants of the pull to the vertical and to magnetic north. `calm_field`: a field whose strength is off by this
    share of the first one counts half: "attempts to compensate for magnetic interference" [Fischer 2008].
    """

    level_s: float = 15.0
    north_s: float = 5.0
    calm_field: float = 0.5


def orientations(
    t_s: Floats, accel: Floats, gyro: Floats, mag: Floats | None = None, settings: OnBoardFilter | None = None
) -> Floats:
    """Matrices (n, 3, 3) sensor -> MTx world after each sample of t_s (n,), accel (n, 3) m/s2, gyro (n, 3) rad/s, mag (n, 3) in any unit.

    Over a gap nothing turns. Without a magnetometer x is where the sensor's x axis pointed at first, and the heading drifts as the gyros do.
    """
    settings = settings or OnBoardFilter()
    field = np.zeros((len(t_s), 3)) if mag is None else np.nan_to_num(mag, nan=0.0, posinf=0.0, neginf=0.0)
    found = np.empty((len(t_s), 3, 3))
    t_s, accel, gyro, field = (np.ascontiguousarray(v, np.float64) for v in (t_s, accel, gyro, field))
    gains = np.array([settings.level_s, settings.north_s, settings.calm_field])
    _follow(t_s, accel, gyro, field, gains, found)
    return found


@kernel
def _follow(t_s: Floats, accel: Floats, gyro: Floats, mag: Floats, gains: Floats, found: Floats) -> None:
    """Fill `found`; see `orientations`. `gains` (3,): the settings in their order."""
    level_s, north_s, calm_field = gains
    r, strength = np.eye(3), 0.0
    for k in range(len(t_s)):
        field = math.sqrt(mag[k, 0] ** 2 + mag[k, 1] ** 2 + mag[k, 2] ** 2)
        if k == 0:
            r = _at_rest(accel[0], mag[0])
        else:
            dt = t_s[k] - t_s[k - 1]
            dt = dt if 0.0 < dt <= GAP_S else 0.0
            r = r @ _turned(0.5 * dt * (gyro[k - 1] + gyro[k]))
            pull = _lean(r, accel[k]) * min(dt / level_s, 1.0)
            if strength > 0.0 and field > 0.0:
                off = (field - strength) / (calm_field * strength)
                pull += _astray(r, mag[k]) * min(dt / north_s, 1.0) / (1.0 + off * off)
            r = _turned(pull) @ r
        strength = strength if strength > 0.0 else field
        found[k] = r


@kernel
def _at_rest(accel: Floats, mag: Floats) -> Floats:
    """The attitude of a sensor at rest from one sample, (3, 3); without a field the sensor's x axis is north."""
    force = math.sqrt(np.sum(accel**2))
    up = accel / force if force > 1e-6 else np.array([0.0, 0.0, 1.0])
    ahead = mag if np.sum(mag**2) > 0.0 else np.array([1.0, 0.0, 0.0])
    north = ahead - up * np.sum(up * ahead)
    size = math.sqrt(np.sum(north**2))
    if size < 1e-6:  # no horizontal part: any direction will do
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


@kernel
def _turned(v: Floats) -> Floats:
    """Rotation matrix (3, 3) of a rotation vector (3,) [Rodrigues]."""
    angle = math.sqrt(v[0] ** 2 + v[1] ** 2 + v[2] ** 2)
    a = 1.0 if angle < 1e-9 else math.sin(angle) / angle
    b = 0.5 if angle < 1e-9 else (1.0 - math.cos(angle)) / (angle * angle)
    cross = np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
    return np.eye(3) + a * cross + b * (cross @ cross)


@kernel
def _lean(r: Floats, accel: Floats) -> Floats:
    """Rotation vector (3,) in the world that would stand the specific force upright: on average, one does not accelerate."""
    up = r @ accel / GRAVITY_M_S2
    return np.array([up[1], -up[0], 0.0])


@kernel
def _astray(r: Floats, mag: Floats) -> Floats:
    """Rotation vector (3,) about the vertical that would turn the horizontal part of the field to the north."""
    field = r @ mag
    return np.array([0.0, 0.0, -math.atan2(field[1], field[0])])
