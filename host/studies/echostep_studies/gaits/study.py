# SPDX-License-Identifier: MIT
"""`echostep evaluate gaits`: walking, hurrying, running, crawling, sidestepping, stairs and ladders, by the foot alone and by the legs alone.

In: seeds. Out: a row a manner and sensor, means over the runs; two tables. Owns nothing. Everything is simulated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from statistics import fmean
from typing import Any

from echostep_app.output.table import Table
from echostep_studies.frame.report import as_dicts, rows_by_name
from echostep_studies.frame.study import Study, StudyRequest
from echostep_studies.gaits.foot import STEPS, FootRun, foot_rows
from echostep_studies.gaits.legs import CYCLES, LegRun, leg_rows

FOOT_COLUMNS = {
    "name": "", "way_m": "way m", "way_percent": "way %", "ending_m": "end m", "worst_m": "worst m", "height_m": "height m",
    "steps_percent": "steps %",
}  # fmt: skip
LEG_COLUMNS = {
    "name": "", "forward_m": "forward m", "found_m": "found m", "sd_m": "sd m", "error_over_sd": "error / sd", "up_m": "up m", "rise_m": "rise m",
    "stairs_percent": "stairs %", "blind_percent": "unseen %",
}  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class FootSummary:
    """Means of a manner by a foot; `worst_m`: the greatest error of an end."""

    name: str
    runs: int
    way_m: float
    way_percent: float
    ending_m: float
    height_m: float
    steps_percent: float
    worst_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class LegSummary:
    """Means of a manner by a leg."""

    name: str
    runs: int
    forward_m: float
    found_m: float
    sd_m: float
    error_over_sd: float
    up_m: float
    rise_m: float
    stairs_percent: float
    blind_percent: float


def one_run(seed: int) -> list[FootRun | LegRun]:
    """All manners, once."""
    return [*foot_rows(seed), *leg_rows(seed)]


def summarize(rows: Sequence[FootRun | LegRun]) -> list[FootSummary | LegSummary]:
    """Means of each manner over the runs."""
    feet = rows_by_name(row for row in rows if isinstance(row, FootRun))
    legs = rows_by_name(row for row in rows if isinstance(row, LegRun))
    return [
        *(FootSummary(**_means(group), worst_m=max(row.ending_m for row in group)) for group in feet),
        *(LegSummary(**_means(group)) for group in legs),
    ]


def _means(group: Sequence[FootRun | LegRun]) -> dict[str, Any]:
    """Name and number of the rows of a manner, and the mean of each of their figures."""
    figures = [field.name for field in fields(group[0]) if field.name not in ("name", "seed")]
    means = {key: fmean(getattr(row, key) for row in group) for key in figures}
    return {"name": group[0].name, "runs": len(group)} | means


def _tables(rows: list[FootSummary | LegSummary], request: StudyRequest) -> list[Table]:
    runs = f"{request.runs} runs, simulated"
    return [
        Table(
            f"The foot alone, {STEPS} steps, {runs}",
            as_dicts(r for r in rows if isinstance(r, FootSummary)),
            FOOT_COLUMNS,
        ),
        Table(
            f"One leg alone, {CYCLES} cycles, {runs}",
            as_dicts(r for r in rows if isinstance(r, LegSummary)),
            LEG_COLUMNS,
        ),
    ]


STUDY: Study[FootRun | LegRun, FootSummary | LegSummary] = Study(
    "gaits", (FootRun, LegRun), one_run, summarize, _tables
)
