# SPDX-License-Identifier: MIT
"""A study of several parts, whose rows are chosen by name.

In: parts, a pattern of names. Out: a `Study` of the rows that match. Owns how a pattern chooses.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from fnmatch import fnmatch
from functools import partial
from typing import Any

from echostep.errors import EchostepError
from echostep_app.output.table import Table
from echostep_studies.frame.report import Row, Summaries, by_kind
from echostep_studies.frame.study import Study, StudyRequest

Run = Callable[[tuple[str, ...], int], Iterable[Any]]


@dataclass(frozen=True, slots=True)
class Part:
    """Rows of one kind of experiment.

    `names`: of its rows, as --rows takes them. `run`: some of these names and a seed -> rows, importable and picklable. `tables`: the summary
    rows of the study, not of this part alone -> tables.
    """

    names: Sequence[str]
    run: Run
    summaries: Summaries
    tables: Callable[[list[Row], StudyRequest], Sequence[Table]]


def matching(names: Iterable[str], pattern: str) -> tuple[str, ...]:
    """The names that match the pattern of --rows; raises EchostepError without any."""
    every = list(names)
    chosen = tuple(name for name in every if fnmatch(name, pattern))
    if not chosen:
        raise EchostepError(f"--rows {pattern}: no row is named so; there are: {', '.join(every)}")
    return chosen


def study_of(name: str, parts: Sequence[Part], pattern: str) -> Study[Any, Row]:
    """The study of the rows of all parts whose names match a pattern; raises EchostepError without any."""
    chosen = matching((name for part in parts for name in part.names), pattern)
    runs = [(part.run, tuple(name for name in part.names if name in chosen)) for part in parts]
    summaries = {kind: summary for part in parts for kind, summary in part.summaries.items()}
    return Study(
        name,
        tuple(summaries),
        partial(_run_parts, tuple(run for run in runs if run[1])),
        by_kind(summaries),
        lambda rows, request: [table for part in parts for table in part.tables(rows, request) if table.rows],
    )


def _run_parts(runs: Sequence[tuple[Run, tuple[str, ...]]], seed: int) -> list[Any]:
    """The rows of all parts for one seed."""
    return [row for run, names in runs for row in run(names, seed)]
