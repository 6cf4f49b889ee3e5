# SPDX-License-Identifier: MIT
"""`echostep acceptance`: the walk by which a wearer measures the tracker.

In: the command's arguments and options. Out: a recording and its page. Slow imports wait until the command runs.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from echostep.errors import EchostepError
from echostep_app.commands.groups import Ports, with_groups
from echostep_app.commands.options import (
    LOCAL,
    BoardPort,
    FootPort,
    Host,
    MtxPort,
    Page,
    Port,
    SettingsFile,
    page_address,
)
from echostep_app.extras import require
from echostep_app.printing.lines import say

if TYPE_CHECKING:
    from echostep_app.session.acceptance.protocol import Protocol

app = typer.Typer()
HALF_HOUR_S = 1800.0  # of the walk, unless the rounds are given


@dataclass(frozen=True, slots=True)
class Where:
    """Where the points are, or which recording has them."""

    corridor: Annotated[
        str | None,
        typer.Option("--corridor", metavar="LENGTHxWIDTH", help="A corridor by its lengths in metres, as 20x2.05."),
    ] = None
    plan: Annotated[
        Path | None,
        typer.Option("--plan", metavar="FILE", help="The building's plan, with --points, instead of a corridor."),
    ] = None
    points: Annotated[
        Path | None,
        typer.Option("--points", metavar="FILE", help="Points in the order of the way (CSV: name,x_m,y_m[,level])."),
    ] = None
    recording: Annotated[
        Path | None, typer.Option("--recording", metavar="FILE", help="Only make the page of this recording again.")
    ] = None

    def check(self) -> None:
        """Raise EchostepError unless one place is given, or a recording."""
        given = (self.corridor is not None, self.plan is not None, self.points is not None, self.recording is not None)
        if given not in ((True, False, False, False), (False, True, True, False), (False, False, False, True)):
            raise EchostepError("give --corridor LENGTHxWIDTH, or --plan FILE with --points FILE, or --recording FILE")

    def protocol(self) -> Protocol:
        """The protocol of the corridor or of the points."""
        from echostep_app.session.acceptance.survey import corridor, surveyed

        if self.corridor is not None:
            return corridor(self.corridor)
        assert self.plan
        assert self.points
        return surveyed(self.plan, self.points)


@app.command()
@with_groups
def acceptance(
    where: Where,
    rounds: Annotated[
        int | None,
        typer.Option("--rounds", help="How often there and back; without it, for half an hour.", min=1, max=1000),
    ] = None,
    board: BoardPort = None,
    mtx: MtxPort = None,
    foot: FootPort = None,
    settings: SettingsFile = None,
    page: Page = None,
    host: Host = LOCAL,
    port: Port = None,
    out: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="Folder for plan, recording, track and page.")
    ] = Path("out/acceptance"),
) -> None:
    """Walk half an hour from point to point and tap each: makes a page of errors, echoes, clocks and losses."""
    where.check()
    require("acceptance", "matplotlib")
    if where.recording is not None:
        from echostep_app.session.acceptance.page import write_page

        say(*write_page(where.recording))
        return
    from echostep_app.session.acceptance.run import acceptance as accept
    from echostep_app.session.options import OutputOptions

    protocol, address = where.protocol(), page_address(page, host, port)
    output = OutputOptions(out, terminal=False, page=address)
    ports = Ports(board, mtx, foot).options()
    say(*accept(protocol, rounds or protocol.rounds_of(HALF_HOUR_S), ports, output, settings))
