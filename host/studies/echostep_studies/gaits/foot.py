# SPDX-License-Identifier: MIT
"""A foot in every manner of moving: the zero-velocity navigation against the simulated course.

In: seeds. Out: a row a manner: true way, its error, error of the end in the plane and in height, steps found. Owns the manners that `rolling_foot`
lacks. The gyro bends off at a soft limit; noise and biases are an MTx's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from echostep.arrays import Floats
from echostep.foot.steps import walk_track
from echostep_simulation.people.rolling_foot import MANNERS, Course, FootManner, course, samples

STEPS, RATE_HZ = 40, 200
SOFT_LIMIT_RAD_S, SHARPNESS = math.radians(540.0), 24.0  # as real foot sensors bend off, at 520 to 558 deg/s
# Assumed: a crawling foot drags behind its knee, sole up; on a ladder a foot goes up two rungs of 28 cm [EN 131] and stands on its middle.
MORE = {
    "hurried": FootManner((1.2, 0.0, 0.0), turn_rad=0.35, swing_s=0.55, stance_s=0.22, toe_off_rad=1.0, roll_s=0.09),
    "crawling": FootManner(
        (0.6, 0.0, 0.0),
        swing_s=0.6,
        stance_s=0.7,
        toe_off_rad=0.15,
        heel_strike_rad=0.0,
        clearance_m=0.01,
        rest_rad=1.3,
    ),
    "up a ladder": FootManner((0.0, 0.0, 0.56), swing_s=0.7, stance_s=0.8, toe_off_rad=0.3, heel_strike_rad=0.2),
    "down a ladder": FootManner((0.0, 0.0, -0.56), swing_s=0.7, stance_s=0.8, toe_off_rad=0.3, heel_strike_rad=0.2),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class FootRun:
    """One manner by a foot: the true way and its error, errors of the end in the plane and in height, steps found of those that were."""

    name: str
    seed: int
    way_m: float
    way_percent: float
    ending_m: float
    height_m: float
    steps_percent: float


def foot_rows(seed: int) -> list[FootRun]:
    """One row for each manner."""
    return [foot_row(name, manner, seed) for name, manner in (MANNERS | MORE).items()]


def foot_row(name: str, manner: FootManner, seed: int) -> FootRun:
    """40 steps of one manner, no two alike."""
    rng = np.random.default_rng([seed, 70])
    walked = course(manner, STEPS, rng)
    t_s, accel, gyro = samples(walked, RATE_HZ, rng=rng)
    track = walk_track(t_s, accel, soft_limited(gyro))
    way = float(np.linalg.norm(np.diff(walked.prints_m, axis=0), axis=1).sum())
    measured_m = float(sum(np.linalg.norm(step.move_m) for step in track.steps))
    off = track.position_m[-1] - _end(walked)
    return FootRun(
        name=f"foot/{name}", seed=seed, way_m=way, way_percent=100.0 * (measured_m / way - 1.0),
        ending_m=float(np.hypot(off[0], off[1])), height_m=abs(float(off[2])), steps_percent=100.0 * len(track.steps) / STEPS,
    )  # fmt: skip


def soft_limited(gyro: Floats) -> Floats:
    """Readings (n, 3) of rates that bend off within a few percent of the limit, never twice at one value."""
    return np.asarray(gyro * (1.0 + (np.abs(gyro) / SOFT_LIMIT_RAD_S) ** SHARPNESS) ** (-1.0 / SHARPNESS))


def _end(walked: Course) -> Floats:
    """Where the sensor ends (3,), from where it began."""
    return np.asarray(walked.position_m[-1] - walked.position_m[0])
