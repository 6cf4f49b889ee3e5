# SPDX-License-Identifier: MIT
"""The frame of every study: runs -> rows -> summary rows -> tables -> JSON -> Parquet -> pictures.

In: a `Study` and a `StudyRequest`. Out: tables on the terminal, files. Owns the order of these stages.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Generic, Literal, TypeVar

from echostep_app.output.table import Table
from echostep_studies.frame.report import as_dicts, write_json, write_parquet
from echostep_studies.frame.runs import SeededRuns

RunRow = TypeVar("RunRow")
SummaryRow = TypeVar("SummaryRow")


@dataclass(frozen=True, slots=True)
class StudyRequest:
    """Options of a command: `runs` from `seed` on, the file for `json`, the folder `out` for the journal, Parquet and pictures.

    `scheduler`: address of a Dask scheduler; None: the cores of this machine.
    """

    runs: int
    seed: int
    json: Path | None
    out: Path
    scheduler: str | None = None


@dataclass(frozen=True, slots=True)
class Study(Generic[RunRow, SummaryRow]):
    """What one study states.

    `kinds`: the dataclasses of the rows of runs, as which the journal reads them.
    `run`: rows of the run of one seed, importable and picklable. `summarize`: rows of all runs -> summary rows, which JSON gets.
    `tables`: summary rows -> tables. `draw`: pictures from the folder, the first seed and the summary rows. `draw_runs`: from the folder and the
    rows of all runs.
    `runs`: how many the tables and the JSON file state, where a study counts them itself; None: those of the request.
    `seeds`: arguments of `run`; None: `request.seed` + 0 ... `request.runs` - 1. `parquet`: which rows the Parquet file holds; None: a short study
    of one run, which is done in this process, without journal and Parquet file.
    """

    name: str
    kinds: tuple[type[RunRow], ...]
    run: Callable[[int], Iterable[RunRow]]
    summarize: Callable[[list[RunRow]], list[SummaryRow]]
    tables: Callable[[list[SummaryRow], StudyRequest], Sequence[Table]]
    draw: Callable[[Path, int, list[SummaryRow]], None] | None = None
    draw_runs: Callable[[Path, list[RunRow]], None] | None = None
    runs: int | None = None
    seeds: range | None = None
    parquet: Literal["runs", "summary"] | None = "runs"


def run_study(study: Study[RunRow, SummaryRow], request: StudyRequest) -> list[SummaryRow]:
    """Run the study, print its tables and write its files; returns the summary rows. Raises EchostepError when a file cannot be written."""
    if study.runs is not None:
        request = replace(request, runs=study.runs)
    rows_of_runs = _rows(study, request)
    rows = study.summarize(rows_of_runs)
    for table in study.tables(rows, request):
        table.print()
    if request.json is not None:
        write_json(request.json, study.name, request.runs, request.seed, as_dicts(rows))
    if study.parquet is not None:
        written = as_dicts(rows_of_runs if study.parquet == "runs" else rows)
        write_parquet(request.out / f"{study.name}.parquet", written)
    if study.draw is not None:
        study.draw(request.out, request.seed, rows)
    if study.draw_runs is not None:
        study.draw_runs(request.out, rows_of_runs)
    return rows


def _rows(study: Study[RunRow, SummaryRow], request: StudyRequest) -> list[RunRow]:
    """Rows of all runs in order of their seeds."""
    seeds = study.seeds if study.seeds is not None else range(request.seed, request.seed + request.runs)
    if study.parquet is None:
        return [row for seed in seeds for row in study.run(seed)]
    return SeededRuns(
        study.name, len(seeds), seeds.start, study.run, request.out, study.kinds, request.scheduler
    ).rows()
