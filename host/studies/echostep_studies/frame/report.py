# SPDX-License-Identifier: MIT
"""Output of a study: rows as dictionaries, JSON and Parquet files.

In: rows, which are dataclasses: their fields are the columns, in this order; a field that is UNSET is a column that the row lacks. Out: files.
Owns the conversion of rows to dictionaries.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from statistics import fmean
from typing import Any, Protocol, TypeVar

from msgspec import UNSET

from echostep.file_mode import keep_earlier
from echostep_app.printing.lines import as_error
from echostep_app.scorecard.error_statistics import error_statistics

Row = dict[str, Any]  # the columns of a row by name: every summary row is one

Summaries = Mapping[type, Callable[[list[Any]], Row]]  # of rows of one name, by their dataclass

LOST_END_M = 3.0  # error at the end of a run above which the run counts as lost: a definition


class Named(Protocol):
    """A row with a name."""

    @property
    def name(self) -> str: ...


NamedRow = TypeVar("NamedRow", bound=Named)


def as_dict(row: Any) -> Row:
    """The columns that a row has; a summary row is a dictionary already."""
    values = row.items() if isinstance(row, dict) else ((field.name, getattr(row, field.name)) for field in fields(row))
    return {key: value for key, value in values if value is not UNSET}


def as_dicts(rows: Iterable[Any]) -> list[Row]:
    """The columns of each row."""
    return [as_dict(row) for row in rows]


def rows_by_name(rows: Iterable[NamedRow]) -> list[list[NamedRow]]:
    """The rows of all runs grouped by their `name`, names in the order of their first row."""
    groups: dict[str, list[NamedRow]] = {}
    for row in rows:
        groups.setdefault(row.name, []).append(row)
    return list(groups.values())


def by_name(summarize: Callable[[list[NamedRow]], Row]) -> Callable[[Iterable[NamedRow]], list[Row]]:
    """What makes the summary row of each name from the rows of all runs; `summarize`: the rows of one name -> its summary row."""
    return lambda rows: [summarize(group) for group in rows_by_name(rows)]


def by_kind(summaries: Summaries) -> Callable[[Iterable[Any]], list[Row]]:
    """The same where the rows of different names are of different dataclasses, each with its own function."""
    return by_name(lambda group: summaries[type(group[0])](group))


def named(rows: Sequence[Named]) -> Row:
    """Name and number of rows of one name: the first columns of their summary row."""
    return {"name": rows[0].name, "runs": len(rows)}


def means(rows: Sequence[Any], keys: Iterable[str], digits: int | None = None) -> Row:
    """The mean of each of these columns over the rows that have it, rounded to so many digits; without a column that no row has."""
    columns = {key: [value for row in rows if (value := getattr(row, key)) is not UNSET] for key in keys}
    return {
        key: fmean(values) if digits is None else round(fmean(values), digits)
        for key, values in columns.items()
        if values
    }


def summary(name: str, profile: str, errors_m: Sequence[Sequence[float]], inside95: Sequence[Sequence[bool]]) -> Row:
    """The summary row of the errors at the steps of each run, (runs, steps), in the form of [Girard 2011, Table 1].

    `mean_m`, `sd_m`, `max_m`, `min_m`, `ending_m` are computed for each run, then averaged over the runs; `worst_m` is the greatest error of all,
    `ce50_m` and `ce95_m` are percentiles of all errors [ISO/IEC 18305:2016, 8.9]. `coverage95`: share of all steps with the truth inside the
    95 % ellipse, None without `inside95`. `lost`: runs that end more than `LOST_END_M` off.
    """
    each = [error_statistics(errors) for errors in errors_m]
    whole = error_statistics([error for errors in errors_m for error in errors])
    steps = [bool(x) for run in inside95 for x in run]

    return {
        "name": name, "profile": profile, "runs": len(each),
        **means(each, ("mean_m", "sd_m", "max_m", "min_m", "ending_m"), 4), "ce50_m": round(whole.median_m, 4),
        "ce95_m": round(whole.p95_m, 4), "worst_m": round(whole.max_m, 4),
        "coverage95": round(sum(steps) / len(steps), 4) if steps else None,
        "lost": sum(errors[-1] > LOST_END_M for errors in errors_m),
    }  # fmt: skip


def write_json(path: Path, study: str, runs: int, seed: int, rows: Sequence[Mapping[str, Any]]) -> None:
    """`{study, runs, seed, rows}`; raises EchostepError when the file cannot be written."""
    text = json.dumps({"study": study, "runs": runs, "seed": seed, "rows": list(rows)}, indent=1)
    with as_error(f"{path}: cannot write the results"):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text + "\n")


def write_parquet(path: Path, rows: Sequence[Row]) -> None:
    """One record per row, for pandas, DuckDB or Arrow; a column that a row lacks is null there."""
    import pyarrow
    import pyarrow.parquet

    columns = dict.fromkeys(key for row in rows for key in row)
    table = {key: [row.get(key) for row in rows] for key in columns}
    pyarrow.parquet.write_table(pyarrow.table(table), keep_earlier(path))
