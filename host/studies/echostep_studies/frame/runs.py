# SPDX-License-Identifier: MIT
"""The runs of a study: one function, many seeds, on all cores or on a Dask cluster, with a journal from which a killed study resumes.

In: a function of one seed that returns rows. Out: the rows of all runs in order of their seeds. Owns the journal file.
"""

from __future__ import annotations

import hashlib
import json
import multiprocessing
import os
import re
from collections.abc import Callable, Generator, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any, Generic, TypeVar

import msgspec
from rich.progress import track

from echostep.errors import EchostepError
from echostep_app.output.table import console
from echostep_app.printing.lines import put_aside
from echostep_studies.frame.report import as_dict

RunRow = TypeVar("RunRow")

PROGRESS_LINES = 10  # lines about the progress of a study where the output is no terminal
SCHEDULER_TIMEOUT = "10s"  # for the connection to a Dask scheduler


@dataclass(frozen=True, slots=True)
class SeededRuns(Generic[RunRow]):
    """Runs of one experiment; run k has the seed `seed + k`.

    `run`: importable and picklable; returns the rows of the run of a seed, the same rows for the same seed. `folder`: of the journal.
    `kinds`: the dataclasses of the rows.
    `scheduler`: address of a Dask scheduler; None: the cores of this machine.
    """

    name: str
    runs: int
    seed: int
    run: Callable[[int], Iterable[RunRow]]
    folder: Path
    kinds: tuple[type[RunRow], ...]
    scheduler: str | None = None

    def rows(self) -> list[RunRow]:
        """Rows of all runs in order of their seeds. Runs that the journal holds are not run again."""
        journal = self._open_journal()
        seeds = range(self.seed, self.seed + self.runs)
        missing = [seed for seed in seeds if seed not in journal.runs]
        if len(missing) < self.runs:
            console.print(f"{self.runs - len(missing)} of {self.runs} runs are taken from {journal.path}")
        self._run_missing(missing, journal)
        return [row for seed in seeds for row in journal.runs[seed]]

    def _open_journal(self) -> Journal[RunRow]:
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            return Journal(self.folder / f"{self.name}.{self._fingerprint()}.journal.jsonl", self.kinds)
        except OSError as error:
            raise EchostepError(f"{self.folder}: cannot write there: {error.strerror}") from error

    def _run_missing(self, seeds: Sequence[int], journal: Journal[RunRow]) -> None:
        """Run these seeds and write the rows of each run to the journal as soon as it ends."""
        finished = _on_cluster(self.run, seeds, self.scheduler) if self.scheduler else _on_cores(self.run, seeds)
        try:
            shown = track(finished, self.name, total=len(seeds), console=console, disable=not seeds)
            for k, (seed, rows) in enumerate(shown, start=1):
                journal.add(seed, rows)
                if not console.is_terminal and k % max(len(seeds) // PROGRESS_LINES, 1) == 0:
                    console.print(f"{self.name}: {k} of {len(seeds)} runs")
        finally:
            finished.close()

    def _fingerprint(self) -> str:
        """Digest of the source of both packages and of the name of `run` with its arguments: rows of other code, rows or data are not reused."""
        sha = hashlib.sha256(re.sub(" at 0x[0-9a-f]+", "", repr(self.run)).encode())
        for package in ("echostep", "echostep_studies"):
            for path in sorted(Path(str(files(package))).rglob("*.py")):
                sha.update(path.read_bytes())
        return sha.hexdigest()[:16]


class Journal(Generic[RunRow]):
    """Rows of the finished runs of a study: a JSON file with one line per run, readable after a kill at any moment.

    A line has the seed, and for each row the name of its dataclass and its columns.

    The file's name has the fingerprint, so journals of other code, rows or data stay beside it.
    """

    def __init__(self, path: Path, kinds: tuple[type[RunRow], ...]) -> None:
        self.path = path
        self.runs: dict[int, list[RunRow]] = {}
        self._kinds = {kind.__name__: kind for kind in kinds}
        if path.is_dir():
            put_aside(path, "its runs are made anew")
        path.touch()
        lines = path.read_text(errors="replace").splitlines(keepends=True)
        for line in lines:
            try:
                self._keep(json.loads(line))
            except (ValueError, KeyError, TypeError, RecursionError, msgspec.MsgspecError):
                continue  # the last line before a kill may be incomplete
        if lines and not lines[-1].endswith("\n"):
            with path.open("a") as file:
                file.write("\n")

    def add(self, seed: int, rows: Iterable[RunRow]) -> None:
        """Write the rows of a run to the file, then keep them as JSON returns them."""
        line = json.dumps({"seed": seed, "rows": [(type(row).__name__, as_dict(row)) for row in rows]})
        with self.path.open("a") as file:
            file.write(line + "\n")
        self._keep(json.loads(line))

    def _keep(self, run: dict[str, Any]) -> None:
        """The rows of a line of the file; raises ValueError, KeyError or TypeError where it is not a whole one."""
        self.runs[run["seed"]] = [msgspec.convert(columns, self._kinds[kind]) for kind, columns in run["rows"]]


def _on_cores(
    run: Callable[[int], Iterable[RunRow]], seeds: Sequence[int]
) -> Generator[tuple[int, Iterable[RunRow]], None, None]:
    if len(seeds) < 2:
        for seed in seeds:
            yield seed, run(seed)
        return
    workers = min(len(os.sched_getaffinity(0)), len(seeds))
    pool = ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"))
    try:
        seed_of = {pool.submit(run, seed): seed for seed in seeds}
        for done in as_completed(seed_of):
            yield seed_of[done], done.result()
    except BaseException:  # a SIGTERM reaches this process alone: its workers would finish runs of minutes first
        for worker in multiprocessing.active_children():
            worker.kill()  # SIGTERM may be ignored, inherited from whatever started this process; the journal is this one's
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _on_cluster(
    run: Callable[[int], Iterable[RunRow]], seeds: Sequence[int], address: str
) -> Generator[tuple[int, Iterable[RunRow]], None, None]:
    try:
        import distributed
    except ImportError as error:
        raise EchostepError("--scheduler needs Dask: pip install 'echostep-studies[cluster]'") from error
    try:
        client = distributed.Client(address, timeout=SCHEDULER_TIMEOUT, set_as_default=False)
    except (OSError, ValueError) as error:
        raise EchostepError(f"--scheduler {address}: no Dask scheduler answers there: {error}") from error
    with client:
        futures = client.map(run, seeds, pure=False)
        seed_of = {future.key: seed for future, seed in zip(futures, seeds, strict=True)}
        for done in distributed.as_completed(futures, loop=client.loop):
            yield seed_of[done.key], done.result()
