# SPDX-License-Identifier: MIT
"""The study of operations: scores of all points, by manner of moving, before and after the change of the battery.

In: seeds. Out: a row of all points, and one of each part. Simulated. The scores are those of `echostep score`, over the points of all runs together.

`floor`: share of the points on the nearest floor; `floor_tied`: the same, where both floors are right within TIE_M of the middle between them, as in
`bench.judgement.true_levels`. Estimates that say lost count in both, but not in the row `not lost`, of the points that availability
counts too. `search_s`: from the change of the battery on, until the new tracker says `tracking`. The rows `resumed` have the estimates of the tracker
that begins where the first one ended, the others those of a tracker without a start.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from echostep.arrays import Bools, Floats
from echostep.localization import Estimate, TrackStatus
from echostep.plan import Plan
from echostep_app.output.table import Table
from echostep_app.scorecard.card import FLOOR_PENALTY_M, match, score
from echostep_app.scorecard.error_statistics import error_statistics, quantile
from echostep_app.scorecard.track_columns import ScoredPath, track_of
from echostep_studies.bench.judgement import true_levels
from echostep_studies.frame.report import Row, as_dict, by_name, named
from echostep_studies.frame.study import Study, StudyRequest
from echostep_studies.operation.walks import HALF_M, OperationWalk, operation


def truth_of(truth: Floats, plan: Plan) -> ScoredPath:
    """A simulated truth (n, 5), t_s, x, y, heading, height of the floor, as a true path: the nearest level is the true one."""
    heights = np.array([level.height_m for level in plan.levels])
    level = np.abs(truth[:, 4:5] - heights).argmin(1).astype(float)
    return ScoredPath(
        Path("truth"), truth[:, 0], truth[:, 1:3], np.zeros(len(truth), bool), {}, height_m=truth[:, 4], level=level
    )


ASKED_CE95_M, ASKED_FLOOR = 0.5, 0.995  # what an operation asks for, assumed: a door; hardly ever another floor
ALL, RESUMED = "all", "all, resumed"  # the rows of all points
Parts = Callable[[OperationWalk, Floats, Any], dict[str, Bools]]
COLUMNS = {
    "name": "", "points": "points", "ce50_m": "CE50 m", "ce95_m": "CE95 m", "se95_m": "SE95 m", "max_m": "max m",
    "evaal_m": "EvAAL m", "floor": "floor %", "floor_tied": "both at a tie %",
}  # fmt: skip
PERCENT = ("floor", "floor_tied")


@dataclass(frozen=True, slots=True, kw_only=True)
class PartRun:
    """The points of one part of an operation."""

    name: str
    seed: int
    error_m: list[float]
    above_m: list[float]
    floors_off: list[float]
    tied_right: list[bool]


@dataclass(frozen=True, slots=True, kw_only=True)
class WholeRun(PartRun):
    """All points of an operation, with what the scorecard says of the whole."""

    zone: float | None
    available: float | None
    search_s: float | None


def one_run(half_m: float, seed: int) -> list[PartRun]:
    """Rows of one operation: its points, all of them and by part."""
    walk = operation(seed, half_m)
    return _rows(walk, walk.after, seed, _parts) + _rows(walk, walk.resumed, seed, _resumed_parts)


def _rows(walk: OperationWalk, after: Sequence[Estimate], seed: int, parts: Parts) -> list[PartRun]:
    """Rows of the parts of one operation, with the estimates of one of the trackers after the change of the battery."""
    estimates = [*walk.before, *after]
    track, truth = track_of(estimates), truth_of(walk.truth, walk.plan)
    card, at = score(track, truth, walk.plan), match(track, truth)
    assert at.level is not None
    assert at.true_level is not None
    assert at.height_m is not None
    assert at.true_height_m is not None
    right = true_levels(at.true_xy_m, at.true_height_m, walk.plan)
    above_m, floors_off = at.height_m - at.true_height_m, np.abs(at.level - at.true_level)
    tied_right = right[np.arange(len(at.level)), at.level.astype(np.int64)]
    tracking_s = [e.t_s for e in after if e.status is TrackStatus.TRACKING]
    rows = []
    says = np.array([e.status.value for e in estimates])[at.row]
    for name, chosen in parts(walk, at.t_s, says).items():
        row = PartRun(
            name=name, seed=seed, error_m=at.error_m[chosen].tolist(), above_m=above_m[chosen].tolist(),
            floors_off=floors_off[chosen].tolist(), tied_right=tied_right[chosen].tolist(),
        )  # fmt: skip
        if name in (ALL, RESUMED):
            row = WholeRun(
                **as_dict(row), zone=card.zone_probability, available=card.availability,
                search_s=tracking_s[0] - walk.restart_s if tracking_s else None,
            )  # fmt: skip
        rows.append(row)
    return rows


def _parts(walk: OperationWalk, t_s: Floats, says: Any) -> dict[str, Bools]:
    """Which points belong to each part, by name; those of a manner are of before the change of the battery."""
    begins, names = zip(*walk.manners, strict=True)
    manner = np.array(names)[np.maximum(np.searchsorted(np.array(begins), t_s, side="right") - 1, 0)]
    known = t_s < walk.restart_s
    parts = {
        ALL: np.ones(len(t_s), bool), "not lost": says != TrackStatus.LOST.value,
        "says tracking": says == TrackStatus.TRACKING.value, "known start": known, "unknown start": ~known,
    }  # fmt: skip
    return parts | {name: (manner == name) & known for name in sorted(set(names))}


def _resumed_parts(walk: OperationWalk, t_s: Floats, says: Any) -> dict[str, Bools]:
    """The same where the new tracker begins at the last place."""
    return {
        RESUMED: np.ones(len(t_s), bool), "not lost, resumed": says != TrackStatus.LOST.value,
        "says tracking, resumed": says == TrackStatus.TRACKING.value, "resumed": t_s >= walk.restart_s,
    }  # fmt: skip


def _summary(rows: Sequence[PartRun]) -> Row:
    """Scores of the points of all runs together."""
    error, above, off, right = (
        np.concatenate([np.asarray(getattr(row, key)) for row in rows])
        for key in ("error_m", "above_m", "floors_off", "tied_right")
    )
    summary: Row = named(rows) | {"points": len(error)}
    if not len(error):
        return summary
    statistics = error_statistics(error)
    whole = [row for row in rows if isinstance(row, WholeRun)]
    scores = {
        "mean_m": statistics.mean_m, "ce50_m": statistics.median_m, "ce95_m": statistics.p95_m,
        "max_m": statistics.max_m, "ve95_m": quantile(np.abs(above), 0.95), "se95_m": quantile(np.hypot(error, above), 0.95),
        "evaal_m": quantile(error + FLOOR_PENALTY_M * off, 0.75), "floor": float((off == 0.0).mean()),
        "floor_tied": float(right.mean()), "zone": _over(np.mean, (row.zone for row in whole)),
        "available": _over(np.mean, (row.available for row in whole)), "search_s": _over(np.max, (row.search_s for row in whole)),
    }  # fmt: skip
    return summary | {key: None if value is None else round(value, 4) for key, value in scores.items()}


def _over(how: Callable[[list[float]], Any], values: Iterable[float | None]) -> float | None:
    """A mean, or the greatest, of the values that there are."""
    stated = [value for value in values if value is not None]
    return float(how(stated)) if stated else None


def _tables(rows: list[Row], request: StudyRequest) -> list[Table]:
    shown = [{key: 100.0 * value if key in PERCENT else value for key, value in row.items()} for row in rows]
    remarks = [_told(row) for row in rows if row["name"] in (ALL, RESUMED) and row["points"]]
    return [Table(f"Operations of twenty minutes on three storeys, {request.runs} simulated", shown, COLUMNS, remarks)]


def _told(row: Row) -> str:
    """What was asked for and is met, of a row of all points."""
    return (
        f"{row['name']}: asked were CE95 at most {ASKED_CE95_M} m: {_met(row['ce95_m'] <= ASKED_CE95_M)}; "
        f"floor at least {100 * ASKED_FLOOR:g} %: {_met(row['floor'] >= ASKED_FLOOR)} by the nearest floor, "
        f"{_met(row['floor_tied'] >= ASKED_FLOOR)} with both at a tie. Zone detection {100 * row['zone']:.1f} %, "
        f"availability {100 * row['available']:.1f} %, search after the change at most {row['search_s'] or math.inf:.0f} s. Simulated."
    )


def _met(is_met: bool) -> str:
    return "met" if is_met else "not met"


def operation_study(half_m: float = HALF_M) -> Study[PartRun, Row]:
    """The study; `half_m`: length of the way before the change of the battery, and after it."""
    return Study(
        "operation",
        (PartRun, WholeRun),
        partial(one_run, half_m),
        by_name(_summary),
        _tables,
    )
