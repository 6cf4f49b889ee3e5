# SPDX-License-Identifier: MIT
"""Speed, as ratios against a peer that does the same work in the same run on the same poses and walls.

In: nothing. Out: a table, and in the folder given by --out bench.json (`{name, ratio, median_s, peer_s}` a row) and bench.png; medians are reported.
Owns the order of the rows.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

from rich.console import Console
from rich.table import Table

from echostep_studies.frame.pictures import BLUE, RED, axes_of, save
from echostep_studies.speed.against_peers import crossing, growing, stepping, weighing
from echostep_studies.speed.comparison import Row, Scale
from echostep_studies.speed.peers import MISSING
from echostep_studies.speed.processes import replaying, starting


def rows(scale: Scale) -> Iterator[Row]:
    """One row a comparison."""
    for part in (weighing, crossing, growing, starting, replaying, stepping):
        yield from part(scale)


def picture(rows: list[Row], path: Path) -> None:
    """The ratios as bars, with what is promised."""
    figure, ((axes,),) = axes_of(1, 1, (9, 0.45 * len(rows) + 1.2))
    axes.barh([r.name for r in rows], [r.ratio for r in rows], color=BLUE)
    for k, row in enumerate(rows):
        if row.wanted is not None:
            axes.plot([row.wanted, row.wanted], [k - 0.4, k + 0.4], color=RED)
    axes.set(xscale="log", xlabel="times longer; red: promised")
    axes.invert_yaxis()
    save(figure, path)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--out", type=Path, default=Path("out/bench"), metavar="DIR")
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--tiny", action="store_true", help="a look at whether everything runs, in a small setting")
    options = parser.parse_args()
    scale = Scale(2, 200, 64, 2_000, 400) if options.tiny else Scale(options.rounds)
    table = Table("what; against what", "ours", "peer", "ratio", "promised", title="medians, rounds interleaved")
    timed = []
    for row in rows(scale):
        timed.append(row)
        wanted = "" if row.wanted is None else f">= {row.wanted:g}"
        table.add_row(
            row.name, f"{1e3 * row.median_s:.3g} ms", f"{1e3 * row.peer_s:.3g} ms", f"{row.ratio:.3g}", wanted
        )
    options.out.mkdir(parents=True, exist_ok=True)
    fields = [{k: v for k, v in asdict(row).items() if k != "wanted"} for row in timed]
    (options.out / "bench.json").write_text(json.dumps(fields, indent=1) + "\n")
    picture(timed, options.out / "bench.png")
    table.caption = "\n".join(["not compared:", *MISSING.values()]) if MISSING else None
    Console(width=None if sys.stdout.isatty() else 150).print(table)


if __name__ == "__main__":
    main()
