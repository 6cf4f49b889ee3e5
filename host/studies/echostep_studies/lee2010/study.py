# SPDX-License-Identifier: MIT
"""The three experiments of [Lee 2010] in simulation: a lap of 40 x 30 m, the way down from the 5th floor to the 1st, the 3D track;
the method of the paper and the default one.

In: seeds. Out: rows `lap/lee2010`, `lap/default`, `lap/default+plan`, `floors`, `storeys`, `storeys/default`. Owns nothing.
Everything is simulated, from the bytes of the simulated board on: frames, clock and counts are read as live. Each run is another person in another
magnetic field. All methods are given the place and the heading of the start, and the wearer's legs to within a centimetre; with the plan the wearer
is calibrated by a walk of 10 m before.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from msgspec import UNSET, UnsetType

from echostep.arrays import Floats
from echostep_app.output.table import Table
from echostep_simulation.people.walker import Walk
from echostep_studies.frame.report import Row, as_dicts, rows_by_name
from echostep_studies.frame.study import Study, StudyRequest
from echostep_studies.lee2010.methods import METHODS, MethodTrack, floors_of, with_plan
from echostep_studies.lee2010.walks import STOREY_M, chunks_of, descent_of, lap_of, lap_plan, measure, start_of, storeys

PRINTED: tuple[dict[str, Any], ...] = ({"name": "lap, the paper", "ending_m": 8.0},)
COLUMNS = {
    "name": "", "ending_m": "ending", "ending_max_m": "worst", "mean_m": "mean", "distance_error_percent": "way %", "floor_right": "floor right",
}  # fmt: skip
LEGEND = "ending, mean: error of the place at the end and on the way; way: error of the distance walked. Simulated."


@dataclass(frozen=True, slots=True, kw_only=True)
class PersonRun:
    """One method with one person: errors at the end and on the way; the row `floors` has no distance, those of the lap no floors."""

    name: str
    profile: str
    seed: int
    ending_m: float
    mean_m: float
    distance_error_percent: float | UnsetType = UNSET
    floor_right: float | UnsetType = UNSET


def one_run(seed: int) -> list[PersonRun]:
    """All rows of one person."""
    lap, plan = lap_of(seed), lap_plan()
    chunks = chunks_of(lap, plan.levels, seed)
    measured = measure(chunks, seed)
    rows = [_row(f"lap/{name}", name, seed, lap, method(measured, start_of(lap))) for name, method in METHODS.items()]
    rows.append(_row("lap/default+plan", "default", seed, lap, with_plan(plan, chunks, measured, start_of(lap), seed)))
    descent = descent_of(seed)
    measured = measure(chunks_of(descent, storeys(), seed), seed)
    floors = floors_of(measured.pressure)
    right = floor_right(floors, descent)
    for name, method in METHODS.items():
        shown = "storeys" if name == "lee2010" else f"storeys/{name}"
        row = _row(shown, name, seed, descent, method(measured, start_of(descent)))
        rows.append(replace(row, floor_right=right))
    off = _heights_off_m(floors, descent)
    rows.append(
        PersonRun(
            name="floors",
            profile="lee2010",
            seed=seed,
            ending_m=float(off[-1]),
            mean_m=float(off.mean()),
            floor_right=right,
        )
    )
    return rows


def _row(name: str, profile: str, seed: int, walked: Walk, method: MethodTrack) -> PersonRun:
    truth = np.column_stack([np.interp(method.track[:, 0], walked.t_s, walked.trunk_m[:, k]) for k in (0, 1)])
    off = np.hypot(*(method.track[:, 1:] - truth).T)
    way = float(np.hypot(*np.diff(walked.foot_m[::50, :2], axis=0).T).sum())
    return PersonRun(
        name=name, profile=profile, seed=seed, ending_m=float(off[-1]), mean_m=float(off.mean()),
        distance_error_percent=100.0 * (method.distance_m / way - 1.0),
    )  # fmt: skip


def floor_right(floors: Floats, walked: Walk) -> float:
    """Share of the readings with the floor that is nearest in truth."""
    return float((floors[:, 1] == np.rint(_height_at(floors[:, 0], walked) / STOREY_M)).mean())


def _heights_off_m(floors: Floats, walked: Walk) -> Floats:
    """Errors of the height that is put out, which is the floor's own, on the way."""
    off: Floats = np.abs(floors[:, 1] * STOREY_M - _height_at(floors[:, 0], walked))
    return off


def _height_at(t_s: Floats, walked: Walk) -> Floats:
    return np.interp(t_s, walked.t_s, walked.height_m)


def _summary(rows: list[PersonRun]) -> Row:
    endings = [row.ending_m for row in rows]
    return {
        "name": rows[0].name, "profile": rows[0].profile, "runs": len(rows), "ending_m": round(sum(endings) / len(rows), 4),
        "mean_m": round(sum(row.mean_m for row in rows) / len(rows), 4),
        "distance_error_percent": _mean(row.distance_error_percent for row in rows),
        "floor_right": _mean(row.floor_right for row in rows), "ending_max_m": round(max(endings), 4),
    }  # fmt: skip


def _mean(values: Iterable[float | UnsetType]) -> float | UnsetType:
    """The mean of a column that some rows lack."""
    stated = [value for value in values if value is not UNSET]
    return round(sum(stated) / len(stated), 4) if stated else UNSET


def _tables(rows: list[Row], request: StudyRequest) -> list[Table]:
    title = f"Lee and Lee 2010: {request.runs} simulated runs, metres; last, the paper's one real lap"
    return [Table(title, [*as_dicts(rows), *PRINTED], COLUMNS, (LEGEND,))]


STUDY = Study("lee2010", (PersonRun,), one_run, lambda rows: [_summary(group) for group in rows_by_name(rows)], _tables)
