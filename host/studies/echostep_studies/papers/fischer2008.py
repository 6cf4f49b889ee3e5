# SPDX-License-Identifier: MIT
"""Pedestrian dead reckoning exactly as [Fischer 2008, section 3.1]: profile `fischer2008` of the foot.

In: specific force and angular rate of a sensor on the shoe, and the MTx's own matrices. Out: the same `Track` as `foot.walk_track`. Owns nothing.

The paper in four steps: rotate the accelerations into the world by the MTx's matrix (Figure 1); call it stance when the product of the norms of
acceleration and rate of turn has been below a threshold for more than 0.2 s; integrate twice in the swing; in stance the velocity is zero
(Figure 2). What it leaves open is decided here, in the simplest way, and nothing is added that would correct its errors:

- Gravity is 9.81 m/s2 along the world's z axis, and is taken away after the rotation.
- The product is of the raw readings, gravity included, in m/s2 times rad/s: near rest it is 9.81 times the rate, so 16 is 93 deg/s.
- The threshold, "empirically determined", is 16 here: the lowest even number with which none of 200 real stances is missed (both feet of six walks
  with an Xsens MTw at 100 Hz, xsens_mtw_voisard; the footfalls there are marked by hand). It ends 6 of the swings too early.
- A stance is detected only after the 0.2 s, because their implementation was on-line: until then the velocity's error is integrated.
- The velocity's drift at the end of a swing is dropped, not distributed over the swing.
- Integrals are trapezoids, from sample to sample. Over a gap nothing is integrated, and the velocity begins at zero after it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echostep.arrays import Bools, Floats, spans
from echostep.foot.ins import GRAVITY_M_S2
from echostep.foot.steps import FootCounts, Stance, Step, Track
from echostep.foot.zupt_ins import GAP_S, MAX_ACCEL_M_S2, MAX_RATE_RAD_S, STRAY_SAMPLES


@dataclass(frozen=True, slots=True)
class Fischer2008:
    """`threshold`: of the product, m/s2 times rad/s (open in the paper). `stance_s`: how long it stays below (printed)."""

    threshold: float = 16.0
    stance_s: float = 0.2


def walk_track(
    t_s: Floats, accel: Floats, gyro: Floats, orientation: Floats, settings: Fischer2008 | None = None
) -> Track:
    """The walk of samples t_s (n,), accel (n, 3) m/s2, gyro (n, 3) rad/s, with the MTx's matrices (n, 3, 3) sensor -> world.

    The walk frame is the MTx world turned about the vertical, so that the sensor's x axis points along x in the first stance. A sample that
    is not usable (not finite, impossible, not later than those before) repeats the row before. The paper states no covariances: they are NaN.
    """
    settings = settings or Fischer2008()
    t_s = np.asarray(t_s, np.float64)
    good, counts = usable(t_s, accel, gyro, orientation)
    rows = np.maximum.accumulate(np.where(good, np.cumsum(good) - 1, 0))
    if not good.any():
        still = np.zeros(len(t_s))
        return Track(t_s, np.zeros((len(t_s), 3)), still, still > 0.0, [], counts)
    t, force, rate, r = t_s[good], np.asarray(accel)[good], np.asarray(gyro)[good], np.asarray(orientation)[good]
    stance = stances(t, product(force, rate), settings)
    position = positions(t, velocities(t, world_acceleration(r, force), stance))
    level = r[int(np.argmax(stance))]
    position = position @ _from_start(level).T
    heading = headings(r, level)
    return Track(t_s, position[rows], heading[rows], stance[rows], events(t, position, heading, stance), counts)


def world_acceleration(orientation: Floats, accel: Floats) -> Floats:
    """x_w = R_GS x_s, without gravity [Fischer 2008, Figure 1]: (n, 3) m/s2 in the MTx world."""
    acceleration: Floats = np.einsum("nij,nj->ni", orientation, accel) - np.array([0.0, 0.0, GRAVITY_M_S2])
    return acceleration


def product(accel: Floats, gyro: Floats) -> Floats:
    """Norm of the acceleration times norm of the rate of turn, (n,) m/s2 rad/s [Fischer 2008, 3.1; Beauregard 2007]."""
    products: Floats = np.linalg.norm(accel, axis=1) * np.linalg.norm(gyro, axis=1)
    return products


def stances(t_s: Floats, norms: Floats, settings: Fischer2008) -> Bools:
    """Whether the foot is known to stand (n,): the product has been below the threshold for more than 0.2 s [Fischer 2008, 3.1]."""
    below = norms < settings.threshold
    index = np.arange(len(t_s))
    broken = ~below
    broken[1:] |= _gap(t_s)
    since = np.maximum.accumulate(
        np.where(broken, index, 0)
    )  # the sample with which the present run below begins, or breaks
    since = np.where(below[since], since, np.minimum(since + 1, len(t_s) - 1))
    is_stance: Bools = below & (t_s - t_s[since] > settings.stance_s)
    return is_stance


def velocities(t_s: Floats, accel_w: Floats, stance: Bools) -> Floats:
    """First integral (n, 3) m/s, "reset and kept at zero" in stance [Fischer 2008, 3.1]."""
    total = _integral(t_s, accel_w)
    reset = np.concatenate([[True], _gap(t_s)]) | stance
    last = np.maximum.accumulate(np.where(reset, np.arange(len(t_s)), 0))
    corrected: Floats = total - total[last]
    return corrected


def positions(t_s: Floats, velocity: Floats) -> Floats:
    """Second integral (n, 3) m, from the origin."""
    return _integral(t_s, velocity)


def headings(orientation: Floats, level: Floats) -> Floats:
    """How far the sensor has turned about the vertical since `level` (3, 3): (n,) rad, whatever the mounting."""
    cosine = np.einsum("nk,k->n", orientation[:, 0], level[0]) + np.einsum("nk,k->n", orientation[:, 1], level[1])
    sine = np.einsum("nk,k->n", orientation[:, 1], level[0]) - np.einsum("nk,k->n", orientation[:, 0], level[1])
    heading_rad: Floats = np.arctan2(sine, cosine)
    return heading_rad


def events(t_s: Floats, position: Floats, heading: Floats, stance: Bools) -> list[Step | Stance]:
    """The stances that ended, and the steps between the detection of one stance and of the next, in order of time."""
    steps: list[Step | Stance] = []
    unknown = np.full((3, 3), np.nan)
    before: int | None = None
    for begin, end in spans(stance).tolist():
        if before is not None:
            x, y, z = (position[begin] - position[before]).tolist()
            steps.append(Step(float(t_s[before]), float(t_s[begin]), (x, y, z), unknown, float(heading[begin]), np.nan))
        if end < len(t_s):
            steps.append(Stance(float(t_s[begin]), float(t_s[end - 1]), float(heading[end - 1])))
        before = end - 1
    return steps


def usable(t_s: Floats, accel: Floats, gyro: Floats, orientation: Floats | None = None) -> tuple[Bools, FootCounts]:
    """Which samples are usable (n,), and the counts of those that are not; raises ValueError for arrays of other shapes."""
    n = len(t_s)
    matrices = np.zeros((n, 3, 3)) if orientation is None else orientation
    shapes = np.shape(t_s), np.shape(accel), np.shape(gyro), np.shape(matrices)
    if shapes != ((n,), (n, 3), (n, 3), (n, 3, 3)):
        raise ValueError(f"samples of shapes {shapes}; expected (n,), (n, 3), (n, 3), (n, 3, 3)")
    with np.errstate(invalid="ignore"):
        possible = np.isfinite(t_s) & np.isfinite(matrices).all(axis=(1, 2))
        possible &= (np.abs(accel) < MAX_ACCEL_M_S2).all(axis=1) & (np.abs(gyro) < MAX_RATE_RAD_S).all(axis=1)
    good = _advancing(np.asarray(t_s, np.float64), possible)
    gaps = int(_gap(np.asarray(t_s)[good]).sum())
    return good, FootCounts(int(good.sum()), int((~possible).sum()), int((possible & ~good).sum()), 0, gaps, 0)


def _advancing(t_s: Floats, possible: Bools) -> Bools:
    """The possible samples (n,) that are later than the one before, or follow STRAY_SAMPLES from the past: then the clock was set."""
    good, last, stray = possible.copy(), -np.inf, 0
    for k in np.flatnonzero(possible).tolist():
        stray = 0 if t_s[k] > last else stray + 1
        good[k] = stray in (0, STRAY_SAMPLES)
        if good[k]:
            last, stray = float(t_s[k]), 0
    return good


def _gap(t_s: Floats) -> Bools:
    """Whether samples are missing, or the clock was set, before each but the first (n - 1,)."""
    steps = np.diff(t_s)
    is_gap: Bools = (steps > GAP_S) | (steps <= 0.0)
    return is_gap


def _integral(t_s: Floats, values: Floats) -> Floats:
    """Trapezoids from the first sample to each (n, 3), none over a gap."""
    steps = 0.5 * (values[1:] + values[:-1]) * np.diff(t_s)[:, None]
    steps[_gap(t_s)] = 0.0
    return np.vstack([np.zeros(3), np.cumsum(steps, axis=0)])


def _from_start(level: Floats) -> Floats:
    """Rotation (3, 3) about the vertical that turns the horizontal part of the sensor's x axis onto x."""
    size = np.hypot(level[0, 0], level[1, 0])
    c, s = (level[0, 0] / size, level[1, 0] / size) if size > 1e-9 else (1.0, 0.0)
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
