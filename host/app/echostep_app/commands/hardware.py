# SPDX-License-Identifier: MIT
"""`echostep doctor`, `bench-report`, `flash`, `calibrate` and `beacons simulate`: commands about boards and sensors.

In: the command's arguments and options. Out: findings, a flashed board, settings, frames on a port. Slow imports wait until a command runs.
"""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from echostep_app.commands.options import Seed, Shank, Thigh, out_option
from echostep_app.printing.lines import say

app = typer.Typer()


class FiredBy(StrEnum):
    """The schedules of the pings (protocol/messages.toml)."""

    CONCURRENT = "concurrent"
    SEQUENTIAL = "sequential"
    SIMULTANEOUS = "simultaneous"


@app.command()
def doctor(
    board: Annotated[str | None, typer.Option("--board", metavar="PORT", help="Port of the board.")] = None,
    mtx: Annotated[str | None, typer.Option("--mtx", metavar="PORT", help="Port of the MTx.")] = None,
    foot: Annotated[str | None, typer.Option("--foot", metavar="PORT", help="Port of a foot board.")] = None,
    seconds: Annotated[float, typer.Option(help="Seconds to listen.", min=3.0, max=3600.0)] = 6.0,
    electrical: Annotated[
        bool, typer.Option("--electrical", help="Also the levels of the boards' inputs: for wiring a new board.")
    ] = False,
    udev: Annotated[bool, typer.Option("--udev", help="Only print the udev rules.")] = False,
) -> None:
    """Check ports, boards and MTx, and say what to do about each fault. Exit status 1 when there is a fault."""
    from echostep_app.commissioning import doctor as examination

    if udev:
        say(examination.rules_text().removesuffix("\n"))
    elif not examination.run(board, mtx, seconds, foot, electrical=electrical):
        raise typer.Exit(1)


@app.command()
def bench_report(
    board: Annotated[str | None, typer.Option("--board", metavar="PORT", help="Port of the board.")] = None,
    foot: Annotated[str | None, typer.Option("--foot", metavar="PORT", help="Port of a foot board.")] = None,
    seconds: Annotated[float, typer.Option(help="Seconds to listen.", min=3.0, max=3600.0)] = 30.0,
    out: Annotated[Path, out_option("FILE", "The report.")] = Path("bench-report.txt"),
    schedule: Annotated[
        FiredBy | None, typer.Option(help="How the rangers fire meanwhile; without it, as they do now.")
    ] = None,
) -> None:
    """Collect a new board's reports in one text file, to be sent in with measurements (firmware/bench.md)."""
    from echostep.board.messages import Schedule
    from echostep_app.commissioning import bench_report as bench

    say(bench.write(board, foot, seconds, out, Schedule[schedule.name] if schedule else None))


@app.command()
def flash(
    port: Annotated[
        str | None, typer.Option("--port", metavar="PORT", help="Port of the board; without it, it is searched for.")
    ] = None,
    hex_file: Annotated[
        Path | None,
        typer.Option("--hex", metavar="FILE", help="Firmware (Intel HEX); without it, the one of this package."),
    ] = None,
) -> None:
    """Write the firmware to a board (needs avrdude)."""
    from echostep_app.commissioning import flash as flashing
    from echostep_app.printing.console import console_for_people

    flashing.flash(port, hex_file, console_for_people(highlight=False))


@app.command()
def calibrate(
    parts: Annotated[
        list[str] | None,
        typer.Argument(
            help="gyros, mounting, compass, legs; without any, these four. accelerometers: of the parts on six sides."
        ),
    ] = None,
    board: Annotated[
        str | None, typer.Option("--board", metavar="PORT", help="Port of the board; without it, it is searched for.")
    ] = None,
    foot: Annotated[
        str | None,
        typer.Option(
            "--foot",
            metavar="PORT",
            help="Port of a foot board, for accelerometers; without it, it is searched for.",
        ),
    ] = None,
    out: Annotated[Path, out_option("FILE", "Settings file to write; its other sections are kept.")] = Path(
        "calibration.toml"
    ),
    thigh: Thigh = None,
    shank: Shank = None,
    walked: Annotated[
        float, typer.Option("--walked", metavar="M", help="Length of the walk that calibrates the legs, metres.")
    ] = 10.0,
) -> None:
    """Calibrate gyros, mounting, compass and legs, or the accelerometers. Writes the results as settings."""
    from echostep_app.commissioning import calibrate as calibration
    from echostep_app.printing.console import console_for_people

    wearer = calibration.Wearer(thigh, shank, walked)
    calibration.calibrate(calibration.Ports(board, foot), parts or [], wearer, out, console_for_people(highlight=False))


beacons_app = typer.Typer(no_args_is_help=True, help="Beacons: a simulated gateway.")


@beacons_app.callback()
def beacons() -> None:
    """Beacons: a simulated gateway."""


@beacons_app.command()
def simulate(
    plan: Annotated[Path, typer.Option("--plan", help="The building's plan: walls hide beacons.")],
    truth: Annotated[
        Path, typer.Option("--truth", metavar="FILE", help="Path of the wearer: CSV t_s,x,y,heading_rad.")
    ],
    to: Annotated[
        str, typer.Option("--to", metavar="PORT", help="udp://HOST:PORT[?key=FILE], or a serial port.")
    ] = "udp://127.0.0.1:9000",
    spacing: Annotated[
        float, typer.Option("--spacing", metavar="M", help="Distance between beacons along the walk.", min=0.5)
    ] = 5.0,
    pace: Annotated[float, typer.Option("--pace", help="Speed, as a multiple of real time.", min=0.01)] = 1.0,
    seed: Seed = 1,
) -> None:
    """Simulate beacons along a walk, and send their measurements as their gateway does, in real time."""
    from echostep_app.commands.actions.beacon_player import simulate_gateway

    simulate_gateway(plan, truth, to, spacing, pace, seed)
