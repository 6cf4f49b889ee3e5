# SPDX-License-Identifier: MIT
"""The study `clutter`: each log is tracked from its true start and found from unknown ones, on both of its plans.

In: a folder of CARMEN logs. Out: the table, JSON, Parquet, a picture of each plan, Stanford diagrams. Owns the order of the runs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.collections import LineCollection

from echostep.localization import Start
from echostep_app.output.table import Table
from echostep_studies.bench.columns import JudgedRow, run_row, summaries, tables
from echostep_studies.bench.filtering import FilterRun, track
from echostep_studies.bench.judgement import JudgedRun, TruePlaces, judge
from echostep_studies.bench.laser.building import LogBuilding, LogWalk, building_of, walk_from
from echostep_studies.bench.laser.carmen_log import logs_in, read_log
from echostep_studies.bench.laser.odometry import calibrated
from echostep_studies.bench.stanford import draw_stanford
from echostep_studies.frame.pictures import BLACK, BLUE, axes_of, save
from echostep_studies.frame.report import Row, as_dict
from echostep_studies.frame.study import Study, StudyRequest


def draw_plans(folder: Path, building: LogBuilding) -> None:
    """Both plans side by side, and the way of the scans."""
    figure, axes = axes_of(1, len(building.plans), (8.0 * len(building.plans), 8.0))
    for ax, (name, plan) in zip(axes[0], building.plans.items(), strict=True):
        walls = plan.levels[0].walls
        ax.add_collection(LineCollection(list(walls.reshape(-1, 2, 2)), colors=BLACK, linewidths=1.0, label="walls"))
        ax.plot(*building.log.pose[:, :2].T, color=BLUE, lw=0.6, label="way of the scans")
        ax.set(aspect="equal", xlabel="x / m", ylabel="y / m")
        ax.legend(loc="upper right", fontsize=8)
        ax.set_title(f"{building.log.name}/{name}: {len(walls)} segments; {building.odometry.source}", fontsize=10)
    save(figure, folder / f"{building.log.name}.png")


UNKNOWN_M = 60.0  # length of the walks from unknown starts
NOTES = (
    "The buildings, their clutter and the odometry are real, the hearing is simulated: a ping pair at every other scan. Time is made up: 1 m/s.",
    "The turn that unequal wheels add on each metre is taken out of the odometry first, as by a calibration against the corrected poses.",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class LogRow(JudgedRow):
    """A run on one plan of a log; `source`: where the path is from."""

    source: str


def clutter_run(logs: tuple[Path, ...], starts: int, first_seed: int, number: int) -> list[LogRow]:
    """Run `number` on both plans of its log: the first run of a log is from its true start, each of the others from one of `starts` unknown ones."""
    log, start = divmod(number - first_seed, starts + 1)
    building = building_of(logs[log], first_seed)
    building = replace(building, odometry=calibrated(building.odometry, building.log))
    if start == 0:
        walk = walk_from(building, 0)
        return [_row(building, name, "tracked", walk, Start(walk.start), number) for name in building.plans]
    walk = walk_from(building, _unknown_scan(building, number), UNKNOWN_M)
    return [_row(building, name, "unknown", walk, Start(), number) for name in building.plans]


def _unknown_scan(building: LogBuilding, number: int) -> int:
    """A random scan from which the log goes on for UNKNOWN_M; the first one where the log is shorter."""
    steps = np.hypot(*np.diff(building.log.pose[:, :2], axis=0).T)
    left_m = np.concatenate([np.cumsum(steps[::-1])[::-1], [0.0]])
    return int(np.random.default_rng([number, 62]).integers(max(int((left_m >= UNKNOWN_M).sum()), 1)))


def _row(building: LogBuilding, plan: str, what: str, walk: LogWalk, start: Start, seed: int) -> LogRow:
    run = track(walk.segments, building.plans[plan], start, seed)
    at_scans = FilterRun(tuple(run.claims[k] for k in walk.at_scan), run.most_particles, run.cpu_s)
    row = run_row(f"{building.log.name}/{plan}/{what}", seed, _judged(walk, at_scans), at_scans)
    return LogRow(**as_dict(row), source=building.odometry.source)


def _judged(walk: LogWalk, run: FilterRun) -> JudgedRun:
    truth = TruePlaces(walk.true[:, :2], np.ones((len(run.claims), 1), np.bool_))
    return judge(run.claims, truth, walk.walked_m, UNKNOWN_M)


def _summaries(rows: list[LogRow]) -> list[Row]:
    source = {row.name: row.source for row in rows}
    return [{**row, "source": source[row["name"]]} for row in summaries(rows)]


def _tables(rows: list[Row], _request: StudyRequest) -> list[Table]:
    sources = {row["name"].split("/")[0]: row["source"] for row in rows}
    paths = "Path by: " + "; ".join(f"{name}: {source}" for name, source in sources.items()) + "."
    return tables("Real clutter: pings from laser scans of real buildings", rows, UNKNOWN_M, (*NOTES, paths))


def _draw(logs: tuple[Path, ...], seed: int, folder: Path, rows: Sequence[LogRow]) -> None:
    draw_stanford(folder, rows)
    for path in logs:
        draw_plans(folder, building_of(path, seed))


def clutter_study(data: Path, starts: int, seed: int) -> Study[LogRow, Row]:
    """The study of all logs of a folder, `starts` unknown starts each; raises EchostepError that names log and line."""
    logs = tuple(logs_in(data))
    for path in logs:
        read_log(path)
    runs = range(seed, seed + len(logs) * (starts + 1))
    return Study(
        "clutter",
        (LogRow,),
        partial(clutter_run, logs, starts, seed),
        _summaries,
        _tables,
        runs=len(runs),
        seeds=runs,
        draw_runs=partial(_draw, logs, seed),
    )
