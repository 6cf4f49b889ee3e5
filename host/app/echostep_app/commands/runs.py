# SPDX-License-Identifier: MIT
"""`echostep demo`, `live`, `record`, `replay`, `page` and `command`: runs that track or record a wearer, or follow a team.

In: the command's arguments and options. Out: files, views. Slow imports wait until a command runs.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from echostep_app.commands.groups import Output, Ports, Tracking, with_groups
from echostep_app.commands.options import (
    LOCAL,
    BoardCommand,
    Browser,
    Host,
    Lang,
    Out,
    Plan,
    Port,
    RecordedSeed,
    Seconds,
    Seed,
    example,
    out_option,
    page_address,
)
from echostep_simulation.kits import Kit

app = typer.Typer()


@app.command(epilog=example("echostep demo --out out/demo --seed 2"))
@with_groups
def demo(
    output: Output,
    out: Out = Path("out/demo"),
    seed: Seed = 1,
    board_command: BoardCommand = None,
    guide: Annotated[bool, typer.Option("--guide", help="Simulate beacons, and guide to the end of the walk.")] = False,
    plan: Annotated[
        Path | None,
        typer.Option(
            "--plan",
            metavar="FILE",
            help="Walk through the rooms of this plan instead of the demo's.",
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
    celsius: Annotated[float, typer.Option(help="Temperature of the air, degC.", min=-20.0, max=60.0)] = 20.0,
    browser: Browser = True,
) -> None:
    """Track a simulated walk through a simulated building."""
    from echostep_app.session.runs import demo as demo_run

    outputs = output.options(out, browser=browser)
    demo_run.demo(demo_run.DemoOptions(seed, board_command, guide, plan, speed, kit, celsius), outputs)


@app.command(epilog=example("echostep live --plan plan.json --board /dev/ttyACM0 --mtx /dev/ttyUSB0 --start 2,7.5,0"))
@with_groups
def live(
    tracking: Tracking,
    ports: Ports,
    output: Output,
    out: Out = Path("out/live"),
    seed: Seed = 0,
) -> None:
    """Track a wearer live and record everything. With nothing on the foot the board's leg gyros are used. --start last: where the last run ended."""
    from echostep_app.session.runs import live as live_run

    outputs = output.options(out)
    live_run.live(tracking.options(seed), ports.options(), outputs)


@app.command(epilog=example("echostep record --board /dev/ttyACM0 --seconds 60 -o walk.mcap"))
@with_groups
def record(
    ports: Ports,
    out: Annotated[Path, out_option("FILE", "The recording to write.")] = Path("out/recording.mcap"),
) -> None:
    """Record the ports without tracking."""
    from echostep_app.session.runs import live as live_run

    live_run.record(ports.options(), out)


@app.command(epilog=example("echostep replay out/live/walk.mcap --plan plan.json --start Lab"))
@with_groups
def replay(
    recording: Annotated[
        list[Path],
        typer.Argument(metavar="RECORDING...", help="A recording (.mcap), or all parts of one, or their folder."),
    ],
    tracking: Tracking,
    output: Output,
    out: Out = Path("out/replay"),
    seed: RecordedSeed = None,
    truth: Annotated[
        Path | None, typer.Option("--truth", metavar="FILE", help="True path to compare with (CSV).")
    ] = None,
    browser: Browser = True,
) -> None:
    """Track a recorded walk again, as it was tracked live."""
    from echostep_app.commands.actions.foreign import refuse_foreign
    from echostep_app.session.runs import replay as replay_run

    refuse_foreign(recording)
    outputs = output.options(out, stays_on_terminal=True, browser=browser)
    replay_run.replay(recording, tracking.options(seed), truth, outputs)


@app.command()
def page(
    host: Host = LOCAL,
    port: Port = None,
    lang: Lang = None,
    browser: Browser = True,
) -> None:
    """Play recordings that are dropped onto a page."""
    address = page_address(True, host, port, lang)
    from echostep_app.session.runs.dropped import serve_drops

    assert address
    serve_drops(address, browser=browser)


@app.command()
def command(
    broker: Annotated[
        str,
        typer.Argument(
            metavar="URL",
            help="mqtt://HOST[:PORT], mqtts://HOST[:PORT]?ca=FILE, or a recorded operation (.mcap)",
        ),
    ],
    plan: Plan,
    out: Annotated[Path, out_option("FILE", "The recording to write; each run gets a new number.")] = Path(
        "out/command/operation.mcap"
    ),
    team: Annotated[str | None, typer.Option("--team", help="Only this team.")] = None,
    seconds: Seconds = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the roster as JSON at the end, instead of the table.")
    ] = False,
    page: Annotated[
        bool | None,
        typer.Option(
            "--page/--no-page", help="Serve the commander's page (the default), or do not.", show_default=False
        ),
    ] = None,
    host: Host = LOCAL,
    port: Port = None,
    lang: Lang = None,
) -> None:
    """Follow a team on one plan, lost and silent ones first, on a page and as a table, and record it; or show a recording again."""
    from echostep_app.operation import command as commander
    from echostep_app.operation.recorded.replay import Views

    views = Views(page_address(page, host, port, lang), as_json=as_json)
    commander.command(plan, broker, team, seconds, views, out)
