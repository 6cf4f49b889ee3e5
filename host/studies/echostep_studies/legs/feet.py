# SPDX-License-Identifier: MIT
"""The rows `foot/...`: a foot in every manner of moving, the zero-velocity navigation against the simulated course.

In: seeds. Out: a row a manner: true way, its error, error of the end in the plane and in height, steps found. Owns the manners that `rolling_foot`
lacks. The gyro bends off at a soft limit; noise and biases are an MTx's.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from echostep.arrays import Floats
from echostep.foot.steps import walk_track
from echostep_app.output.table import Table
from echostep_simulation.people.rolling_foot import MANNERS as ROLLING
from echostep_simulation.people.rolling_foot import FootManner, course, samples
from echostep_studies.frame.parts import Part
from echostep_studies.frame.report import Row, means, named
from echostep_studies.frame.study import StudyRequest

STEPS, RATE_HZ = 40, 200
SOFT_LIMIT_RAD_S, SHARPNESS = math.radians(540.0), 24.0  # as real foot sensors bend off, at 520 to 558 deg/s
# Assumed: a crawling foot drags behind its knee, sole up; on a ladder a foot goes up two rungs of 28 cm [EN 131] and stands on its middle.
MANNERS = ROLLING | {
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
FIGURES = ("way_m", "way_percent", "ending_m", "height_m", "steps_percent")
COLUMNS = {
    "name": "", "way_m": "way m", "way_percent": "way %", "ending_m": "end m", "worst_m": "worst m", "height_m": "height m",
    "steps_percent": "steps %",
}  # fmt: skip


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


def foot_rows(names: Sequence[str], seed: int) -> list[FootRun]:
    """40 steps of each of these manners, no two alike."""
    return [_row(name, seed) for name in names]


def _row(name: str, seed: int) -> FootRun:
    rng = np.random.default_rng([seed, 70])
    walked = course(MANNERS[name.removeprefix("foot/")], STEPS, rng)
    t_s, accel, gyro = samples(walked, RATE_HZ, rng=rng)
    track = walk_track(t_s, accel, soft_limited(gyro))
    way = float(np.linalg.norm(np.diff(walked.prints_m, axis=0), axis=1).sum())
    measured_m = float(sum(np.linalg.norm(step.move_m) for step in track.steps))
    off = track.position_m[-1] - (walked.position_m[-1] - walked.position_m[0])
    return FootRun(
        name=name, seed=seed, way_m=way, way_percent=100.0 * (measured_m / way - 1.0),
        ending_m=float(np.hypot(off[0], off[1])), height_m=abs(float(off[2])), steps_percent=100.0 * len(track.steps) / STEPS,
    )  # fmt: skip


def soft_limited(gyro: Floats) -> Floats:
    """Readings (n, 3) of rates that bend off within a few percent of the limit, never twice at one value."""
    return np.asarray(gyro * (1.0 + (np.abs(gyro) / SOFT_LIMIT_RAD_S) ** SHARPNESS) ** (-1.0 / SHARPNESS))


def _summary(group: Sequence[FootRun]) -> Row:
    return named(group) | means(group, FIGURES) | {"worst_m": max(row.ending_m for row in group)}


def _tables(rows: list[Row], request: StudyRequest) -> list[Table]:
    title = f"The foot alone, {STEPS} steps, {request.runs} runs, simulated"
    return [Table(title, [row for row in rows if "way_m" in row], COLUMNS)]


PART = Part([f"foot/{name}" for name in MANNERS], foot_rows, {FootRun: _summary}, _tables)
