# SPDX-License-Identifier: MIT
"""What a study puts out: summary rows, JSON and Parquet files.

In: rows, which are dictionaries with the same keys in every run. Out: files. Owns nothing.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from echostep.errors import EchostepError
from echostep.scorecard.error_statistics import error_statistics

Row = dict[str, Any]

LOST_M = 3.0  # error at the end of a run above which it counts as lost: a definition


def rows_by_name(rows: Sequence[Row]) -> list[list[Row]]:
    """The rows of all runs grouped by their `name`, names in the order of their first row."""
    groups: dict[str, list[Row]] = {}
    for row in rows:
        groups.setdefault(row["name"], []).append(row)
    return list(groups.values())


def summary(name: str, profile: str, errors_m: Sequence[Sequence[float]], inside95: Sequence[Sequence[bool]]) -> Row:
    """A row in the form of [Girard 2011, Table 1] from the errors at the steps of each run, (runs, steps).

    `mean_m`, `sd_m`, `max_m`, `min_m`, `ending_m` are computed for each run, then averaged over the runs; `worst_m` is the greatest error of all,
    `ce50_m` and `ce95_m` are percentiles of all errors [ISO/IEC 18305:2016, 8.9].
    `coverage95`: share of all steps with the truth inside the 95 % ellipse, None without `inside95`.
    `lost`: number of runs that end more than `LOST_M` off.
    """
    each = [error_statistics(errors) for errors in errors_m]
    row: Row = {"name": name, "profile": profile, "runs": len(each)}
    for key in ("mean_m", "sd_m", "max_m", "min_m", "ending_m"):
        row[key] = round(sum(getattr(run, key) for run in each) / len(each), 4)
    whole = error_statistics([error for errors in errors_m for error in errors])
    row |= {"ce50_m": round(whole.median_m, 4), "ce95_m": round(whole.p95_m, 4)}
    row["worst_m"] = round(whole.max_m, 4)
    steps = [bool(x) for run in inside95 for x in run]
    row["coverage95"] = round(sum(steps) / len(steps), 4) if steps else None
    row["lost"] = sum(errors[-1] > LOST_M for errors in errors_m)
    return row


def write_json(path: Path, study: str, runs: int, seed: int, rows: Sequence[Mapping[str, Any]]) -> None:
    """`{study, runs, seed, rows}`; raises EchostepError when the file cannot be written."""
    text = json.dumps({"study": study, "runs": runs, "seed": seed, "rows": list(rows)}, indent=1)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text + "\n")
    except OSError as error:
        raise EchostepError(f"{path}: cannot write the results: {error.strerror}") from error


def write_parquet(path: Path, rows: Sequence[Row]) -> None:
    """One record per row, for pandas, DuckDB or Arrow."""
    import pyarrow
    import pyarrow.parquet

    pyarrow.parquet.write_table(pyarrow.Table.from_pylist(list(rows)), path)
