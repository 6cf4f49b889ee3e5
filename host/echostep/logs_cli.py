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
    from echostep import logs

    print("\n".join(logs.info(file)))


@app.command()
def cut(
    file: Log,
    out: Out,
    begin_s: Annotated[float, typer.Option("--from", metavar="S", help="Seconds after the beginning.", min=0.0)] = 0.0,
    end_s: Annotated[float, typer.Option("--to", metavar="S", help="Seconds after the beginning.")] = math.inf,
) -> None:
    """Cut a piece out of a recording."""
    from echostep import logs

    print("\n".join(logs.cut(file, begin_s, end_s, out)))


@app.command()
def repair(file: Log, out: Out) -> None:
    """Save what a crash or damage left of a recording."""
    from echostep import logs

    print("\n".join(logs.repair(file, out)))
