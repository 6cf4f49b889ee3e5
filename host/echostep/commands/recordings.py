"""The commands about recordings: `echostep info | cut | repair | export`."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer()

Log = Annotated[Path, typer.Argument(metavar="FILE", help="A recording (.mcap).")]
Out = Annotated[Path, typer.Option("--out", "-o", metavar="OUT", help="The recording to write.")]


@app.command()
def info(file: Log) -> None:
    """What a recording holds, and in what condition it is."""
    from echostep.recording import edit as logs

    print("\n".join(logs.info(file)))


@app.command()
def cut(
    file: Log,
    out: Out,
    begin_s: Annotated[float, typer.Option("--from", metavar="S", help="Seconds after the beginning.", min=0.0)] = 0.0,
    end_s: Annotated[float, typer.Option("--to", metavar="S", help="Seconds after the beginning.")] = math.inf,
) -> None:
    """Cut a piece out of a recording."""
    from echostep.recording import edit as logs

    print("\n".join(logs.cut(file, begin_s, end_s, out)))


@app.command()
def export(
    file: Log,
    plan: Annotated[Path, typer.Option("--plan", help="The building's plan (JSON, metres).")],
    out: Annotated[
        Path,
        typer.Option(
            "--out", "-o", metavar="OUT", help="track.csv, .parquet, .gpkg, .kml, or .mcap with derived messages."
        ),
    ],
    start: Annotated[
        str | None, typer.Option("--start", metavar="X,Y,DEG", help="Where the wearer stands and looks at first.")
    ] = None,
    settings: Annotated[Path | None, typer.Option("--settings", metavar="FILE", help="Settings (TOML).")] = None,
    seed: Annotated[int | None, typer.Option("--seed", help="Seed; the recorded one by default.", min=0)] = None,
) -> None:
    """Track a recording and write its track for other programs."""
    from echostep.commands import run as runs
    from echostep.output.track_files import export as write

    pose = None if start is None else runs.parse_pose(start)
    print(write(file, plan, out, lambda recording, on: runs.tracker_of(recording, on, pose, settings, seed)))


@app.command()
def repair(file: Log, out: Out) -> None:
    """Save what a crash or damage left of a recording."""
    from echostep.recording import edit as logs

    print("\n".join(logs.repair(file, out)))
