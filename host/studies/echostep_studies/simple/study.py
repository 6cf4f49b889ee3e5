# SPDX-License-Identifier: MIT
"""The study `simple`: every building with every fault, from a known start.

In: seeds. Out: the table, JSON, Parquet. Owns the columns.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from echostep.arrays import Floats
from echostep.localization import Start
from echostep.plan import Pose
from echostep_app.output.table import Table
from echostep_studies.bench.filtering import track
from echostep_studies.bench.judgement import LOST, TRACKING, TruePlaces, judge
from echostep_studies.bench.walks import SimulatedWalk, simulate, simulate_by_legs
from echostep_studies.frame.parts import matching
from echostep_studies.frame.report import Row, by_name, named
from echostep_studies.frame.study import Study, StudyRequest
from echostep_studies.simple.buildings import BUILDINGS
from echostep_studies.simple.faults import FAULTS

LEGS = "/legs"
# From a start that is off by its stated deviations, and from one that is turned by four of them
OFF = {"/off": "", "/turned": "", "/off-foot": "/foot-alone"}
NAMES = tuple(f"{building}{fault}" for building in BUILDINGS for fault in (*FAULTS, *OFF, LEGS))
COLUMNS = {
    "name": "", "runs": "runs", "tracking": "says tracking %", "lost": "says lost %", "false_tracking": "false tracking %", "mean_m": "mean m",
    "rmse_m": "RMSE m", "worst_m": "worst m", "in_ellipse": "in ellipse %", "laid_m": "path laid on the plan m",
}  # fmt: skip
NOTES = (
    "From the true place and heading, with the default start: 0.15 m, 5 degrees; off: by as much; turned: by 20. Shares are of all estimates.",
    "false tracking: off by more than 1 m. path laid on the plan: RMSE of the measured path from that start, without a filter.",
    "in ellipse: of the tracking claims, those whose 95 % ellipse holds the true place.",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class SimpleRow:
    """One walk: shares of the estimates, errors (m)."""

    name: str
    seed: int
    tracking: float
    lost: float
    false_tracking: float
    mean_m: float
    rmse_m: float
    worst_m: float
    ellipses: int
    in_ellipse: int
    laid_m: float


def simple_run(names: Sequence[str], seed: int) -> list[SimpleRow]:
    """The rows of these names with the walks of this seed."""
    rows = []
    for building, site in BUILDINGS.items():
        wanted = [name for name in names if name.split("/")[0] == building]
        walk = simulate(site(seed), seed) if any(not name.endswith(LEGS) for name in wanted) else None
        for name in wanted:
            if name.endswith(LEGS):
                rows.append(_row(name, seed, simulate_by_legs(site(seed), seed)))
            else:
                assert walk is not None
                fault = name.removeprefix(building)
                rows.append(_row(name, seed, FAULTS[OFF.get(fault, fault)](walk)))
    return rows


def _row(name: str, seed: int, walk: SimulatedWalk) -> SimpleRow:
    start = walk.pose_at(walk.segments[0].segment.t0_s)
    if name.endswith(tuple(OFF)):
        east, north, turn = np.random.default_rng([seed, 5]).standard_normal(3).tolist()
        if name.endswith("/turned"):
            east, north, turn = 0.0, 0.0, math.copysign(4.0, turn)
        start = Pose(start.x_m + 0.15 * east, start.y_m + 0.15 * north, start.heading_rad + math.radians(5.0) * turn)
    run = track(walk.segments, walk.built, Start(start), seed)
    t_s = np.array([claim.t_s for claim in run.claims])
    true = walk.places_at(t_s)
    judged = judge(run.claims, TruePlaces(true, np.ones((len(t_s), 1), np.bool_)), walk.walked_m(t_s))
    off = judged.error_m
    return SimpleRow(
        name=name, seed=seed, tracking=float((judged.status == TRACKING).mean()), lost=float((judged.status == LOST).mean()),
        false_tracking=float(judged.false_tracking.mean()), mean_m=float(off.mean()), rmse_m=float(np.sqrt((off**2).mean())),
        worst_m=float(off.max()), ellipses=len(judged.in_ellipse), in_ellipse=int(judged.in_ellipse.sum()),
        laid_m=float(np.sqrt(((_laid(walk, start) - true) ** 2).sum(1).mean())),
    )  # fmt: skip


def _laid(walk: SimulatedWalk, start: Pose) -> Floats:
    """Ends (n, 2) of the measured path, laid on the plan at the start."""
    path = [measured.segment for measured in walk.segments]
    turn = start.heading_rad - path[0].heading0_rad
    c, s = np.cos(turn), np.sin(turn)
    ends = np.cumsum([(segment.dx_m, segment.dy_m) for segment in path], axis=0)
    return np.asarray(ends @ np.array([[c, s], [-s, c]]) + (start.x_m, start.y_m))


def _summary(rows: Sequence[SimpleRow]) -> Row:
    def mean(name: str, power: float = 1.0) -> float:
        return round(float(np.mean([getattr(row, name) ** power for row in rows]) ** (1.0 / power)), 5)

    ellipses = sum(row.ellipses for row in rows)
    return {
        **named(rows), "tracking": 100.0 * mean("tracking"), "lost": 100.0 * mean("lost"),
        "false_tracking": 100.0 * mean("false_tracking"), "mean_m": mean("mean_m"), "rmse_m": mean("rmse_m", 2.0),
        "worst_m": max(row.worst_m for row in rows), "laid_m": mean("laid_m", 2.0),
        "in_ellipse": 100.0 * sum(row.in_ellipse for row in rows) / ellipses if ellipses else None,
    }  # fmt: skip


def simple_study(pattern: str = "*") -> Study[SimpleRow, Row]:
    """The study of the rows whose names match a pattern."""
    names = matching(NAMES, pattern)
    return Study("simple", (SimpleRow,), partial(simple_run, names), by_name(_summary), _tables)


def _tables(rows: list[Row], request: StudyRequest) -> list[Table]:
    title = f"Known starts in the simplest buildings: {request.runs} simulated walks a row"
    return [Table(title, rows, COLUMNS, NOTES)]
