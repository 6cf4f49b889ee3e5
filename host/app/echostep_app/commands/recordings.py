# SPDX-License-Identifier: MIT
"""`echostep info`, `cut`, `repair` and `export`: commands about recordings.

In: the command's arguments and options. Out: a summary, a new recording, a track for other programs. Slow imports wait until a command runs.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from echostep_app.commands.options import OptionalPlan, RecordedSeed, SettingsFile, example, out_option
from echostep_app.printing.lines import say
from echostep_app.printing.people import outlast_output

app = typer.Typer()

Recording = Annotated[Path, typer.Argument(metavar="FILE", help="A recording (.mcap).")]
Out = Annotated[Path, out_option("OUT", "The recording to write.")]


@app.command()
def info(file: Recording) -> None:
    """Show the contents of a recording, and whether it is whole; of another file, its kind and the command that reads it."""
    from echostep.errors import EchostepError
    from echostep_app.commands.actions.foreign import foreign
    from echostep_app.recording.repair import contents

    if what := foreign(file):
        raise EchostepError(f"{file}: no recording but {what}")
    say(*contents.info(file))


@app.command()
def cut(
    file: Recording,
    out: Out,
    begin_s: Annotated[float, typer.Option("--from", metavar="S", help="Seconds after the beginning.", min=0.0)] = 0.0,
    end_s: Annotated[float, typer.Option("--to", metavar="S", help="Seconds after the beginning.")] = math.inf,
) -> None:
    """Cut a piece out of a recording."""
    from echostep_app.recording.repair import edit

    say(*edit.cut(file, begin_s, end_s, out))


@app.command(epilog=example("echostep export walk.mcap --plan plan.json -o track.geojson"))
def export(
    file: Recording,
    out: Annotated[
        Path,
        out_option("OUT", "track.csv, .parquet, .gpkg, .geojson, .kml, .gpx, .tum, or .mcap with derived messages."),
    ],
    plan: OptionalPlan = None,
    start: Annotated[
        str | None, typer.Option("--start", metavar="X,Y,DEG", help="Position and heading of the wearer at the start.")
    ] = None,
    settings: SettingsFile = None,
    seed: RecordedSeed = None,
) -> None:
    """Track a recording and write its track for other programs."""
    from echostep_app.output.track_files import export as export_track
    from echostep_app.session.options import TrackingOptions
    from echostep_app.session.runs.replay import tracker_of

    tracking = TrackingOptions(plan, start, None, settings, seed)
    outlast_output()
    say(export_track(file, plan, out, lambda recording, on: tracker_of(recording, on, tracking)))


@app.command()
def repair(file: Recording, out: Out) -> None:
    """Write the readable part of a damaged recording to a new one."""
    from echostep_app.recording.repair import edit

    say(*edit.repair(file, out))
