# SPDX-License-Identifier: MIT
"""The command line: `echostep demo | live | record | replay | map | score | foot | legs | doctor | flash | calibrate | decode` and more.

In: the command's arguments and options. Out: files, views, an exit status (0: done; 2: a mistake, named in one line). Owns nothing.
Modules that are slow to import are imported inside the command that needs them, so that `--help` answers at once.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from echostep.commands.beacons import app as beacon_app
from echostep.commands.evaluate import app as evaluate
from echostep.commands.plan import app as plan_app
from echostep.commands.recordings import app as logs
from echostep.errors import EchostepError
from echostep.interruption import end_by_signals
from echostep.simulation.kits import Kit

if TYPE_CHECKING:
    from echostep.output.foxglove_live import FoxgloveAddress
    from echostep.page.server import Address
    from echostep.team.endpoint import Outlet

LOCAL = "127.0.0.1"
app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="Indoor pedestrian tracking.",
)
app.add_typer(evaluate, name="evaluate")
app.add_typer(beacon_app, name="beacons")
app.add_typer(logs)
app.add_typer(plan_app, name="plan")


def _print_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        from echostep.board.messages import SCHEMA_HASH

        typer.echo(f"echostep {version('echostep')}, protocol 0x{SCHEMA_HASH:08X}")
        raise typer.Exit


@app.callback()
def options(
    _version: Annotated[
        bool,
        typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and end."),
    ] = False,
) -> None:
    """Indoor pedestrian tracking."""


Plan = Annotated[Path, typer.Option("--plan", help="The building's plan (JSON, metres).")]
OptionalPlan = Annotated[
    Path | None,
    typer.Option(
        "--plan",
        help="The building's plan (JSON, metres). Without it the map begins where the walk begins, and nothing is drawn on it.",
    ),
]
Start = Annotated[
    str | None,
    typer.Option(
        "--start",
        metavar="X,Y,DEG[,LEVEL]|ROOM|?",
        help="Position and heading of the wearer at the start (level 0 is the plan's first, ? any), a room, or ? for anywhere.",
    ),
]
StartSd = Annotated[
    str | None,
    typer.Option("--start-sd", metavar="M,DEG", help="Standard deviations of the start: metres per axis, degrees."),
]
Out = Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for track.csv, track.png and the recording.")]
SettingsFile = Annotated[Path | None, typer.Option("--settings", metavar="FILE", help="Settings (TOML).")]
Seed = Annotated[int, typer.Option("--seed", help="Seed of all random numbers.", min=0)]
Headless = Annotated[bool, typer.Option("--headless", help="Neither terminal view nor page.")]
Page = Annotated[
    bool | None,
    typer.Option(
        "--page/--no-page",
        help="Serve the live page (the default; --page keeps it after the end of a replay), or do not.",
        show_default=False,
    ),
]
Host = Annotated[
    str,
    typer.Option(
        "--host", metavar="ADDRESS", help="Serve the page to other computers too; its URL then holds a token."
    ),
]
Port = Annotated[
    int | None, typer.Option("--port", help="TCP port of the page [8420, or a free one].", min=0, max=65535)
]
BoardPort = Annotated[
    str | None,
    typer.Option("--board", metavar="PORT", help="Serial port of the sensor board; without it, both are searched for."),
]
MtxPort = Annotated[
    str | None,
    typer.Option("--mtx", metavar="PORT", help="Serial port of the MTx; without one the board's leg gyros are used."),
]
FootPort = Annotated[
    str | None,
    typer.Option("--foot", metavar="PORT", help="Serial port of a foot board, in the place of an MTx."),
]
Foxglove = Annotated[
    str | None,
    typer.Option(
        "--foxglove",
        metavar="[HOST:]PORT",
        help="Serve estimates, echoes and the scene to Foxglove, as 8765; on this computer alone unless a host is given.",
    ),
]
Keep = Annotated[
    int | None,
    typer.Option(
        "--keep",
        metavar="N",
        help="Remove the oldest recordings of the folder until N are left; all are kept without it.",
        min=2,
    ),
]
Publish = Annotated[
    list[str] | None,
    typer.Option(
        "--publish",
        metavar="URL",
        help="Send estimates to a commander: mqtt:// mqtts:// cot+udp:// cot+tcp:// cot+tls:// mesh://; may be given several times.",
    ),
]
Name = Annotated[str, typer.Option("--name", help="The wearer's name, for --publish.")]
Team = Annotated[str, typer.Option("--team", help="The team's name, for --publish.")]


BeaconsPort = Annotated[
    str | None,
    typer.Option("--beacons", metavar="PORT", help="Port of a beacon gateway: serial, or udp://127.0.0.1:9000."),
]
GuideTo = Annotated[
    str | None,
    typer.Option(
        "--guide", metavar="TO", help="Guide the wearer to a room, X,Y[,LEVEL], start, or wearer:NAME of the team."
    ),
]


@app.command()
def demo(
    out: Out = Path("out/demo"),
    headless: Headless = False,
    seed: Seed = 1,
    publish: Publish = None,
    name: Name = "",
    team: Team = "team",
    board_command: Annotated[
        str | None,
        typer.Option(
            "--board-command",
            metavar="COMMAND",
            help="Program that simulates the sensor board; without it the board is simulated in Python.",
        ),
    ] = None,
    guide: Annotated[bool, typer.Option("--guide", help="Simulate beacons, and guide to the end of the walk.")] = False,
    page: Page = None,
    host: Host = LOCAL,
    port: Port = None,
    plan: Annotated[
        Path | None, typer.Option("--plan", help="Walk through the rooms of this plan instead of the demo's.")
    ] = None,
    speed: Annotated[
        float | None,
        typer.Option(
            "--speed",
            metavar="TIMES",
            help="Times real time, for instance 1; 4 on a terminal, else as fast as it can.",
            min=0.1,
            max=100.0,
        ),
    ] = None,
    kit: Annotated[
        Kit,
        typer.Option(help="Parts on the board: of the papers, or of 2026 (not built yet; with --board-command only)."),
    ] = Kit.PAPERS,
    browser: Annotated[
        bool,
        typer.Option("--open/--no-open", help="Open the page in a browser where there is one.", show_default=False),
    ] = True,
) -> None:
    """Track a simulated walk through a simulated building."""
    from echostep.session import demo as demo_run
    from echostep.session.options import OutputOptions

    address, outlet = _page_address(headless, page, host, port), _outlet(publish, name, team)
    output = OutputOptions(out, not headless, address, bool(page), outlet, browser and sys.stdout.isatty())
    demo_run.demo(demo_run.DemoOptions(seed, board_command, guide, plan, speed, kit), output)


@app.command()
def live(
    plan: OptionalPlan = None,
    board: BoardPort = None,
    mtx: MtxPort = None,
    foot: FootPort = None,
    out: Out = Path("out/live"),
    start: Start = None,
    start_sd: StartSd = None,
    settings: SettingsFile = None,
    seed: Seed = 0,
    headless: Headless = False,
    seconds: Annotated[float | None, typer.Option(help="Stop after this many seconds.", min=0.0)] = None,
    page: Page = None,
    host: Host = LOCAL,
    port: Port = None,
    publish: Publish = None,
    name: Name = "",
    team: Team = "team",
    beacons: BeaconsPort = None,
    guide: GuideTo = None,
    keep: Keep = None,
    foxglove: Foxglove = None,
) -> None:
    """Track a wearer live and record everything. With nothing on the foot the board's leg gyros are used."""
    from echostep.session import live as live_run
    from echostep.session.options import OutputOptions, PortOptions, TrackingOptions

    address, outlet = _page_address(headless, page, host, port), _outlet(publish, name, team)
    output = OutputOptions(out, not headless, address, bool(page), outlet, foxglove=_foxglove(foxglove))
    tracking = TrackingOptions(plan, start, start_sd, settings, seed, guide)
    board, mtx, foot = _ports(board, mtx, foot)
    live_run.live(tracking, PortOptions(board, mtx, beacons, seconds, keep, foot), output)


@app.command()
def record(
    board: BoardPort = None,
    mtx: MtxPort = None,
    foot: FootPort = None,
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="The recording to write.")] = Path(
        "out/recording.mcap"
    ),
    seconds: Annotated[float | None, typer.Option(help="Stop after this many seconds.", min=0.0)] = None,
    beacons: BeaconsPort = None,
    keep: Keep = None,
) -> None:
    """Record the ports without tracking."""
    from echostep.session import live as live_run
    from echostep.session.options import PortOptions

    board, mtx, foot = _ports(board, mtx, foot)
    live_run.record(PortOptions(board, mtx, beacons, seconds, keep, foot), out)


@app.command()
def replay(
    recording: Annotated[Path, typer.Argument(help="A recording (.mcap).")],
    plan: OptionalPlan = None,
    out: Out = Path("out/replay"),
    start: Start = None,
    start_sd: StartSd = None,
    settings: SettingsFile = None,
    seed: Annotated[int | None, typer.Option("--seed", help="Seed; the recorded one by default.", min=0)] = None,
    truth: Annotated[
        Path | None, typer.Option("--truth", metavar="FILE", help="True path to compare with (CSV).")
    ] = None,
    headless: Headless = False,
    page: Page = None,
    host: Host = LOCAL,
    port: Port = None,
    publish: Publish = None,
    name: Name = "",
    team: Team = "team",
    guide: GuideTo = None,
    foxglove: Foxglove = None,
) -> None:
    """Track a recorded walk again, as it was tracked live."""
    from echostep.session import replay as replay_run
    from echostep.session.options import OutputOptions, TrackingOptions

    address, outlet = _page_address(headless, page, host, port), _outlet(publish, name, team)
    output = OutputOptions(
        out, not headless, address, bool(page) or sys.stdout.isatty(), outlet, foxglove=_foxglove(foxglove)
    )
    replay_run.replay(recording, TrackingOptions(plan, start, start_sd, settings, seed, guide), truth, output)


@app.command("map")
def map_command(
    recordings: Annotated[
        list[Path], typer.Argument(metavar="WALK...", help="Recorded walks (.mcap) through one building.")
    ],
    out: Annotated[Path, typer.Option("-o", "--out", metavar="PLAN", help="The plan to write (JSON).")],
    plan: Annotated[
        Path | None,
        typer.Option("--plan", metavar="PARTIAL", help="A partial or old plan, which the walks complete and correct."),
    ] = None,
    picture: Annotated[
        Path | None, typer.Option("--picture", metavar="FILE", help="Draw plan and path there (PNG, SVG).")
    ] = None,
) -> None:
    """Draw the plan of a building from recorded walks."""
    from echostep.commands import mapping

    mapping.map_recordings(recordings, plan, out, picture)


@app.command()
def foot(
    imu: Annotated[Path, typer.Argument(help="CSV: t_s,ax,ay,az,gx,gy,gz[,mx,my,mz] in s, m/s2, rad/s.")],
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="The track to write (CSV).")] = Path("track.csv"),
    profile: Annotated[
        str, typer.Option("--profile", metavar="NAME", help="default, or fischer2008: that paper's dead reckoning.")
    ] = "default",
    plot: Annotated[bool, typer.Option("--plot", help="Draw the track as PNG, beside the CSV.")] = False,
) -> None:
    """Zero-velocity navigation of a recorded foot IMU."""
    from echostep.commands import offline

    offline.foot(imu, out, profile, plot=plot)


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
    thigh: Annotated[float, typer.Option("--thigh", metavar="M", help="Hip to knee, metres.")],
    shank: Annotated[float, typer.Option("--shank", metavar="M", help="Knee to ankle, or to the floor, metres.")],
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="The track to write (CSV).")] = Path("track.csv"),
    profile: Annotated[
        str, typer.Option("--profile", metavar="NAME", help="default, or lee2010: that paper's method.")
    ] = "default",
    scale: Annotated[
        float | None, typer.Option("--scale", help="The wearer's stride scale, as --walked printed it.")
    ] = None,
    walked: Annotated[
        float | None,
        typer.Option("--walked", metavar="M", help="The true length of this walk: print the wearer's scale."),
    ] = None,
    plot: Annotated[bool, typer.Option("--plot", help="Draw track and strides as PNG, beside the CSV.")] = False,
) -> None:
    """Distance, strides and track from recorded leg gyros: on thigh and shank, and on the belt if there is one."""
    from echostep.commands import offline

    offline.legs(samples, out, offline.LegOptions(thigh, shank, profile, scale, walked), plot=plot)


@app.command()
def command(
    broker: Annotated[
        str,
        typer.Argument(
            metavar="URL",
            help="mqtt://HOST[:PORT], mqtts://HOST[:PORT]?ca=FILE, mesh:///dev/PORT, or a recorded operation (.mcap)",
        ),
    ],
    plan: Plan,
    out: Annotated[
        Path, typer.Option("--out", "-o", metavar="FILE", help="The recording to write; each run gets a new number.")
    ] = Path("out/command/operation.mcap"),
    team: Annotated[str | None, typer.Option("--team", help="Only this team.")] = None,
    seconds: Annotated[float | None, typer.Option(help="Stop after this many seconds.", min=0.0)] = None,
    picture: Annotated[
        Path | None,
        typer.Option("--picture", metavar="FILE", help="Draw the team on its plan at the end: .png or .svg."),
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the roster as JSON at the end, instead of the table.")
    ] = False,
    page: Annotated[bool, typer.Option("--page/--no-page", help="Serve the commander's page, or do not.")] = True,
    host: Host = LOCAL,
    port: Port = None,
) -> None:
    """Follow a team on one plan, lost and silent ones first, on a page and as a table, and record it; or show a recording again."""
    from echostep.operation import command as commander
    from echostep.operation.views import Views
    from echostep.page.server import Address

    views = Views(Address(host, port) if page else None, picture, as_json=as_json)
    commander.command(plan, broker, team, seconds, views, out)


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
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="The floors to write (CSV).")] = Path("floors.csv"),
    start: Annotated[
        int | None, typer.Option("--start", metavar="FLOOR", help="Floor at the start, if known.", min=0)
    ] = None,
    plot: Annotated[bool, typer.Option("--plot", help="Draw the floors as PNG, beside the CSV.")] = False,
) -> None:
    """Floors of a recorded barometer. Writes t_s,floor,probability,height_m; a floor is the index into --heights, from 0."""
    from echostep.commands import floors as floor_run

    floor_run.floors(pressure, heights, out, start, plot=plot)


@app.command()
def score(
    tracks: Annotated[
        list[Path],
        typer.Argument(metavar="TRACK...", help="CSV of any tracker: columns t_s, x_m, y_m, and more by their names."),
    ],
    truth: Annotated[
        Path, typer.Option("--truth", metavar="FILE", help="True path, or surveyed points (CSV), on the same clock.")
    ],
    plan: Annotated[
        Path | None, typer.Option("--plan", help="The building's plan, for floors by height, zones and the picture.")
    ] = None,
    html: Annotated[
        Path | None, typer.Option("--html", metavar="FILE", help="Write a page with the table and the pictures.")
    ] = None,
    setup: Annotated[
        float | None, typer.Option("--setup", metavar="S", help="Set-up time of the system, to be listed.", min=0.0)
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of the table.")] = False,
) -> None:
    """Score tracks against the truth by ISO/IEC 18305 and EvAAL."""
    from echostep.commands import score as scoring

    scoring.score(tracks, truth, plan, html, setup, as_json=as_json)


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
    from echostep.commands import offline

    offline.decode(file, output_mode, output_settings)


@app.command()
def doctor(
    board: Annotated[str | None, typer.Option("--board", metavar="PORT", help="Port of the board.")] = None,
    mtx: Annotated[str | None, typer.Option("--mtx", metavar="PORT", help="Port of the MTx.")] = None,
    foot: Annotated[str | None, typer.Option("--foot", metavar="PORT", help="Port of a foot board.")] = None,
    seconds: Annotated[float, typer.Option(help="Seconds to listen.", min=3.0, max=3600.0)] = 6.0,
    udev: Annotated[bool, typer.Option("--udev", help="Only print the udev rules.")] = False,
) -> None:
    """Check ports, boards and MTx, and say what to do about each fault. Exit status 1 when there is a fault."""
    from echostep.commissioning import doctor as examination

    if udev:
        typer.echo(examination.rules_text(), nl=False)
    elif not examination.run(board, mtx, seconds, foot):
        raise typer.Exit(1)


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
    from rich.console import Console

    from echostep.commissioning import flash as flashing

    flashing.flash(port, hex_file, Console(soft_wrap=True, highlight=False))


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
) -> None:
    """Calibrate gyros, mounting, compass and legs, or the accelerometers. Writes the results as settings."""
    from rich.console import Console

    from echostep.commissioning import calibrate as calibration

    wearer = calibration.Wearer(thigh, shank, walked)
    calibration.calibrate(
        calibration.Ports(board, foot), parts or [], wearer, out, Console(soft_wrap=True, highlight=False)
    )


def _outlet(publish: list[str] | None, name: str, team: str) -> Outlet | None:
    from echostep.team.endpoint import parse_outlet

    return parse_outlet(publish, name, team) if publish else None


def _foxglove(text: str | None) -> FoxgloveAddress | None:
    from echostep.output.foxglove_live import parse_address

    return None if text is None else parse_address(text)


def _ports(board: str | None, mtx: str | None, foot: str | None) -> tuple[str, str | None, str | None]:
    """The given ports of board, MTx and foot board; without the board's, all are searched for and printed."""
    if board is not None:
        return board, mtx, foot
    from echostep.commissioning.port_search import find_ports

    found = find_ports(mtx, foot)
    options = {"board": found.board, "mtx": found.mtx, "foot": found.foot}
    typer.echo("Ports: " + " ".join(f"--{name} {path}" for name, path in options.items() if path))
    if not found.mtx and not found.foot:
        typer.echo("Neither an MTx nor a foot board was found.")
    return found.board, found.mtx, found.foot


def _page_address(headless: bool, page: bool | None, host: str, port: int | None) -> Address | None:
    """Where to serve the page; None: no page."""
    from echostep.page.server import Address

    if headless and page:
        raise EchostepError("--headless excludes --page: give one of the two")
    return None if headless or page is False else Address(host, port)


def main() -> None:
    """Entry point: a mistake ends with one line and status 2; signals end a run after its files are written."""
    end_by_signals()
    try:
        app()
    except EchostepError as error:
        print(f"echostep: {error}", file=sys.stderr)
        sys.exit(2)
    except BrokenPipeError:
        sys.stderr.close()
        sys.exit(0)
    except OSError as error:
        print(f"echostep: {error.filename or 'a file'}: {error.strerror or error}", file=sys.stderr)
        sys.exit(2)
    except KeyboardInterrupt:
        sys.exit(130)
