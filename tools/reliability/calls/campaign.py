# SPDX-License-Identifier: MIT
"""Lets each call of the operating system fail in turn, in each command that runs, and judges what became of the run.

In: options. Out: a line for each run that went wrong; counts by command and kind; exit status 1 when one did. Owns the folder of the runs. As SQLite
is tested: the first call of a kind fails, then the second, until a run makes no more; each once with the one call alone, and once with all after it.

The kinds: `output` (what is written to people), `files` (what is opened, written, flushed, linked, closed in the output folder), `ports`, `sockets`.
"""

from __future__ import annotations

import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path

from command_line import echostep
from places import OUT
from reliability.calls.cases import Case, cases
from reliability.calls.run import Outcome, faults_of, run
from reliability.calls.shim import KINDS, Failure, preload
from reliability.campaign import CampaignJournal, Figure, none, options, report


@dataclass(frozen=True, slots=True)
class Result:
    """What became of a run; `said`: of one that went wrong, the ends of what it printed and of its exceptions."""

    what: str
    status: int | None
    faults: list[str]
    said: str


def run_with(case: Case, failure: Failure, folder: Path, sound: Outcome) -> Result:
    """One run with a failure, beside the `sound` one."""
    outcome = run(case, failure, folder)
    faults = faults_of(case, failure, outcome, sound)
    said = f"{outcome.printed[-500:]} {outcome.crashes[-1500:]}" if faults else ""
    return Result(f"{case.name}: {failure.kind}", outcome.status, faults, said)


def runs_of(case: Case, kind: str, most: int, folder: Path) -> dict[str, Callable[[], Result]]:
    """All failures of one kind in one command. `most`: calls, spread evenly over those that are made."""
    sound = run(case, Failure(kind, 0), folder / "sound")
    if sound.status != 0 or sound.crashes:
        raise SystemExit(f"{case.name}: it fails by itself: status {sound.status}: {sound.printed} {sound.crashes}")
    count = min(sound.calls, most)
    numbers = [1 + (sound.calls - 1) * k // max(count - 1, 1) for k in range(count)]
    failures = [Failure(kind, call, lasts) for call, lasts in product(numbers, (False, True))]
    return {f"{case.name}: {failure}": partial(run_with, case, failure, folder / "run", sound) for failure in failures}


def main() -> int:
    """Run, print."""
    asked = options(
        __doc__,
        out=(OUT / "calls.jsonl", "outcomes so far; they are not run again"),
        most=(1000, "calls of a kind that fail in a command"),
        kinds=(list(KINDS), "which"),
        only=("", "the command of this name alone"),
    )
    preload()
    journal, rows = CampaignJournal(asked.out), []
    with tempfile.TemporaryDirectory() as name, cases(Path(name)) as every:
        echostep(*every[1].words(Path(name) / "first"))  # compiles and imports what the forked runs then have
        chosen = [case for case in every if asked.only in ("", case.name)]
        for case in chosen:
            for kind in sorted(set(case.kinds) & set(asked.kinds)):
                runs = runs_of(case, kind, asked.most, Path(name))
                rows += journal.play(f"{case.name}: {kind}", runs, lambda row: str(row) if row["faults"] else "")
    counts = Counter(f"{row['what']}, exit status {row['status']}" for row in rows)
    wrong = sum(bool(row["faults"]) for row in rows)
    figures = [Figure(what, f"{count:,}") for what, count in counts.items()]
    return report(f"{len(rows):,} runs with a call that failed", [*figures, none("went wrong", wrong)])


if __name__ == "__main__":
    sys.exit(main())
