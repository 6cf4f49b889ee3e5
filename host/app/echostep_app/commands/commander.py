# SPDX-License-Identifier: MIT
"""`echostep command`: the commander's table, live or of a recorded operation.

In: the command's arguments and options. Out: a page, a table, a recording. Slow imports wait until a command runs.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from echostep_app.commands.options import LOCAL, Host, Lang, Plan, Port, Seconds, out_option, page_address

app = typer.Typer()


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
