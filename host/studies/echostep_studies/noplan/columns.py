# SPDX-License-Identifier: MIT
"""The columns of the study: rows of runs -> one summary row for each name -> tables.

In: rows of runs. Out: summary rows, tables. Owns the names of the columns; their definitions are those of `judgement`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from echostep_app.output.table import Table
from echostep_studies.frame.report import LOST_END_M, Row, Summaries, means, named
from echostep_studies.frame.study import StudyRequest
from echostep_studies.noplan.judgement import ClosureColumns, StoreyColumns, WallColumns

COLUMNS = {
    "name": "row", "rmse_m": "RMSE m", "worst_rmse_m": "worst", "shape_m": "shape m", "foot_rmse_m": "foot alone",
    "footslam_rmse_m": "FootSLAM", "wall_median_m": "walls m", "wall95_m": "95 %", "drawn_pc": "drawn %", "absent_pc": "not there %",
    "closures": "closures", "wrong": "wrong", "map_s": "s",
}  # fmt: skip
SECOND_COLUMNS = {
    "name": "row", "mean_m": "mean m", "worst_m": "worst mean m", "lost": "lost", "runs": "runs", "tracking_pc": "says tracking %",
    "false_tracking_pc": "false tracking %", "beyond_pc": "beyond radius %", "refused": "refused",
}  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class DrawnRun(WallColumns, StoreyColumns, ClosureColumns):
    """A drawing, and the paths of mapper, foot and FootSLAM, against the truth."""

    name: str
    seed: int
    map_s: float
    shape_m: float
    rmse_m: float
    max_m: float
    foot_rmse_m: float
    foot_max_m: float
    footslam_rmse_m: float
    footslam_max_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class SecondRun:
    """Another person, tracked on the drawing: mean error, and that at the end.

    Of all claims, the shares that say tracking, that say so more than 1 m off or on a wrong floor, and that are off by more than their protection
    radius; storeys that are refused as a plan, of those drawn.
    """

    name: str
    seed: int
    mean_m: float
    end_m: float
    tracking: float
    false_tracking: float
    beyond: float
    refused: int


RunRow = DrawnRun | SecondRun


def _drawn_summary(group: Sequence[DrawnRun]) -> Row:
    keys = ("rmse_m", "shape_m", "foot_rmse_m", "footslam_rmse_m", "wall_median_m", "wall95_m", "map_s")
    return {
        **named(group), **means(group, keys), **_percent(group, "drawn", "absent", "wrong_storey"),
        "worst_rmse_m": max(row.rmse_m for row in group), "closures": sum(row.closures for row in group),
        "wrong": sum(row.wrong for row in group),
    }  # fmt: skip


def _second_summary(group: Sequence[SecondRun]) -> Row:
    return {
        **named(group), **means(group, ("mean_m",)), "worst_m": max(row.mean_m for row in group),
        "lost": sum(row.end_m > LOST_END_M for row in group), "refused": sum(row.refused for row in group),
        **_percent(group, "tracking", "false_tracking", "beyond"),
    }  # fmt: skip


def _percent(group: Sequence[RunRow], *shares: str) -> Row:
    """The means of these shares in percent."""
    return {f"{key}_pc": 100.0 * value for key, value in means(group, shares).items()}


SUMMARIES: Summaries = {DrawnRun: _drawn_summary, SecondRun: _second_summary}


def tables(rows: list[Row], request: StudyRequest) -> list[Table]:
    """A table for each kind of row."""
    first = [row for row in rows if "rmse_m" in row]
    second = [row for row in rows if "tracking_pc" in row]
    title = f"Drawn without a plan: {request.runs} simulated walks a row"
    return [Table(title, first, COLUMNS), Table("Another person, tracked on the drawing", second, SECOND_COLUMNS)]
