# SPDX-License-Identifier: MIT
"""`echostep floors`: the command's arguments and options. Heavy imports wait until it runs.

In: nothing. Out: `floors`, declared for typer. Owns nothing.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from echostep_app.commands.options import Columns, Units, picture_file


def floors(
    pressure: Annotated[
        Path, typer.Argument(help="CSV: t_s,pressure_pa[,temperature_c] in s, Pa, degC; 0.5 to 50 Hz.")
    ],
    heights: Annotated[
        str,
        typer.Option(
            "--heights", metavar="METRES", help="Heights of the floors, as 0,3.5,7; auto: from the recording."
        ),
    ],
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="The floors to write (CSV).")] = Path("floors.csv"),
    start: Annotated[
        int | None, typer.Option("--start", metavar="FLOOR", help="Floor at the start, if known.", min=0)
    ] = None,
    picture: Annotated[
        Path | None,
        typer.Option("--picture", metavar="FILE", callback=picture_file, help="Draw the floors there (PNG, SVG, PDF)."),
    ] = None,
    columns: Columns = None,
    units: Units = None,
) -> None:
    """Floors of a recorded barometer. Writes t_s,floor,probability,height_m; a floor is the index into --heights, from 0."""
    from echostep_app.offline.foreign_columns import parse_naming
    from echostep_studies.barometer import floors_command

    floors_command.floors(pressure, heights, out, start, picture, parse_naming(columns, units))
