# SPDX-License-Identifier: MIT
"""The demo again and again in one process, for minutes: whether memory grows from run to run.

In: minutes. Out: figures on the terminal, exit status 1 when a limit is missed. Owns a folder for the results of one run, which it removes.
"""

from __future__ import annotations

import contextlib
import io
import sys
import time
from tempfile import TemporaryDirectory

import numpy as np

from echostep.arrays import Floats
from echostep_app.cli import main as echostep
from reliability.campaign import Figure, options, report
from reliability.soak import resident_mb

SETTLED = 0.2  # of the runs, in which kernels are loaded and caches filled
MOST_MB = 0.5  # that a run may leave behind; assumed
FEWEST = 10  # runs that say anything of that


def once(seed: int) -> None:
    """A demo of this seed with a page that no browser opens, its results thrown away; raises SystemExit when it fails."""
    with TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()):
        sys.argv = ["echostep", "demo", "--port", "0", "--seed", str(seed), "--out", folder, "--no-open"]
        try:
            echostep()
        except SystemExit as end:
            if end.code:
                raise


def run(minutes: float) -> Floats:
    """Rows of time, s, and memory, MB, after each run; two at least."""
    began, rows = time.monotonic(), list[tuple[float, float]]()
    while len(rows) < 2 or time.monotonic() - began < 60.0 * minutes:
        once(len(rows) + 1)
        rows.append((time.monotonic() - began, resident_mb("self")))
    return np.array(rows)


def figures(rows: Floats) -> list[Figure]:
    """Memory by runs: a straight line through those after SETTLED of all."""
    late = rows[int(SETTLED * len(rows)) :]
    run_mb = float(np.polyfit(np.arange(len(late)), late[:, 1], 1)[0])
    judged = run_mb <= MOST_MB if len(rows) >= FEWEST else None
    return [
        Figure("runs", str(len(rows))),
        Figure("memory", f"{rows[0, 1]:.0f} MB after the first, {late[0, 1]:.0f} MB, {rows[-1, 1]:.0f} MB at the end"),
        Figure("growth of a run", f"{run_mb:+.3f} MB", f"{MOST_MB} MB", judged),
        Figure("growth", f"{run_mb * (len(late) - 1) / (late[-1, 0] - late[0, 0]) * 3600.0:+.0f} MB/h"),
    ]


def main() -> int:
    """Run, and print the figures."""
    return report("demo loops", figures(run(options(__doc__, minutes=(10.0, "how long")).minutes)))


if __name__ == "__main__":
    sys.exit(main())
