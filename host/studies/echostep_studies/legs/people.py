# SPDX-License-Identifier: MIT
"""`echostep evaluate legs`: walks of about 5 m by many simulated people, legs known, no calibration, and what each fault of the sensors does.

In: seeds, a person each. Out: rows `{name, pace, cause, runs, bias_percent, sd_percent, mean_abs_percent, worst_percent}`. Owns the causes.
The people walk by joint curves of their own (`gaits`), which know nothing of the estimator. Signs and sample's phase are drawn.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from echostep.arrays import Floats
from echostep.legs.kinematics import LegLengths
from echostep.legs.stride import StrideSettings
from echostep.legs.strides import StrideEstimator
from echostep_app.offline.leg_gyros import repair_clipping
from echostep_app.output.table import Table
from echostep_studies.frame.report import Row, rows_by_name
from echostep_studies.frame.study import Study, StudyRequest
from echostep_studies.simulation.joint_gait import (
    FAST,
    NATURAL,
    SLOW,
    JointGaitPerson,
    SimulatedGait,
    WalkingPace,
    draw_person,
    simulate_gait,
)

PACES = {"slow": SLOW, "natural": NATURAL, "fast": FAST}
WAY_M, NEAR_M, TRIES = 5.0, 0.4, 8
STAND_S = 1.5
COLUMNS = {
    "name": "", "runs": "runs", "bias_percent": "bias %", "sd_percent": "sd %", "mean_abs_percent": "mean abs %", "worst_percent": "worst %",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class LegSensors:
    """`bias_rad_s` and `noise_rad_s` standard deviations, `range_rad_s` where they clip, `aslant_rad` between their axes and the knee's."""

    rate_hz: float = 100.0
    bias_rad_s: float = 0.0
    noise_rad_s: float = 0.0
    range_rad_s: float = math.inf
    aslant_rad: float = 0.0
    stand_s: float = STAND_S


CAUSES = {
    "": LegSensors(),
    "bias 0.05 rad/s": LegSensors(bias_rad_s=0.05),
    "bias 0.05 rad/s, never standing": LegSensors(bias_rad_s=0.05, stand_s=0.0),
    "clipped at 300 deg/s": LegSensors(range_rad_s=math.radians(300.0)),
    "15 degrees aslant": LegSensors(aslant_rad=math.radians(15.0)),
    "50 Hz, noise 0.03 rad/s": LegSensors(rate_hz=50.0, noise_rad_s=0.03),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class PersonRun:
    """The error of one walk."""

    name: str
    pace: str
    cause: str
    seed: int
    error_percent: float


def one_run(seed: int) -> list[PersonRun]:
    """One person at every pace, with every cause."""
    person = draw_person(np.random.default_rng([seed, 50]))
    rows = []
    for pace, manner in PACES.items():
        gait = five_metres(person, manner, seed)
        for cause, sensors in CAUSES.items():
            error = 100.0 * (measured_m(gait, person, sensors, seed) / float(gait.way_m[-1]) - 1.0)
            name = f"legs/{pace}" + (f", {cause}" if cause else "")
            rows.append(PersonRun(name=name, pace=pace, cause=cause, seed=seed, error_percent=error))
    return rows


def five_metres(person: JointGaitPerson, manner: WalkingPace, seed: int) -> SimulatedGait:
    """A walk from standing to standing, as near to 5 m as whole steps come."""
    walk_s, gaits = 4.0, list[SimulatedGait]()
    for _ in range(TRIES):
        gait = simulate_gait(person, manner, walk_s, np.random.default_rng([seed, 51]), STAND_S)
        gaits.append(gait)
        off = WAY_M - float(gait.way_m[-1])
        if abs(off) < NEAR_M:
            break
        walk_s = max(walk_s + off * walk_s / float(gait.way_m[-1]), 1.5)
    return min(gaits, key=lambda g: abs(float(g.way_m[-1]) - WAY_M))


def measured_m(gait: SimulatedGait, person: JointGaitPerson, sensors: LegSensors, seed: int) -> float:
    """Distance (m) by our method, measured with these sensors."""
    rng = np.random.default_rng([seed, 52])
    moves = np.flatnonzero(np.abs(gait.shank_rad_s) > 0.0)
    begin, end = gait.t_s[moves[0]] - sensors.stand_s, gait.t_s[moves[-1]] + sensors.stand_s
    t_s: Floats = np.arange(begin, end, 1.0 / sensors.rate_hz) + rng.uniform(0.0, 1.0 / sensors.rate_hz)
    true = np.column_stack([np.interp(t_s, gait.t_s, rate) for rate in (gait.thigh_rad_s, gait.shank_rad_s)])
    rates = math.cos(sensors.aslant_rad) * rng.choice([-1.0, 1.0], 2) * true
    rates += sensors.bias_rad_s * rng.standard_normal(2) + sensors.noise_rad_s * rng.standard_normal(rates.shape)
    rates = np.clip(rates, -sensors.range_rad_s, sensors.range_rad_s)
    legs = StrideEstimator(StrideSettings(LegLengths(person.leg.thigh_m, person.leg.shank_m)))
    thigh, shank = repair_clipping(t_s, rates).T
    return sum(s.length_m for s in (*legs.feed(t_s, thigh, shank), *legs.finish()))


def _summary(rows: list[PersonRun]) -> Row:
    first, errors = rows[0], np.array([row.error_percent for row in rows])
    return {
        "name": first.name, "pace": first.pace, "cause": first.cause, "runs": len(rows),
        "bias_percent": round(float(errors.mean()), 2), "sd_percent": round(float(errors.std()), 2),
        "mean_abs_percent": round(float(np.abs(errors).mean()), 2), "worst_percent": round(float(np.abs(errors).max()), 2),
    }  # fmt: skip


def _tables(rows: list[Row], request: StudyRequest) -> list[Table]:
    title = f"About {WAY_M:g} m by {request.runs} people, legs known, no calibration (simulated)"
    return [Table(title, rows, COLUMNS, ("Error of the distance from standing to standing.",))]


STUDY = Study("legs", (PersonRun,), one_run, lambda rows: [_summary(group) for group in rows_by_name(rows)], _tables)
