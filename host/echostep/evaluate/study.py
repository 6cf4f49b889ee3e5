"""What all studies share: many seeded runs on all cores or on a cluster, a journal to resume from, and results in one form.

In: a function of one seed that returns rows. Out: rows of all runs in order of their seeds, JSON, Parquet, a printed table. Owns the journal's file.
"""

from __future__ import annotations

import hashlib
import json
import math
import multiprocessing
import os
from collections.abc import Callable, Generator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import track
from rich.table import Table

from echostep.errors import EchostepError

Row = dict[str, Any]
TOLD = 10  # times in a study, where no terminal shows a bar
NARROWEST = 110  # columns of a table, also where nobody says how wide the terminal is
console = Console(soft_wrap=True)


@dataclass(frozen=True, slots=True)
class Study:
    """Many runs of one experiment: run k has the seed `seed + k`.

    `one`: a function of a seed, importable and picklable, that returns the rows of its run; equal seeds, equal rows. `folder`: where the
    journal and the results go. `scheduler`: address of a Dask scheduler; None: the cores of this machine.
    """

    name: str
    runs: int
    seed: int
    one: Callable[[int], list[Row]]
    folder: Path
    scheduler: str | None = None

    def rows(self) -> list[Row]:
        """Rows of all runs, in order of their seeds; runs that an earlier, killed study has finished are not run again."""
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            journal = Journal(self.folder / f"{self.name}.journal.jsonl", self._fingerprint())
        except OSError as error:
            raise EchostepError(f"{self.folder}: cannot write there: {error.strerror}") from error
        seeds = range(self.seed, self.seed + self.runs)
        missing = [seed for seed in seeds if seed not in journal.runs]
        if len(missing) < self.runs:
            console.print(f"{self.runs - len(missing)} of {self.runs} runs are taken from {journal.path}")
        found = _on_cluster(self.one, missing, self.scheduler) if self.scheduler else _on_cores(self.one, missing)
        try:
            shown = track(found, self.name, total=len(missing), console=console, disable=not missing)
            for k, (seed, rows) in enumerate(shown, start=1):
                journal.add(seed, rows)
                if not console.is_terminal and k % max(len(missing) // TOLD, 1) == 0:
                    console.print(f"{self.name}: {k} of {len(missing)} runs")
        finally:
            found.close()
        return [row for seed in seeds for row in journal.runs[seed]]

    def _fingerprint(self) -> str:
        """Of this program and of what it is asked to run: rows made by other code are never taken for ours."""
        sha = hashlib.sha256(repr(self.one).split(" at 0x")[0].encode())
        for path in sorted(Path(__file__).parents[1].rglob("*.py")):
            sha.update(path.read_bytes())
        return sha.hexdigest()[:16]


class Journal:
    """The finished runs of a study, a line of JSON each; survives a kill at any moment."""

    def __init__(self, path: Path, fingerprint: str) -> None:
        self.path = path
        self.runs: dict[int, list[Row]] = {}
        head = json.dumps({"fingerprint": fingerprint})
        lines = path.read_text(errors="replace").splitlines(keepends=True) if path.exists() else []
        if not lines or lines[0].strip() != head:
            path.write_text(head + "\n")
            return
        for line in lines[1:]:
            try:
                run = json.loads(line)
                self.runs[run["seed"]] = run["rows"]
            except (ValueError, KeyError, TypeError):
                continue  # cut off by the kill
        if not lines[-1].endswith("\n"):
            with path.open("a") as file:
                file.write("\n")

    def add(self, seed: int, rows: list[Row]) -> None:
        """Keep the rows of a run, on disk before anything else happens. What is kept is what JSON keeps."""
        line = json.dumps({"seed": seed, "rows": rows})
        with self.path.open("a") as file:
            file.write(line + "\n")
        self.runs[seed] = json.loads(line)["rows"]


def _on_cores(one: Callable[[int], list[Row]], seeds: Sequence[int]) -> Generator[tuple[int, list[Row]], None, None]:
    if len(seeds) < 2:
        for seed in seeds:
            yield seed, one(seed)
        return
    workers = min(len(os.sched_getaffinity(0)), len(seeds))
    pool = ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"))
    try:
        runs = {pool.submit(one, seed): seed for seed in seeds}
        for done in as_completed(runs):
            yield runs[done], done.result()
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _on_cluster(
    one: Callable[[int], list[Row]], seeds: Sequence[int], address: str
) -> Generator[tuple[int, list[Row]], None, None]:
    try:
        import distributed
    except ImportError as error:
        raise EchostepError("--scheduler needs Dask: pip install 'echostep[cluster]'") from error
    try:
        client = distributed.Client(address, timeout="10s", set_as_default=False)
    except (OSError, ValueError) as error:
        raise EchostepError(f"--scheduler {address}: no Dask scheduler answers there: {error}") from error
    with client:
        runs = client.map(one, seeds, pure=False)
        seed_of = {run.key: seed for run, seed in zip(runs, seeds, strict=True)}
        for done in distributed.as_completed(runs, loop=client.loop):
            yield seed_of[done.key], done.result()


def summary(name: str, profile: str, errors_m: Sequence[Sequence[float]], inside95: Sequence[Sequence[bool]]) -> Row:
    """A row in the form of [Girard 2011, Table 1] from the errors at the steps of each run, (runs, steps).

    `mean_m`, `sd_m`, `max_m`, `min_m`, `ending_m` are each run's own figure, averaged over the runs; `worst_m` is the greatest error of all.
    `coverage95`: share of all steps with the truth inside the 95 % ellipse, None where a profile states none.
    `lost`: runs that end more than 3 m off.
    """
    each = [_of_run(errors) for errors in errors_m]
    row: Row = {"name": name, "profile": profile, "runs": len(each)}
    for k, key in enumerate(("mean_m", "sd_m", "max_m", "min_m", "ending_m")):
        row[key] = round(sum(run[k] for run in each) / len(each), 4)
    row["worst_m"] = round(max(run[2] for run in each), 4)
    steps = [bool(x) for run in inside95 for x in run]
    row["coverage95"] = round(sum(steps) / len(steps), 4) if steps else None
    row["lost"] = sum(errors[-1] > LOST_M for errors in errors_m)
    return row


LOST_M = 3.0


def _of_run(errors: Sequence[float]) -> tuple[float, float, float, float, float]:
    mean = sum(errors) / len(errors)
    sd = math.sqrt(sum((e - mean) ** 2 for e in errors) / len(errors))
    return mean, sd, max(errors), min(errors), errors[-1]


def write_json(path: Path, study: str, runs: int, seed: int, rows: Sequence[Mapping[str, Any]]) -> None:
    """`{study, runs, seed, rows}`; raises EchostepError when the file cannot be written."""
    text = json.dumps({"study": study, "runs": runs, "seed": seed, "rows": list(rows)}, indent=1)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text + "\n")
    except OSError as error:
        raise EchostepError(f"{path}: cannot write the results: {error.strerror}") from error


def write_parquet(path: Path, rows: Sequence[Row]) -> None:
    """One line a row, for those who go on with pandas, DuckDB or Arrow."""
    import pyarrow
    import pyarrow.parquet

    pyarrow.parquet.write_table(pyarrow.Table.from_pylist(list(rows)), path)


def print_table(title: str, rows: Sequence[Mapping[str, Any]], columns: Mapping[str, str]) -> None:
    """A table on the terminal; `columns`: key of the rows -> heading. Numbers have two digits after the point."""
    table = Table(title=title)
    for k, heading in enumerate(columns.values()):
        table.add_column(heading, justify="right" if k else "left", overflow="fold")
    for row in rows:
        table.add_row(*(_cell(row.get(key)) for key in columns))
    Console(width=max(console.width, NARROWEST)).print(table)


def _cell(value: Any) -> str:
    if value is None:
        return ""
    return f"{value:.2f}" if isinstance(value, float) else str(value)
