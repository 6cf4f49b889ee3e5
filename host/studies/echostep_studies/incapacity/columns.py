# SPDX-License-Identifier: MIT
"""The columns of the study: rows of runs -> one summary row for each name -> tables. Those of falls are in `falls`.

In: rows of runs. Out: summary rows, tables. Owns the names of the columns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from echostep_app.output.table import Table
from echostep_studies.frame.report import Row, Summaries, by_kind, named
from echostep_studies.frame.study import StudyRequest
from echostep_studies.incapacity import falls

TOLD_S = 35.0  # limit of the alarm's delay for an incapacitated wearer


@dataclass(frozen=True, slots=True, kw_only=True)
class LyingRun:
    """An incapacitated wearer: delay of the alarm, and whether it was at most TOLD_S."""

    name: str
    seed: int
    told_s: float
    told: float


@dataclass(frozen=True, slots=True, kw_only=True)
class DayRun:
    """A working day, or a recording: how often the wearer was asked, and others were called."""

    name: str
    seed: int
    hours: float
    asked: int
    maydays: int


RunRow = LyingRun | DayRun | falls.FallRun | falls.NoFallRun


def _lying_summary(group: Sequence[LyingRun]) -> Row:
    told_s = [row.told_s for row in group]
    in_time, median_s = sum(row.told for row in group), float(np.median(told_s))
    return named(group) | {"told": in_time, "median_s": median_s, "longest_s": max(told_s)}


def _day_summary(group: Sequence[DayRun]) -> Row:
    hours, maydays = sum(row.hours for row in group), sum(row.maydays for row in group)
    asked = sum(row.asked for row in group)
    return named(group) | {"hours": hours, "asked": asked, "maydays": maydays, "per_8h": 8.0 * maydays / hours}


SUMMARIES: Summaries = {LyingRun: _lying_summary, DayRun: _day_summary, **falls.SUMMARIES}
ORDER = (*falls.KITS, "recorded")  # of the rows of falls, which come last


def summarize(rows: Sequence[RunRow]) -> list[Row]:
    """One row for each name."""
    first = {name: k for k, name in enumerate(ORDER)}
    return sorted(by_kind(SUMMARIES)(rows), key=lambda row: first.get(row["name"].split(":")[0], -1))


def tables(rows: Sequence[Row], _: StudyRequest) -> list[Table]:
    """Tables of incapacitated wearers, of false alarms, and of falls."""
    in_time = f"told within {TOLD_S:.0f} s"
    lying = {"name": "", "runs": "wearers", "told": in_time, "median_s": "median s", "longest_s": "longest s"}
    days = {
        "name": "",
        "runs": "runs",
        "hours": "hours",
        "asked": "asked",
        "maydays": "maydays",
        "per_8h": "in 8 hours",
    }
    return [
        Table(
            "Wearers who cannot move (simulated)", [row for row in rows if "told" in row and "early" not in row], lying
        ),
        Table("Wearers who can (days simulated, recordings real)", [row for row in rows if "per_8h" in row], days),
        *falls.tables(rows),
    ]
