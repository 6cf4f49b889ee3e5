# SPDX-License-Identifier: MIT
"""`echostep command OPERATION.mcap`: a recorded operation, shown again by the code that showed it live.

In: a recording, a plan. Out: the page, the final table, the roster as JSON. Owns the loop. The page can be used while the file is read.
`Views`: where a team is shown, live too.
"""

from __future__ import annotations

import json
import math
import sys
from collections import deque
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from echostep.errors import EchostepError
from echostep.plan import Plan
from echostep.recording import open_recording
from echostep_app.interruption import sleep
from echostep_app.operation.operation import Operation
from echostep_app.operation.recorded.record import KIND
from echostep_app.operation.recorded.tape import OperationTape, Reader
from echostep_app.operation.terminal import listed
from echostep_app.team.commander import as_tree

if TYPE_CHECKING:
    from echostep_app.operation.page import TablePage
    from echostep_app.page.server import Address


@dataclass(frozen=True, slots=True)
class Views:
    """`page` None: no page. `as_json`: the roster at the end, instead of the table."""

    page: Address | None = None
    as_json: bool = False

    def open_page(
        self, opened: ExitStack, operation: Operation, title: str, console: Console, tape: OperationTape | None = None
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
    tape = OperationTape(path, Operation(plan))
    with ExitStack() as opened:
        page = views.open_page(opened, tape.operation, "echostep command, recorded", console, tape)
        with suppress(KeyboardInterrupt):
            reader = next(iter(deque(tape.read(), maxlen=1)), None)  # it is at the end
            if reader is None:
                raise EchostepError(f"{path}: nothing of the operation can be read")
            _say(reader, console)
            if page:
                sleep(math.inf if seconds is None else seconds)
    end_s = (tape.span_s or (0.0, 0.0))[1]
    if not views.as_json:
        console.print(listed(tape.operation.scene(end_s, 0.0), plan.name))
    views.finish(tape.operation, end_s)


def _say(reader: Reader, console: Console) -> None:
    """What is wrong with the file."""
    file = reader.file
    if file.own_damage.truncated:
        console.print(f"{file.path}: it was not closed: it is shown up to its last whole record", markup=False)
    if file.own_damage.altered or file.own_damage.places or file.own_damage.unreadable_chunks or reader.unknown:
        console.print(f"{file.path}: damaged; echostep info {file.path} says where", markup=False)
