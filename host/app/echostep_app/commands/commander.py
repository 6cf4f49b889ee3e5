# SPDX-License-Identifier: MIT
"""`echostep command`: the commander's table, live or of a recorded operation.

In: the command's arguments and options. Out: a page, a table, a recording. Slow imports wait until a command runs.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from echostep_app.commands.options import LOCAL, Host, Lang, Port, Seconds, TeamPlan, page_address
from echostep_app.printing.lines import complain

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
    plan: TeamPlan,
    out: Annotated[
        Path, typer.Option("--out", "-o", metavar="FILE", help="The recording to write; each run gets a new number.")
    ] = Path("out/command/operation.mcap"),
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
    commander.command(_plan_file(plan, broker, team, out.parent), broker, team, seconds, views, out)


def _plan_file(plan: Path, url: str, team: str | None, folder: Path) -> Path:
    """The file of `--plan`; that of wearer:NAME comes from the broker at `url`, of any team unless one is given."""
    from echostep_app.team.endpoint import BROKERS, parse_endpoint
    from echostep_app.team.messages.report import checked_name
    from echostep_app.team.wearer_plan import drawing_wearer, plan_file

    if drawing_wearer(plan) is None:
        return plan
    broker = parse_endpoint(url) if url.startswith(tuple(f"{scheme}://" for scheme in BROKERS)) else None
    path = plan_file(plan, broker, checked_name("--team", team) if team else "+", folder, complain)
    assert path is not None
    return path
