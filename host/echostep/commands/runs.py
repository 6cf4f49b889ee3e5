# SPDX-License-Identifier: MIT
"""`echostep demo`, `live`, `record` and `replay`: runs that track or record a wearer.

In: the command's arguments and options. Out: files, views. Slow imports wait until a command runs.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from echostep.commands.options import (
    LOCAL,
    BeaconsPort,
    BoardCommand,
    BoardPort,
    FootPort,
    Foxglove,
    GuideTo,
    Headless,
    Host,
    Keep,
    MtxPort,
    Name,
    OptionalPlan,
    Out,
    Page,
    Port,
    Publish,
    RecordedSeed,
    Seconds,
    Seed,
    SettingsFile,
    Start,
    StartSd,
    Team,
    page_address,
)
from echostep.errors import EchostepError
from echostep.simulation.kits import Kit

if TYPE_CHECKING:
    from echostep.output.foxglove_live import FoxgloveAddress
    from echostep.page.server import Address
    from echostep.team.endpoint import Outlet

app = typer.Typer()


@app.command()
def demo(
    out: Out = Path("out/demo"),
    headless: Headless = False,
    seed: Seed = 1,
    publish: Publish = None,
    name: Name = "",
    team: Team = "team",
    board_command: BoardCommand = None,
    guide: Annotated[bool, typer.Option("--guide", help="Simulate beacons, and guide to the end of the walk.")] = False,
    page: Page = None,
    host: Host = LOCAL,
    port: Port = None,
    plan: Annotated[
        Path | None,
        typer.Option(
            "--plan",
            metavar="FILE|wearer:NAME",
            help="Walk through the rooms of this plan instead of the demo's, or of what that wearer of the team has drawn by now.",
        ),
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
    from echostep.session.options import OutputOptions
    from echostep.session.runs import demo as demo_run

    address, outlet = _page_address(headless, page, host, port), _outlet(publish, name, team)
    output = OutputOptions(out, not headless, address, bool(page), outlet, browser and sys.stdout.isatty())
    plan = _plan_file(plan, outlet, out)
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
    seconds: Seconds = None,
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
    from echostep.session.options import OutputOptions, PortOptions, TrackingOptions
    from echostep.session.runs import live as live_run

    address, outlet = _page_address(headless, page, host, port), _outlet(publish, name, team)
    output = OutputOptions(out, not headless, address, bool(page), outlet, foxglove=_foxglove(foxglove))
    tracking = TrackingOptions(_plan_file(plan, outlet, out), start, start_sd, settings, seed, guide)
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
    seconds: Seconds = None,
    beacons: BeaconsPort = None,
    keep: Keep = None,
) -> None:
    """Record the ports without tracking."""
    from echostep.session.options import PortOptions
    from echostep.session.runs import live as live_run

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
    seed: RecordedSeed = None,
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
    from echostep.session.options import OutputOptions, TrackingOptions
    from echostep.session.runs import replay as replay_run

    address, outlet = _page_address(headless, page, host, port), _outlet(publish, name, team)
    output = OutputOptions(
        out, not headless, address, bool(page) or sys.stdout.isatty(), outlet, foxglove=_foxglove(foxglove)
    )
    replay_run.replay(
        recording, TrackingOptions(_recorded_plan(plan), start, start_sd, settings, seed, guide), truth, output
    )


def _outlet(publish: list[str] | None, name: str, team: str) -> Outlet | None:
    from echostep.team.endpoint import parse_outlet

    return parse_outlet(publish, name, team) if publish else None


def _plan_file(plan: Path | None, outlet: Outlet | None, folder: Path) -> Path | None:
    """The file of `--plan`; that of wearer:NAME comes from the broker that the run publishes to, into the folder of its results."""
    if plan is None:
        return None
    from echostep.team.wearer_plan import plan_file

    return plan_file(plan, outlet.broker if outlet else None, outlet.team if outlet else "", folder, typer.echo)


def _recorded_plan(plan: Path | None) -> Path | None:
    """The file of a replay's `--plan`."""
    if plan is None:
        return None
    from echostep.team.wearer_plan import drawing_wearer

    if name := drawing_wearer(plan):
        raise EchostepError(
            f"--plan {plan}: a replay needs the drawing that the run was tracked on: the file drawing-{name}-... beside the recording"
        )
    return plan


def _foxglove(text: str | None) -> FoxgloveAddress | None:
    from echostep.output.foxglove_live import parse_address

    return None if text is None else parse_address(text)


def _ports(board: str | None, mtx: str | None, foot: str | None) -> tuple[str, str | None, str | None]:
    """The given ports of board, MTx and foot board; without the board's, all are searched for and printed."""
    if board is not None:
        return board, mtx, foot
    from echostep.commissioning.port_search import find_ports

    ports = find_ports(mtx, foot)
    options = {"board": ports.board, "mtx": ports.mtx, "foot": ports.foot}
    typer.echo("Ports: " + " ".join(f"--{name} {path}" for name, path in options.items() if path))
    if not ports.mtx and not ports.foot:
        typer.echo("Neither an MTx nor a foot board was found.")
    return ports.board, ports.mtx, ports.foot


def _page_address(headless: bool, page: bool | None, host: str, port: int | None) -> Address | None:
    """Where to serve the page; None: no page."""
    if headless and page:
        raise EchostepError("--headless excludes --page: give one of the two")
    return None if headless else page_address(page, host, port)
