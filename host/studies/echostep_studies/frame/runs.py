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
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

from rich.progress import track

from echostep.errors import EchostepError
from echostep.output.table import console
from echostep_studies.frame.report import Row

Run = Callable[[int], list[Row]]  # seed -> rows

PROGRESS_LINES = 10  # lines about the progress of a study where the output is no terminal
SCHEDULER_TIMEOUT = "10s"  # for the connection to a Dask scheduler


@dataclass(frozen=True, slots=True)
class SeededRuns:
    """Runs of one experiment; run k has the seed `seed + k`.

    `run`: importable and picklable; returns the rows of the run of a seed, the same rows for the same seed. `folder`: of the journal.
    `scheduler`: address of a Dask scheduler; None: the cores of this machine.
    """

    name: str
    runs: int
    seed: int
    run: Run
    folder: Path
    scheduler: str | None = None

    def rows(self) -> list[Row]:
        """Rows of all runs in order of their seeds. Runs that the journal holds are not run again."""
        journal = self._open_journal()
        seeds = range(self.seed, self.seed + self.runs)
        missing = [seed for seed in seeds if seed not in journal.runs]
        if len(missing) < self.runs:
            console.print(f"{self.runs - len(missing)} of {self.runs} runs are taken from {journal.path}")
        self._run_missing(missing, journal)
        return [row for seed in seeds for row in journal.runs[seed]]

    def _open_journal(self) -> Journal:
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            return Journal(self.folder / f"{self.name}.{self._fingerprint()}.journal.jsonl")
        except OSError as error:
            raise EchostepError(f"{self.folder}: cannot write there: {error.strerror}") from error

    def _run_missing(self, seeds: Sequence[int], journal: Journal) -> None:
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


class Journal:
    """Rows of the finished runs of a study: a JSON file with one line per run, readable after a kill at any moment.

    Its name has the fingerprint, so journals of other code, rows or data stay beside it.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.runs: dict[int, list[Row]] = {}
        path.touch()
        lines = path.read_text(errors="replace").splitlines(keepends=True)
        for line in lines:
            try:
                run = json.loads(line)
                self.runs[run["seed"]] = run["rows"]
            except (ValueError, KeyError, TypeError):
                continue  # the last line before a kill may be incomplete
        if lines and not lines[-1].endswith("\n"):
            with path.open("a") as file:
                file.write("\n")

    def add(self, seed: int, rows: list[Row]) -> None:
        """Write the rows of a run to the file, then keep them as JSON returns them (tuples become lists)."""
        line = json.dumps({"seed": seed, "rows": rows})
        with self.path.open("a") as file:
            file.write(line + "\n")
        self.runs[seed] = json.loads(line)["rows"]


def _on_cores(run: Run, seeds: Sequence[int]) -> Generator[tuple[int, list[Row]], None, None]:
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
            worker.terminate()
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _on_cluster(run: Run, seeds: Sequence[int], address: str) -> Generator[tuple[int, list[Row]], None, None]:
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
