"""The magnetometer of a foot, which has to earn its trust: near a floor indoors the field's direction errs by 15 to 40 degrees from step to step.

In: the magnetic field while the foot rests, in any unit. Out: corrections of the navigation's yaw, or none. The caller owns the `Magnetometer`.

Per stance there is one mean field, in the levelled axes of the foot: north, turned back by the foot's yaw, plus iron that moves with the foot. A
Kalman filter of both is kept on the stances whose strength and dip are the usual ones, and how far they scatter about it is measured: between
neighbouring stances the gyros hardly err, so this is the field's own disturbance. Only while it is small, the yaw may be corrected, too.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.foot import ins
from echostep.foot.ins import YAW, Nav
from echostep.jit import allocating_kernel, lean_kernel

FEWEST = 3  # samples of a rest
STRANGE = 0.1  # of the field's strength: more than so off in strength or height is another field
SCATTER = 0.12  # of the field's strength, rms: more is no north
AGREEING = 6  # stances in a row
REPEATED = 5.0  # a disturbance is much the same over so many stances
FLOOR = 0.05  # of the strength: fields bend slowly along buildings, too
NORTH, IRON = 0.5, 0.15  # of the strength, what they may be at first
GAIN = 0.08  # of one stance, in what is usual
DELTA, SIZE = 4, 5


class Magnetometer(NamedTuple):
    """`total` (3,) and `taken` (1,): the field over the present rest. `field` (4,): north in the walk frame, iron in the foot's levelled axes;
    `P` (5, 5) their covariance with the yaw error's. `usual` (3,): strength, height, squared scatter. `yaw_variance` (1,) of the navigation then.
    `seen` (3,): stances measured, agreeing in a row, trusted.
    """

    total: Floats
    taken: Floats
    field: Floats
    P: Floats
    usual: Floats
    yaw_variance: Floats
    seen: Ints


def new_compass() -> Magnetometer:
    """Nothing measured yet."""
    return Magnetometer(
        np.zeros(3), np.zeros(1), np.zeros(4), np.zeros((SIZE, SIZE)), np.zeros(3), np.zeros(1), np.zeros(3, np.int64)
    )


@lean_kernel
def gather(compass: Magnetometer, nav: Nav, mag: Floats) -> None:
    """Take the field (3,) at a sample of rest, body frame."""
    if not (math.isfinite(mag[0]) and math.isfinite(mag[1]) and math.isfinite(mag[2])):
        return
    m = ins.apply(ins.rotation(nav.attitude), mag)
    yaw = ins.heading(nav)
    c, s = math.cos(yaw), math.sin(yaw)
    compass.total[0] += c * m[0] + s * m[1]
    compass.total[1] += c * m[1] - s * m[0]
    compass.total[2] += m[2]
    compass.taken[0] += 1.0


@allocating_kernel
def correction(compass: Magnetometer, nav: Nav, yaw: float) -> float:
    """The rest is over, at this yaw: by how much the navigation's yaw is to be turned (rad), 0 without trust; its gyro bias has been corrected."""
    taken = compass.taken[0]
    h = compass.total / max(taken, 1.0)
    compass.total[:] = 0.0
    compass.taken[0] = 0.0
    strength = math.sqrt(h[0] ** 2 + h[1] ** 2 + h[2] ** 2)
    if taken < FEWEST or not strength > 0.0:
        return 0.0
    c, s = math.cos(yaw), math.sin(yaw)
    compass.seen[0] += 1
    if compass.seen[0] == 1:
        _start(compass, nav, h, strength, c, s)
        return 0.0
    compass.P[DELTA, DELTA] += max(nav.P[YAW, YAW] - compass.yaw_variance[0], 0.0)
    compass.yaw_variance[0] = nav.P[YAW, YAW]
    if _strange(compass, h, strength):
        compass.seen[1] = 0
        return 0.0
    return _fuse(compass, nav, h, c, s)


@allocating_kernel
def _start(compass: Magnetometer, nav: Nav, h: Floats, strength: float, c: float, s: float) -> None:
    compass.field[:] = 0.0
    compass.field[0], compass.field[1] = c * h[0] - s * h[1], s * h[0] + c * h[1]
    for i in range(DELTA):
        compass.P[i, i] = ((NORTH if i < 2 else IRON) * strength) ** 2
    compass.P[DELTA, DELTA] = nav.P[YAW, YAW]
    compass.usual[0], compass.usual[1], compass.usual[2] = strength, h[2], 2.0 * SCATTER**2
    compass.yaw_variance[0] = nav.P[YAW, YAW]


@allocating_kernel
def _strange(compass: Magnetometer, h: Floats, strength: float) -> bool:
    """Whether strength or height of this field is not the usual one; the usual follows slowly."""
    usual = compass.usual[0]
    off = max(abs(strength - usual), abs(h[2] - compass.usual[1])) / usual
    gain = max(GAIN, 1.0 / compass.seen[0])
    compass.usual[0] += gain * (strength - usual)
    compass.usual[1] += gain * (h[2] - compass.usual[1])
    return off > STRANGE


@allocating_kernel
def _fuse(compass: Magnetometer, nav: Nav, h: Floats, c: float, s: float) -> float:
    """Two Kalman updates of north and iron, and of the yaw when trusted."""
    x, unit2 = compass.field, compass.usual[0] ** 2
    e0 = h[0] - (c * x[0] + s * x[1] + x[2])
    e1 = h[1] - (c * x[1] - s * x[0] + x[3])
    gain = max(GAIN, 1.0 / compass.seen[0])
    compass.usual[2] += gain * (min(0.5 * (e0 * e0 + e1 * e1) / unit2, 1.0) - compass.usual[2])
    agrees = compass.usual[2] < SCATTER**2
    compass.seen[1] = compass.seen[1] + 1 if agrees else 0
    trusted = compass.seen[1] >= AGREEING
    row = np.zeros((2, SIZE))
    row[0, 0], row[0, 1], row[0, 2], row[0, DELTA] = c, s, 1.0, c * x[1] - s * x[0]
    row[1, 0], row[1, 1], row[1, 3], row[1, DELTA] = -s, c, 1.0, -c * x[0] - s * x[1]
    noise = (compass.usual[2] + FLOOR**2) * REPEATED * unit2
    before = compass.P[DELTA, DELTA]
    turned = 0.0
    for k in range(2):
        turned += _update(compass, row[k], (e0 if k == 0 else e1) - row[k, DELTA] * turned, noise, trusted)
        if k == 0:
            e1 = h[1] - (c * x[1] - s * x[0] + x[3])
    after = compass.P[DELTA, DELTA]
    if trusted and after < before:
        compass.seen[2] += 1
        gain = 1.0 - after / before
        ins.observe(nav, YAW, turned / gain, after / gain)
        compass.yaw_variance[0] = nav.P[YAW, YAW]
    return turned


@allocating_kernel
def _update(compass: Magnetometer, row: Floats, error: float, noise: float, trusted: bool) -> float:
    """One row: corrects north and iron; returns the yaw's correction. Without trust the yaw's error is only considered [Schmidt 1966]."""
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
