# SPDX-License-Identifier: MIT
"""`echostep evaluate importers`: each drawing, model and map of a folder, as `echostep plan import` reads it without options.

In: a folder. Out: rows `{file, outcome, seconds, levels, long_m, wide_m, walls, doors, in_gaps, rooms, enclosed, left_out, says}`, JSON, a table.
Owns nothing.
Whether a plan is right is for people to see; what is counted here shows where it cannot be: doors in no gap, rooms that are not enclosed, a refusal.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from echostep.errors import EchostepError
from echostep.plan import Plan
from echostep_app.output.table import Table
from echostep_app.plan.importers.formats import is_foreign
from echostep_app.plan.importers.limited import import_reported
from echostep_app.plan.importers.report import ImportReport
from echostep_app.plan.importers.summary import doors_in_gaps, size_m
from echostep_app.plan.places.faces import OUTSIDE
from echostep_app.plan.places.spaces import find_spaces
from echostep_studies.frame.report import as_dict
from echostep_studies.frame.study import Study, StudyRequest

# A folder with one of them is one building
WHOLE = ("level.geojson", "level.json", "manifest.json")
COLUMNS = {
    "file": "file", "outcome": "outcome", "seconds": "s", "levels": "levels", "size": "m", "walls": "walls", "doors": "doors", "in_gaps": "in gaps",
    "rooms": "rooms", "enclosed": "enclosed", "left_out": "left out", "says": "first note or refusal",
}  # fmt: skip
SAYS = 150  # characters of a note in the table
DIGITS = 3


@dataclass(frozen=True, slots=True)
class ImportRow:
    """One file. `outcome`: imported, imported with notes, refused. `enclosed`: share of rooms that walls and doors enclose, None without rooms."""

    file: str
    outcome: str
    seconds: float
    levels: int = 0
    long_m: float = 0.0
    wide_m: float = 0.0
    walls: int = 0
    doors: int = 0
    in_gaps: int = 0
    rooms: int = 0
    enclosed: float | None = None
    left_out: int = 0
    says: str = ""


def importers_study(folder: Path) -> Study[ImportRow, ImportRow]:
    """The study of the files in a folder and below; raises EchostepError when there are none."""
    files = list(buildings_in(folder))
    if not files:
        raise EchostepError(
            f"{folder}: no drawings, models or maps in it: give a folder of DXF, IFC, IMDF, OpenStreetMap or ROS files"
        )
    return Study(
        "importers",
        (ImportRow,),
        lambda _seed: [row_of(file, folder) for file in files],
        lambda rows: rows,
        _tables,
        runs=len(files),
        seeds=range(1),
        parquet=None,
    )


def buildings_in(folder: Path) -> Iterator[Path]:
    """Files that can be imported, and folders that are one building, in order of their names."""
    if any((folder / name).is_file() for name in WHOLE):
        yield folder
        return
    try:
        inner = sorted(folder.iterdir())
    except OSError as error:
        raise EchostepError(f"{folder}: cannot be read: {error.strerror or error}") from error
    for path in inner:
        if path.is_dir():
            yield from buildings_in(path)
        elif is_foreign(path):
            yield path


def row_of(file: Path, folder: Path) -> ImportRow:
    """Import one file and count what came in."""
    name = str(file.relative_to(folder)) if file != folder else file.name
    begin = time.perf_counter()
    try:
        plan, report = import_reported(file)
    except EchostepError as error:
        return ImportRow(
            name, "refused", round(time.perf_counter() - begin, DIGITS), says=str(error).removeprefix(f"{file}: ")
        )
    return _counted(name, round(time.perf_counter() - begin, DIGITS), plan, report)


def _counted(name: str, seconds: float, plan: Plan, report: ImportReport) -> ImportRow:
    sizes = np.array([size_m(level) for level in plan.levels])
    return ImportRow(
        name,
        "imported with notes" if report.doubts else "imported",
        seconds,
        len(plan.levels),
        round(float(sizes.max(axis=1).max()), DIGITS),
        round(float(sizes.min(axis=1).max()), DIGITS),
        sum(len(level.walls) for level in plan.levels),
        sum(len(level.doors) for level in plan.levels),
        sum(doors_in_gaps(level) for level in plan.levels),
        sum(len(level.rooms) for level in plan.levels),
        _enclosed(plan),
        sum(report.left_out.values()),
        next(iter(report.doubts), ""),
    )


def _enclosed(plan: Plan) -> float | None:
    """Share of the rooms whose place lies in an enclosed space, doors and gaps being closed; None without rooms, or on levels with too many walls."""
    homes: list[bool] = []
    for i, level in enumerate(plan.levels):
        spaces = find_spaces(plan, i) if level.rooms else None
        if spaces is not None:
            homes += [spaces.face_at(*room.at_m) != OUTSIDE for room in level.rooms]
    return round(float(np.mean(homes)), DIGITS) if homes else None


def _tables(rows: list[ImportRow], _request: StudyRequest) -> list[Table]:
    doors, in_gaps = sum(row.doors for row in rows), sum(row.in_gaps for row in rows)
    outcomes = ", ".join(f"{count} {outcome}" for outcome, count in Counter(row.outcome for row in rows).items())
    notes = [
        outcomes,
        f"{in_gaps} of {doors} doors in a gap of a wall" + (f" ({in_gaps / doors:.1%})" if doors else ""),
    ]
    printed = [
        as_dict(row)
        | {
            "seconds": f"{row.seconds:.1f}",
            "size": f"{row.long_m:.4g} x {row.wide_m:.4g}" if row.levels else "",
            "enclosed": "" if row.enclosed is None else f"{row.enclosed:.0%}",
            "says": row.says[:SAYS],
        }
        for row in rows
    ]
    return [Table("Plans imported without options", printed, COLUMNS, notes)]
