# SPDX-License-Identifier: MIT
"""The rows `legs/slow`, ...: walks of about 5 m by many simulated people, legs known, no calibration, and what each fault of the sensors does.

In: seeds, a person each. Out: rows `{name, pace, cause, runs, bias_percent, sd_percent, mean_abs_percent, worst_percent}`. Owns the causes.
The people walk by joint curves of their own (`simulation.joint_gait`), which know nothing of the estimator. Signs and sample's phase are drawn.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from echostep.arrays import Floats
from echostep.legs.kinematics import LegLengths
from echostep.legs.stride import Stride, StrideSettings
from echostep.legs.strides import StrideEstimator
from echostep_app.offline.leg_gyros import repair_clipping
from echostep_app.output.table import Table
from echostep_simulation.people.leg_angles import LegDimensions
from echostep_studies.frame.parts import Part
from echostep_studies.frame.report import Row, named
from echostep_studies.frame.study import StudyRequest
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
WALKS = {f"legs/{pace}" + (f", {cause}" if cause else ""): (pace, cause) for pace in PACES for cause in CAUSES}


@dataclass(frozen=True, slots=True, kw_only=True)
class PersonRun:
    """The error of one walk."""

    name: str
    seed: int
    error_percent: float


def people_rows(names: Sequence[str], seed: int) -> list[PersonRun]:
    """One person at the paces and with the causes of these names."""
    person = draw_person(np.random.default_rng([seed, 50]))
    gaits = {pace: five_metres(person, PACES[pace], seed) for pace in dict.fromkeys(WALKS[name][0] for name in names)}
    rows = []
    for name in names:
        pace, cause = WALKS[name]
        error = 100.0 * (measured_m(gaits[pace], person, CAUSES[cause], seed) / float(gaits[pace].way_m[-1]) - 1.0)
        rows.append(PersonRun(name=name, seed=seed, error_percent=error))
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
    thigh, shank = repair_clipping(t_s, rates).T
    return sum(stride.length_m for stride in strides_of(person.leg, t_s, thigh, shank))


def strides_of(
    leg: LegDimensions, t_s: Floats, thigh: Floats, shank: Floats, sign: tuple[float, float] | None = None
) -> list[Stride]:
    """Strides of a leg of known lengths from the rates of its gyros (n,); `sign`: of the gyros, where it is known."""
    legs = StrideEstimator(StrideSettings(LegLengths(leg.thigh_m, leg.shank_m)), sign)
    return [*legs.feed(t_s, thigh, shank), *legs.finish()]


def _summary(rows: Sequence[PersonRun]) -> Row:
    (pace, cause), errors = WALKS[rows[0].name], np.array([row.error_percent for row in rows])
    return named(rows) | {
        "pace": pace, "cause": cause, "bias_percent": round(float(errors.mean()), 2), "sd_percent": round(float(errors.std()), 2),
        "mean_abs_percent": round(float(np.abs(errors).mean()), 2), "worst_percent": round(float(np.abs(errors).max()), 2),
    }  # fmt: skip


def _tables(rows: list[Row], request: StudyRequest) -> list[Table]:
    title = f"About {WAY_M:g} m by {request.runs} people, legs known, no calibration (simulated)"
    shown = [row for row in rows if "bias_percent" in row]
    return [Table(title, shown, COLUMNS, ("Error of the distance from standing to standing.",))]


PART = Part(list(WALKS), people_rows, {PersonRun: _summary}, _tables)
