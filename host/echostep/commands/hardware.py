# SPDX-License-Identifier: MIT
"""`echostep doctor`, `bench-report`, `flash` and `calibrate`: commands about boards and sensors.

In: the command's arguments and options. Out: findings, a flashed board, settings. Slow imports wait until a command runs.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from echostep.printing.lines import say

app = typer.Typer()


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
    from echostep.commissioning import doctor as examination

    if udev:
        say(examination.rules_text().removesuffix("\n"))
    elif not examination.run(board, mtx, seconds, foot, electrical=electrical):
        raise typer.Exit(1)


@app.command()
def bench_report(
    board: Annotated[str | None, typer.Option("--board", metavar="PORT", help="Port of the board.")] = None,
    foot: Annotated[str | None, typer.Option("--foot", metavar="PORT", help="Port of a foot board.")] = None,
    seconds: Annotated[float, typer.Option(help="Seconds to listen.", min=3.0, max=3600.0)] = 30.0,
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="The report.")] = Path("bench-report.txt"),
) -> None:
    """Collect what a new board tells of itself into one text file, to be sent in with measurements (firmware/bench.md)."""
    from echostep.commissioning import bench_report as bench

    say(bench.write(board, foot, seconds, out))


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
    from echostep.commissioning import flash as flashing
    from echostep.printing.console import console_for_people

    flashing.flash(port, hex_file, console_for_people(highlight=False))


@app.command()
def calibrate(
    parts: Annotated[
        list[str] | None,
        typer.Argument(
            help="gyros, mounting, compass, legs; without any, these four. accelerometers: of the parts on six sides. "
            "rangers RECORDING: from a recorded walk on --plan."
        ),
    ] = None,
    board: Annotated[
        str | None, typer.Option("--board", metavar="PORT", help="Port of the board; without it, it is searched for.")
    ] = None,
    foot: Annotated[
        str | None,
        typer.Option(
            "--foot", metavar="PORT", help="Port of a foot board, for accelerometers; without it, it is searched for."
        ),
    ] = None,
    out: Annotated[
        Path, typer.Option("--out", metavar="FILE", help="Settings file to write; its other sections are kept.")
    ] = Path("calibration.toml"),
    thigh: Annotated[float, typer.Option("--thigh", metavar="M", help="Hip to knee, metres.")] = 0.43,
    shank: Annotated[float, typer.Option("--shank", metavar="M", help="Knee to ankle, metres.")] = 0.43,
    walked: Annotated[
        float, typer.Option("--walked", metavar="M", help="Length of the walk that calibrates the legs, metres.")
    ] = 10.0,
    plan: Annotated[
        Path | None, typer.Option("--plan", metavar="PLAN", help="Plan of the walk that calibrates the rangers.")
    ] = None,
) -> None:
    """Calibrate gyros, mounting, compass and legs, the accelerometers, or the rangers. Writes the results as settings."""
    if parts and parts[0] == "rangers":
        from echostep.commands.actions.rangers import calibrate_rangers
        from echostep.printing.console import console_for_people

        calibrate_rangers([Path(p) for p in parts[1:]], plan, out, console_for_people(highlight=False))
        return
    from echostep.commissioning import calibrate as calibration
    from echostep.printing.console import console_for_people

    wearer = calibration.Wearer(thigh, shank, walked)
    calibration.calibrate(calibration.Ports(board, foot), parts or [], wearer, out, console_for_people(highlight=False))
