# SPDX-License-Identifier: MIT
"""The columns of the study: rows of runs -> one summary row for each name -> tables.

In: rows of runs. Out: summary rows, tables. Owns the names of the columns; their definitions are those of `judgement`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from msgspec import UNSET, UnsetType

from echostep_app.output.table import Table
from echostep_studies.frame.report import LOST_END_M, Row, as_dicts, rows_by_name
from echostep_studies.frame.study import StudyRequest

COLUMNS = {
    "name": "row", "rmse_m": "RMSE m", "worst_rmse_m": "worst", "shape_m": "shape m", "foot_rmse_m": "foot alone",
    "footslam_rmse_m": "FootSLAM", "wall_median_m": "walls m", "wall95_m": "95 %", "drawn_pc": "drawn %", "absent_pc": "not there %",
    "closures": "closures", "wrong": "wrong", "map_s": "s",
}  # fmt: skip
SECOND_COLUMNS = {
    "name": "row", "mean_m": "mean m", "worst_m": "worst mean m", "lost": "lost", "runs": "runs", "tracking_pc": "says tracking %",
    "false_tracking_pc": "false tracking %", "beyond_pc": "beyond radius %", "refused": "refused",
}  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawnRun:
    """A drawing, and the paths of mapper, foot and FootSLAM, against the truth; columns as in `judgement`."""

    name: str
    seed: int
    map_s: float
    wall_median_m: float | UnsetType = UNSET
    wall95_m: float | UnsetType = UNSET
    drawn: float
    absent: float
    drawn_m: float
    wrong_storey: float
    storeys: int
    storeys_walked: int
    closures: int
    wrong: int
    nodes: int
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


def summaries(rows: list[RunRow]) -> list[Row]:
    """The summary row of each name."""
    return [_summary(group) for group in rows_by_name(rows)]


def _summary(group: Sequence[RunRow]) -> Row:
    """All rows of a name, which are of one kind."""
    if second := [row for row in group if isinstance(row, SecondRun)]:
        return _second_summary(second)
    return _drawn_summary([row for row in group if isinstance(row, DrawnRun)])


def _drawn_summary(group: Sequence[DrawnRun]) -> Row:
    def mean(key: str) -> float:
        return float(np.mean([value for row in group if (value := getattr(row, key)) is not UNSET]))

    return {
        "name": group[0].name, "runs": len(group), "rmse_m": mean("rmse_m"), "shape_m": mean("shape_m"),
        "foot_rmse_m": mean("foot_rmse_m"), "footslam_rmse_m": mean("footslam_rmse_m"), "wall_median_m": mean("wall_median_m"),
        "wall95_m": mean("wall95_m"), "map_s": mean("map_s"), "worst_rmse_m": max(row.rmse_m for row in group),
        "drawn_pc": 100.0 * mean("drawn"), "absent_pc": 100.0 * mean("absent"), "wrong_storey_pc": 100.0 * mean("wrong_storey"),
        "closures": sum(row.closures for row in group), "wrong": sum(row.wrong for row in group),
    }  # fmt: skip


def _second_summary(group: Sequence[SecondRun]) -> Row:
    means = [row.mean_m for row in group]
    lost = sum(row.end_m > LOST_END_M for row in group)
    shares = {
        f"{key}_pc": 100.0 * float(np.mean([getattr(row, key) for row in group]))
        for key in ("tracking", "false_tracking", "beyond")
    }
    return {
        "name": group[0].name, "runs": len(group), "mean_m": float(np.mean(means)), "worst_m": max(means), "lost": lost,
        "refused": sum(row.refused for row in group), **shares,
    }  # fmt: skip


def tables(rows: list[Row], request: StudyRequest) -> list[Table]:
    """A table for each kind of row."""
    first = as_dicts(row for row in rows if "rmse_m" in row)
    second = as_dicts(row for row in rows if "tracking_pc" in row)
    title = f"Drawn without a plan: {request.runs} simulated walks a row"
    every = [
        Table(title, first, COLUMNS),
        Table("Another person, tracked on the drawing", second, SECOND_COLUMNS),
    ]
    return [table for table in every if table.rows]
