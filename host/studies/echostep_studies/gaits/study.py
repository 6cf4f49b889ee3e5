# SPDX-License-Identifier: MIT
"""`echostep evaluate gaits`: walking, hurrying, running, crawling, sidestepping, stairs and ladders, by the foot alone and by the legs alone.

In: seeds. Out: a row a manner and sensor, means over the runs; two tables. Owns nothing. Everything is simulated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from statistics import fmean

from echostep_app.output.table import Table
from echostep_studies.frame.report import Row, rows_by_name
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


def one_run(seed: int) -> list[FootRun | LegRun]:
    """All manners, once."""
    return [*foot_rows(seed), *leg_rows(seed)]


def summarize(rows: Sequence[FootRun | LegRun]) -> list[Row]:
    """Means of each manner over the runs."""
    feet = rows_by_name(row for row in rows if isinstance(row, FootRun))
    legs = rows_by_name(row for row in rows if isinstance(row, LegRun))
    return [
        *(_means(group) | {"worst_m": max(row.ending_m for row in group)} for group in feet),
        *(_means(group) for group in legs),
    ]


def _means(group: Sequence[FootRun | LegRun]) -> Row:
    """Name and number of the rows of a manner, and the mean of each of their figures."""
    figures = [field.name for field in fields(group[0]) if field.name not in ("name", "seed")]
    means = {key: fmean(getattr(row, key) for row in group) for key in figures}
    return {"name": group[0].name, "runs": len(group)} | means


def _tables(rows: list[Row], request: StudyRequest) -> list[Table]:
    runs = f"{request.runs} runs, simulated"
    return [
        Table(f"The foot alone, {STEPS} steps, {runs}", [r for r in rows if "way_m" in r], FOOT_COLUMNS),
        Table(f"One leg alone, {CYCLES} cycles, {runs}", [r for r in rows if "rise_m" in r], LEG_COLUMNS),
    ]


STUDY: Study[FootRun | LegRun, Row] = Study("gaits", (FootRun, LegRun), one_run, summarize, _tables)
