# SPDX-License-Identifier: MIT
"""`echostep command OPERATION.mcap`: a recorded operation, shown again by the code that showed it live.

In: a recording, a plan. Out: the page, the final table, the roster as JSON. Owns the loop. The page can be used while the file is read.
`Views`: where a team is shown, live too.
"""

from __future__ import annotations

import json
import math
import sys
import time
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from echostep.errors import EchostepError
from echostep.plan import Plan
from echostep.recording import open_recording
from echostep_app.operation.operation import Operation
from echostep_app.operation.recorded.player import Player, load
from echostep_app.operation.recorded.record import KIND
from echostep_app.operation.recorded.tape import Tape
from echostep_app.page.protocol import FRAME_S
from echostep_app.team.commander import as_tree, table

if TYPE_CHECKING:
    from echostep_app.operation.page import TablePage
    from echostep_app.page.server import Address


@dataclass(frozen=True, slots=True)
class Views:
    """`page` None: no page. `as_json`: the roster at the end, instead of the table."""

    page: Address | None = None
    as_json: bool = False

    def open_page(
        self, opened: ExitStack, operation: Operation, title: str, tape: Tape, console: Console
    ) -> TablePage | None:
        """The page, served until `opened` is closed, and its address printed; None where there is none."""
        if self.page is None:
            return None
        from echostep_app.operation.page import TablePage
        from echostep_app.page.web.addresses import print_page

        page = opened.enter_context(TablePage(operation, title, self.page, tape))
        print_page(console, page.server.urls)
        return page

    def finish(self, operation: Operation, now_s: float) -> None:
        """Print the roster where asked for; `now_s` on the operation's clock."""
        if self.as_json:
            sys.stdout.write(json.dumps(as_tree(operation.roster, operation.plan, now_s), indent=2) + "\n")


def replay(path: Path, plan: Plan, seconds: float | None, views: Views, console: Console) -> None:
    """Show a recorded operation until Ctrl-C, or for `seconds` after it has been read; without a page, its end."""
    metadata = open_recording(path).metadata
    if metadata.get("kind") != KIND:
        raise EchostepError(f"{path}: no recorded operation; echostep replay shows recorded walks")
    if metadata.get("plan_sha256") != plan.digest:
        console.print(
            f"{path}: it was recorded on another plan: wearers are listed, not shown on this one", markup=False
        )
    operation, tape = Operation(plan), Tape(path, grows=False)
    with ExitStack() as opened:
        page = views.open_page(opened, operation, "echostep command, recorded", tape, console)
        with suppress(KeyboardInterrupt):
            player = _read(tape, operation, page)
            if player is None:
                raise EchostepError(f"{path}: nothing of the operation can be read")
            _say(player, console)
            if page:
                _serve(player, page, math.inf if seconds is None else seconds)
    if not views.as_json:
        lines = table(operation.roster, plan, tape.end_s, connected=True, columns=console.width)
        console.print(lines)
    views.finish(operation, tape.end_s)


def _read(tape: Tape, operation: Operation, page: TablePage | None) -> Player | None:
    """Read the whole file; the page is shown what is read at most 30 times a second. Returns the player at the end."""
    shown_s, player = -math.inf, None
    for player in load(tape, operation):
        if page and time.monotonic() - shown_s >= FRAME_S:
            shown_s = time.monotonic()
            page.feed.publish(player.scene())
    return player


def _serve(player: Player, page: TablePage, seconds: float) -> None:
    """Wake the pages 30 times a second: each plays on by itself."""
    end_s, scene = time.monotonic() + seconds, player.scene()
    while time.monotonic() < end_s:
        page.feed.publish(scene)
        time.sleep(FRAME_S)


def _say(player: Player, console: Console) -> None:
    """What is wrong with the file."""
    file = player.file
    if file.own_damage.truncated:
        console.print(f"{file.path}: it was not closed: it is shown up to its last whole record", markup=False)
    if file.own_damage.altered or file.own_damage.places or file.own_damage.unreadable_chunks or player.unknown:
        console.print(f"{file.path}: damaged; echostep info {file.path} says where", markup=False)
