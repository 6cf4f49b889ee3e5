# SPDX-License-Identifier: MIT
"""`echostep map`, `import`, `foot`, `legs`, `floors`, `score` and `decode`: commands that read files and write others.

In: the command's arguments and options. Out: files, text. Slow imports wait until a command runs.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from echostep_app.commands.options import (
    Columns,
    OptionalPlan,
    SettingsFile,
    Shank,
    Start,
    Thigh,
    Units,
    example,
    of_kind,
    out_option,
    picture_option,
)
from echostep_app.extras import require

app = typer.Typer()
Truth = Annotated[
    Path | None,
    typer.Option("--truth", metavar="FILE", help="True path to compare with, as of score, on the foot's clock."),
]


@app.command("map")
def map_command(
    recording: Annotated[Path, typer.Argument(metavar="WALK", help="A recorded walk (.mcap) through a building.")],
    out: Annotated[Path, out_option("PLAN", "The plan to write (JSON).")],
    picture: Annotated[Path | None, picture_option("Draw plan and path there")] = None,
) -> None:
    """Draw the plan of a building from a recorded walk."""
    require("a drawing of a walk", "scipy")
    from echostep_app.commands.actions import mapping

    mapping.map_recording(recording, out, picture)


@app.command("import", epilog=example("echostep import imu.csv --pressure pressure.csv -o walk.mcap"))
def import_command(
    imu: Annotated[Path, typer.Argument(help="Recording of a foot IMU: a file, folder or zip, as of foot.")],
    out: Annotated[Path, out_option("OUT", "The recording to write.")],
    columns: Columns = None,
    units: Units = None,
    pressure: Annotated[
        Path | None, typer.Option("--pressure", metavar="CSV", help="A barometer: t_s,pressure_pa.")
    ] = None,
    ranges: Annotated[
        Path | None,
        typer.Option("--ranges", metavar="CSV", help="Two rangers: t_s,direction_deg (left 90, right -90),range_m."),
    ] = None,
    legs: Annotated[Path | None, typer.Option("--legs", metavar="CSV", help="Leg gyros, as of legs.")] = None,
    truth: Truth = None,
    settings: SettingsFile = None,
) -> None:
    """Make a recording of a foot IMU's file, and of other sensors' on its clock, for replay and export."""
    from echostep_app.commands.actions import offline
    from echostep_app.offline.foreign_columns import Naming, parse_naming
    from echostep_app.offline.importing import Beside

    naming = parse_naming(columns, units)
    beside = Beside(pressure, ranges, legs, settings, Naming(naming.columns))
    offline.import_foot(imu, out, naming, beside, truth)


@app.command(epilog=example("echostep foot imu.csv --plan building.dxf --start 2,7.5,0"))
def foot(
    imu: Annotated[
        Path, typer.Argument(help="CSV: t_s,ax,ay,az,gx,gy,gz[,mx,my,mz] in s, m/s2, rad/s; or another program's.")
    ],
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="FILE|DIR", help="The track [track.csv]; with --plan a folder [out/foot]."),
    ] = None,
    profile: Annotated[
        str,
        typer.Option(
            "--profile", metavar="NAME", help="default, or fischer2008: that paper's dead reckoning (echostep-studies)."
        ),
    ] = "default",
    picture: Annotated[Path | None, picture_option("Draw the track there")] = None,
    columns: Columns = None,
    units: Units = None,
    plan: OptionalPlan = None,
    start: Start = None,
    truth: Truth = None,
) -> None:
    """Zero-velocity navigation of a recorded foot IMU; with --plan, on the plan: import and replay."""
    from echostep_app.commands.actions import offline
    from echostep_app.offline.foreign_columns import parse_naming

    naming = parse_naming(columns, units)
    of_kind(out, plan is not None)
    if plan is None:
        offline.foot(imu, out or Path("track.csv"), profile, picture, naming)
    else:
        offline.foot_on_plan(imu, out or Path("out/foot"), plan, start, truth, naming)


@app.command()
def legs(
    samples: Annotated[
        list[Path],
        typer.Argument(
            metavar="SAMPLES...",
            help="CSV: t_s,thigh_rad_s,shank_rad_s[,belt_rad_s,compass_rad]; 50 to 500 Hz, either sign. "
            "Gyros of three axes: thigh_x,thigh_y,thigh_z, shank_x,shank_y,shank_z in rad/s, mounted anyhow. "
            "Both legs: the other one in columns other_thigh_rad_s... of the same file, or in a second file.",
        ),
    ],
    thigh: Thigh = None,
    shank: Shank = None,
    out: Annotated[Path, out_option("FILE", "The track to write (CSV).")] = Path("track.csv"),
    profile: Annotated[
        str,
        typer.Option("--profile", metavar="NAME", help="default, or lee2010: that paper's method (echostep-studies)."),
    ] = "default",
    scale: Annotated[
        float | None, typer.Option("--scale", help="The wearer's stride scale, as --walked printed it.")
    ] = None,
    walked: Annotated[
        float | None,
        typer.Option("--walked", metavar="M", help="The true length of this walk: print the wearer's scale."),
    ] = None,
    picture: Annotated[Path | None, picture_option("Draw track and strides there")] = None,
    columns: Columns = None,
    units: Units = None,
) -> None:
    """Distance, strides and track from recorded leg gyros: on thigh and shank, and on the belt if there is one."""
    from echostep_app.commands.actions import offline
    from echostep_app.offline.foreign_columns import parse_naming

    naming = parse_naming(columns, units)
    offline.legs(samples, out, offline.LegOptions(thigh, shank, profile, scale, walked), picture, naming)


@app.command()
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
    out: Annotated[Path, out_option("FILE", "The floors to write (CSV).")] = Path("floors.csv"),
    start: Annotated[
        int | None, typer.Option("--start", metavar="FLOOR", help="Floor at the start, if known.", min=0)
    ] = None,
    picture: Annotated[Path | None, picture_option("Draw the floors there")] = None,
    columns: Columns = None,
    units: Units = None,
) -> None:
    """Floors of a recorded barometer. Writes t_s,floor,probability,height_m; a floor is the index into --heights, from 0."""
    from echostep_app.commands.actions import offline
    from echostep_app.offline.foreign_columns import parse_naming

    offline.floors(pressure, heights, out, start, picture, parse_naming(columns, units))


@app.command(epilog=example("echostep score track.csv --truth truth.csv --plan plan.json"))
def score(
    tracks: Annotated[
        list[Path],
        typer.Argument(
            metavar="TRACK...",
            help="CSV of any tracker: columns t_s, x_m, y_m, and more by their names; or a recording.",
        ),
    ],
    truth: Annotated[
        Path | None,
        typer.Option(
            "--truth", metavar="FILE", help="True path, or surveyed points (CSV), on the same clock; a recording's own."
        ),
    ] = None,
    plan: Annotated[
        Path | None, typer.Option("--plan", help="The building's plan, for floors by height, zones, and taps.")
    ] = None,
    start: Start = None,
    taps: Annotated[
        bool,
        typer.Option("--taps", help="The places tapped on the page of a recorded run are the truth; needs --plan."),
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of the table.")] = False,
) -> None:
    """Score tracks against the truth by ISO/IEC 18305 and EvAAL."""
    from echostep_app.commands.actions import score as scoring
    from echostep_app.session.options import TrackingOptions

    scoring.score(tracks, truth, TrackingOptions(plan, start), taps=taps, as_json=as_json)


@app.command()
def decode(
    file: Annotated[Path, typer.Argument(help="Captured bytes of the board or of an Xsens MT, or a recording.")],
    output_mode: Annotated[
        str | None,
        typer.Option(
            "--output-mode", metavar="BITS", help="Output mode of legacy MTData, as 0x0006, instead of the one found."
        ),
    ] = None,
    output_settings: Annotated[
        str | None,
        typer.Option(
            "--output-settings",
            metavar="BITS",
            help="Output settings of legacy MTData, as 0x00000001, instead of those found.",
        ),
    ] = None,
) -> None:
    """Print captured bytes as JSON, one message a line; on stderr, what was found and rejected."""
    from echostep_app.commands.actions import offline

    offline.decode(file, output_mode, output_settings)
