# SPDX-License-Identifier: MIT
"""Lets each call of the operating system fail in turn, in each command that runs, and judges what became of the run.

In: options. Out: a line for each run that went wrong; counts by command and kind; exit status 1 when one did. Owns the folder of the runs. As SQLite
is tested: the first call of a kind fails, then the second, until a run makes no more; each once with the one call alone, and once with all after it.

The kinds: `output` (what is written to people), `files` (what is opened, written, flushed, linked, closed in the output folder), `ports`, `sockets`.
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections import Counter
from itertools import product
from pathlib import Path

from command_line import echostep
from places import OUT
from reliability.calls.cases import Case, cases
from reliability.calls.run import faults_of, run
from reliability.calls.shim import KINDS, Failure, preload
from reliability.campaign import CampaignJournal, Figure, none, options, report, track


def campaign(case: Case, kind: str, most: int, folder: Path, journal: CampaignJournal) -> None:
    """All failures of one kind in one command; those in the journal are not run again. `most`: calls, spread evenly over those that are made."""
    sound = run(case, Failure(kind, 0), folder / "sound")
    if sound.status != 0 or sound.crashes:
        raise SystemExit(f"{case.name}: it fails by itself: status {sound.status}: {sound.printed} {sound.crashes}")
    numbers = (
        sorted({1 + (sound.calls - 1) * k // max(most - 1, 1) for k in range(most)})
        if sound.calls > most
        else range(1, sound.calls + 1)
    )
    known = {(row["case"], row["kind"], row["call"], row["lasts"]) for row in journal.rows}
    for call, lasts in track(list(product(numbers, (False, True))), f"{case.name}: {kind}, {sound.calls} calls"):
        if (case.name, kind, call, lasts) in known:
            continue
        failure = Failure(kind, call, lasts)
        outcome = run(case, failure, folder / "run")
        faults = faults_of(case, failure, outcome, sound)
        row = {
            "case": case.name,
            "kind": kind,
            "call": call,
            "lasts": lasts,
            "status": outcome.status,
            "faults": faults,
        }
        journal.add(row)
        if faults:
            print(json.dumps(row | {"printed": outcome.printed[-500:], "crashes": outcome.crashes[-1500:]}), flush=True)


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
    journal = CampaignJournal(asked.out)
    with tempfile.TemporaryDirectory() as name, cases(Path(name)) as every:
        chosen = [case for case in every if asked.only in ("", case.name)]
        echostep(*every[1].words(Path(name) / "first"))  # compiles and imports what the forked runs then have
        for case in chosen:
            for kind in sorted(set(case.kinds) & set(asked.kinds)):
                campaign(case, kind, asked.most, Path(name), journal)
    counts = Counter((row["case"], row["kind"], row["status"]) for row in journal.rows)
    rows = [Figure(f"{case}: {kind}, exit status {status}", f"{n:,}") for (case, kind, status), n in counts.items()]
    wrong = sum(bool(row["faults"]) for row in journal.rows)
    return report(f"{len(journal.rows):,} runs with a call that failed", [*rows, none("went wrong", wrong)])


if __name__ == "__main__":
    sys.exit(main())
