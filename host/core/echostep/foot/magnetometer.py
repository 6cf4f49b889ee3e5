# SPDX-License-Identifier: MIT
"""Yaw correction by the foot's magnetometer, used only where the field is found to be undisturbed.

In: the magnetic field while the foot rests, in any unit. Out: corrections of the navigation's yaw, or none. The caller owns the `Magnetometer`.

Near a floor indoors the field's direction errs by 15 to 40 degrees from step to step. Each stance gives one mean field in the levelled axes of the
foot: north, rotated by the negative yaw, plus the iron that moves with the foot. A Kalman filter estimates both from stances of usual strength and
vertical component. The scatter of its innovations measures the field's disturbance, as the gyros hardly drift between neighbouring stances. Only
while that scatter is small, the yaw is corrected too.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.foot import ins
from echostep.foot.ins import YAW, Nav
from echostep.jit import allocating_part, lean_part

FEWEST = 3  # samples of a stance
STRANGE = 0.1  # gate on strength and vertical component, as a share of the strength
SCATTER = 0.12  # largest rms innovation of a usable field, as a share of the strength
AGREEING = 6  # stances in a row with small scatter, before the yaw is corrected
REPEATED = 5.0  # correlation length of a disturbance, in stances
FLOOR = 0.05  # least rms, as a share of the strength: the field bends slowly along a building
NORTH_SD, IRON_SD = 0.5, 0.15  # initial, as shares of the strength
# Growth of the yaw's variance since the last stance, beyond which samples were missing: north is to be found again
NEW_FRAME_RAD2 = math.radians(10.0) ** 2
GAIN = 0.08  # of one stance, in the running means of `usual`

# State: north (2) in the walk frame, iron (2) in the foot's axes, error of the yaw
NORTH, IRON, DELTA, SIZE = 0, 2, 4, 5
STRENGTH, HEIGHT, SCATTER2 = range(3)  # `usual`
MEASURED, IN_A_ROW, TRUSTED = range(3)  # `seen`


class Magnetometer(NamedTuple):
    """`total` (3,) and `sample_count` (1,): field summed over a rest. `field` (4,): north and iron; `P` (5, 5) covariance of both and the
    yaw error. `usual` (3,): running means of strength, vertical component (height) and squared scatter. `yaw_variance` (1,) at the last stance.
    `seen` (3,): stances measured, agreeing in a row, trusted.
    """

    total: Floats
    sample_count: Floats
    field: Floats
    P: Floats
    usual: Floats
    yaw_variance: Floats
    seen: Ints


def new_compass() -> Magnetometer:
    """State before the first stance."""
    return Magnetometer(
        np.zeros(3), np.zeros(1), np.zeros(4), np.zeros((SIZE, SIZE)), np.zeros(3), np.zeros(1), np.zeros(3, np.int64)
    )


@lean_part
def accumulate(compass: Magnetometer, nav: Nav, mag: Floats) -> None:
    """Add the field (3,), body frame, at a sample of rest to the sum."""
    if not (math.isfinite(mag[0]) and math.isfinite(mag[1]) and math.isfinite(mag[2])):
        return
    m = ins.apply(ins.rotation(nav.attitude), mag)
    yaw = ins.heading(nav)
    c, s = math.cos(yaw), math.sin(yaw)
    compass.total[0] += c * m[0] + s * m[1]
    compass.total[1] += c * m[1] - s * m[0]
    compass.total[2] += m[2]
    compass.sample_count[0] += 1.0


@allocating_part
def correction(compass: Magnetometer, nav: Nav, yaw: float) -> float:
    """Yaw correction (rad) at the end of a stance with this yaw, 0 while the field is not trusted; corrects the gyro bias in `nav`, too."""
    count = compass.sample_count[0]
    h = compass.total / max(count, 1.0)
    compass.total[:] = 0.0
    compass.sample_count[0] = 0.0
    strength = math.sqrt(h[0] ** 2 + h[1] ** 2 + h[2] ** 2)
    if count < FEWEST or not strength > 0.0:
        return 0.0
    c, s = math.cos(yaw), math.sin(yaw)
    compass.seen[MEASURED] += 1
    growth = max(nav.P[YAW, YAW] - compass.yaw_variance[0], 0.0)
    if compass.seen[MEASURED] == 1 or growth > NEW_FRAME_RAD2:
        _start(compass, nav, h, strength, c, s)
        return 0.0
    compass.P[DELTA, DELTA] += growth
    compass.yaw_variance[0] = nav.P[YAW, YAW]
    if _strange(compass, h, strength):
        compass.seen[IN_A_ROW] = 0
        return 0.0
    return _update_field(compass, nav, h, c, s)


@allocating_part
def _start(compass: Magnetometer, nav: Nav, h: Floats, strength: float, c: float, s: float) -> None:
    """Initialise north with the first stance's field in this walk frame, iron with zero."""
    compass.field[:] = compass.P[:] = 0.0
    compass.seen[IN_A_ROW] = 0
    compass.field[NORTH], compass.field[NORTH + 1] = c * h[0] - s * h[1], s * h[0] + c * h[1]
    for i in range(DELTA):
        compass.P[i, i] = ((NORTH_SD if i < IRON else IRON_SD) * strength) ** 2
    compass.P[DELTA, DELTA] = nav.P[YAW, YAW] if compass.seen[MEASURED] == 1 else 0.0  # of a frame that begins here
    compass.usual[STRENGTH], compass.usual[HEIGHT], compass.usual[SCATTER2] = strength, h[2], 2.0 * SCATTER**2
    compass.yaw_variance[0] = nav.P[YAW, YAW]


@allocating_part
def _strange(compass: Magnetometer, h: Floats, strength: float) -> bool:
    """Whether strength or vertical component leave the gate about the running means, which are then updated."""
    usual = compass.usual[STRENGTH]
    off = max(abs(strength - usual), abs(h[2] - compass.usual[HEIGHT])) / usual
    gain = max(GAIN, 1.0 / compass.seen[MEASURED])
    compass.usual[STRENGTH] += gain * (strength - usual)
    compass.usual[HEIGHT] += gain * (h[2] - compass.usual[HEIGHT])
    return off > STRANGE


@allocating_part
def _update_field(compass: Magnetometer, nav: Nav, h: Floats, c: float, s: float) -> float:
    """Kalman updates of north and iron with both horizontal components, and of the yaw when the field is trusted; returns the yaw correction."""
    x, unit2 = compass.field, compass.usual[STRENGTH] ** 2
    e0 = h[0] - (c * x[NORTH] + s * x[NORTH + 1] + x[IRON])
    e1 = h[1] - (c * x[NORTH + 1] - s * x[NORTH] + x[IRON + 1])
    gain = max(GAIN, 1.0 / compass.seen[MEASURED])
    compass.usual[SCATTER2] += gain * (min(0.5 * (e0 * e0 + e1 * e1) / unit2, 1.0) - compass.usual[SCATTER2])
    agrees = compass.usual[SCATTER2] < SCATTER**2
    compass.seen[IN_A_ROW] = compass.seen[IN_A_ROW] + 1 if agrees else 0
    trusted = compass.seen[IN_A_ROW] >= AGREEING
    row = np.zeros((2, SIZE))
    row[0, NORTH], row[0, NORTH + 1], row[0, IRON], row[0, DELTA] = c, s, 1.0, c * x[NORTH + 1] - s * x[NORTH]
    row[1, NORTH], row[1, NORTH + 1], row[1, IRON + 1], row[1, DELTA] = -s, c, 1.0, -c * x[NORTH] - s * x[NORTH + 1]
    noise = (compass.usual[SCATTER2] + FLOOR**2) * REPEATED * unit2
    before = compass.P[DELTA, DELTA]
    turned = 0.0
    for k in range(2):
        turned += _update(compass, row[k], (e0 if k == 0 else e1) - row[k, DELTA] * turned, noise, trusted)
        if k == 0:
            e1 = h[1] - (c * x[NORTH + 1] - s * x[NORTH] + x[IRON + 1])
    after = compass.P[DELTA, DELTA]
    if trusted and after < before:
        compass.seen[TRUSTED] += 1
        gain = 1.0 - after / before
        ins.update(nav, YAW, turned / gain, after / gain)
        compass.yaw_variance[0] = nav.P[YAW, YAW]
    return turned


@allocating_part
def _update(compass: Magnetometer, row: Floats, error: float, noise: float, trusted: bool) -> float:
    """Scalar update of north and iron; returns the yaw's correction. Without trust the yaw's error is a consider state [Schmidt 1966]."""
    P = compass.P
    towards, total = np.zeros(SIZE), noise
    for i in range(SIZE):
        for j in range(SIZE):
            towards[i] += P[i, j] * row[j]
        total += row[i] * towards[i]
    gain = towards / total
    if not trusted:
        gain[DELTA] = 0.0
    for i in range(DELTA):
        compass.field[i] += gain[i] * error
    for i in range(SIZE):
        for j in range(SIZE):
            P[i, j] += gain[i] * gain[j] * total - gain[i] * towards[j] - towards[i] * gain[j]
    return gain[DELTA] * error
