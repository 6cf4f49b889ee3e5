# SPDX-License-Identifier: MIT
"""The columns of the tables: rows of many runs -> one summary row for each name.

In: rows of runs (`run_row`). Out: summary rows. Owns the names and the meaning of the columns.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from echostep_app.output.table import Table
from echostep_studies.bench.filtering import FilterRun
from echostep_studies.bench.judgement import JudgedRun
from echostep_studies.frame.report import LOST_END_M, Row, as_dict, by_name, named

ALARM_S = 5.0  # an error of more than ALARM_M must be flagged within this time
FIT = 0.5  # probability of the plan below which a run says that it does not fit
FOUND_COLUMNS = {
    "name": "", "runs": "runs", "found": "found %", "listed": "listed %", "found_m": "after m", "mean_m": "then mean m",
    "ce95_m": "CE95 m", "median_m": "median m", "lost": "lost", "named": "named %", "most_particles": "particles",
    "times_real_time": "x real time",
}  # fmt: skip
CLAIM_COLUMNS = {
    "name": "", "tracking": "says tracking %", "false_tracking": "false tracking %", "false_lost": "false lost %",
    "beyond_protection": "beyond radius %", "in_ellipse": "in ellipse %", "alarm_s": "alarm s", "alarm_in_5s": "in 5 s %",
    "false_alarms_h": "false alarms /h",
}  # fmt: skip
_rounded = partial(round, ndigits=5)
SHARES = (
    "found", "listed", "false_tracking", "false_lost", "beyond_protection", "in_ellipse", "alarm_in_5s", "named", "tracking",
)  # fmt: skip
_NOTES = (
    "found: within 1 m on the right floor from some moment within {search} m on until the end; then: all claims after that.",
    "median: of all claims.",
    "listed: the last claim is right, or has the true place among its hypotheses. lost: runs that end more than 3 m off.",
    "false tracking, false lost, beyond radius: shares of all claims. alarm: 95 % of errors above 3 m are flagged (do not say tracking) so soon.",
    "in ellipse: of the claims that say tracking, those whose 95 % ellipse holds the true place.",
    "false alarms: tracking turns to lost at an error below 0.5 m. named: the run ends with 'this plan does not fit'. x real time: CPU time.",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class ClaimsRow:
    """What the table needs of a run. `judged`: False where the wearer has no place on the plan."""

    name: str
    seed: int
    named: bool
    most_particles: int
    span_s: float
    cpu_s: float
    tracking: float
    claims: int
    judged: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class JudgedRow(ClaimsRow):
    """The same where the claims are judged; `found_errors_m`: of all claims after the wearer is found.

    `ellipses`: claims that say tracking with a covariance; `in_ellipse`: of these, those whose 95 % ellipse holds the true place.
    """

    found_m: float | None
    listed: bool
    found_errors_m: list[float]
    error_m: list[float]
    protection_m: list[float]
    judged_span_s: float
    false_tracking: int
    false_lost: int
    beyond_protection: int
    ellipses: int
    in_ellipse: int
    alarms_s: list[float]
    false_alarms: int


def tables(title: str, rows: Sequence[Row], search_m: float, notes: Sequence[str] = ()) -> list[Table]:
    """Two tables of the summary rows: what is found, and what is claimed."""
    below = [*notes, *(note.format(search=round(search_m)) for note in _NOTES)]
    shares = [{k: 100.0 * v if k in SHARES and v is not None else v for k, v in row.items()} for row in rows]
    return [Table(title, shares, FOUND_COLUMNS), Table(f"{title}: what is claimed", shares, CLAIM_COLUMNS, below)]


def run_row(name: str, seed: int, judged: JudgedRun | None, run: FilterRun) -> ClaimsRow:
    """The row of one run; `judged` is None where the wearer has no place on the plan."""
    row = ClaimsRow(
        name=name, seed=seed, named=run.claims[-1].plan_fits < FIT, most_particles=run.most_particles,
        span_s=run.claims[-1].t_s - run.claims[0].t_s, cpu_s=run.cpu_s,
        tracking=float(np.mean([c.status.value == "tracking" for c in run.claims])), claims=len(run.claims), judged=judged is not None,
    )  # fmt: skip
    if judged is None:
        return row
    after = judged.error_m[judged.walked_m >= (math.inf if judged.found_m is None else judged.found_m)]
    return JudgedRow(
        **as_dict(row), found_m=judged.found_m, listed=judged.listed, found_errors_m=np.round(after, 3).tolist(),
        error_m=np.round(judged.error_m, 3).tolist(), protection_m=np.round(judged.protection_m, 3).tolist(),
        judged_span_s=judged.span_s, false_tracking=int(judged.false_tracking.sum()),
        false_lost=int(judged.false_lost.sum()), beyond_protection=int(judged.beyond_protection.sum()),
        ellipses=len(judged.in_ellipse), in_ellipse=int(judged.in_ellipse.sum()),
        alarms_s=judged.alarm_delays_s, false_alarms=judged.false_alarms,
    )  # fmt: skip


def _summary(runs: Sequence[ClaimsRow]) -> Row:
    claims = sum(r.claims for r in runs)
    summary = {
        **named(runs), "named": _rounded(float(np.mean([r.named for r in runs]))),
        "tracking": _rounded(sum(r.tracking * r.claims for r in runs) / claims),
        "most_particles": max(r.most_particles for r in runs),
        "times_real_time": _rounded(sum(r.span_s for r in runs) / max(sum(r.cpu_s for r in runs), 1e-9)),
    }  # fmt: skip
    judged = [r for r in runs if isinstance(r, JudgedRow)]
    return _judged_summary(summary, judged) if judged else summary


def _judged_summary(summary: Row, runs: Sequence[JudgedRow]) -> Row:
    claims = sum(len(r.error_m) for r in runs)
    distances_m = [r.found_m for r in runs if r.found_m is not None]
    after = [e for r in runs for e in r.found_errors_m]
    delays = [s for r in runs for s in r.alarms_s]
    ellipses = sum(r.ellipses for r in runs)
    hours = sum(r.judged_span_s for r in runs) / 3600.0
    return {
        **summary, "found": _rounded(len(distances_m) / len(runs)),
        "found_m": _rounded(float(np.mean(distances_m))) if distances_m else None,
        "listed": _rounded(float(np.mean([r.listed for r in runs]))),
        "mean_m": _rounded(float(np.mean(after))) if after else None,
        "ce95_m": _rounded(float(np.quantile(after, 0.95))) if after else None,
        "median_m": _rounded(float(np.median([e for r in runs for e in r.error_m]))),
        "lost": sum(r.error_m[-1] > LOST_END_M for r in runs),
        "false_tracking": _rounded(sum(r.false_tracking for r in runs) / claims),
        "false_lost": _rounded(sum(r.false_lost for r in runs) / claims),
        "beyond_protection": _rounded(sum(r.beyond_protection for r in runs) / claims),
        "in_ellipse": _rounded(sum(r.in_ellipse for r in runs) / ellipses) if ellipses else None,
        "alarm_s": _rounded(float(np.quantile(delays, 0.95))) if delays else None,
        "alarm_in_5s": _rounded(float(np.mean([s <= ALARM_S for s in delays]))) if delays else None,
        "false_alarms_h": _rounded(sum(r.false_alarms for r in runs) / hours) if hours else None,
    }  # fmt: skip


summaries = by_name(_summary)
