# SPDX-License-Identifier: MIT
"""`echostep command`: follow a team on one plan, on a page and on the terminal.

In: a plan, a broker's URL. Out: the page, a table on the terminal, a picture, the roster as JSON. Owns the loop: it empties the inbox and
shows the scene 30 times a second, and draws the table four times.
"""

from __future__ import annotations

import json
import math
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.live import Live

from echostep.errors import EchostepError
from echostep.operation.operation import Operation
from echostep.operation.page import TablePage
from echostep.page.guarded_socket import FRAME_S
from echostep.page.server import Address
from echostep.plan.model import Plan, load_plan
from echostep.team.commander import as_tree, table
from echostep.team.endpoint import Endpoint, parse_endpoint
from echostep.team.inbox import Inbox, Receiver
from echostep.team.marks import ALL
from echostep.team.mqtt import Listener
from echostep.team.picture import draw_team
from echostep.team.report import checked_name

TABLE_S = 0.25  # between two drawings of the table, by reason


@dataclass(frozen=True, slots=True)
class Views:
    """Where a team is shown. `page` None: no page. `picture`: drawn at the end. `as_json`: the roster at the end, instead of the table."""

    page: Address | None = None
    picture: Path | None = None
    as_json: bool = False


def command(plan_path: Path, url: str, team: str | None, seconds: float | None, views: Views) -> None:
    """Show a team until Ctrl-C, or for `seconds`; then draw the picture and print JSON if asked for."""
    endpoint = parse_endpoint(url, ("mqtt", "mqtts", "mesh"))
    if views.picture and views.picture.suffix not in (".png", ".svg"):
        raise EchostepError(f"--picture {views.picture}: expected a name that ends in .png or .svg")
    operation = Operation(load_plan(plan_path))
    console = Console(soft_wrap=True, stderr=views.as_json)
    inbox = Inbox()
    with ExitStack() as opened:
        page = opened.enter_context(TablePage(operation, "echostep command", views.page)) if views.page else None
        if page:
            console.print(f"The page: {page.url}", highlight=False)
        receiver = _receiver(endpoint, team, operation.plan, inbox, lambda text: console.print(text, markup=False))
        opened.callback(receiver.close)
        if page and endpoint.scheme != "mesh":  # marks need a broker
            page.feed.send = receiver.send
        with suppress(KeyboardInterrupt):
            _follow(operation, inbox, receiver, page, console, math.inf if seconds is None else seconds, views)
    operation.update(inbox, time.monotonic(), time.time())
    _finish(operation, views)


def _receiver(
    endpoint: Endpoint, team: str | None, plan: Plan, inbox: Inbox, print_line: Callable[[str], None]
) -> Receiver:
    """A subscription to the reports of a team, or of all teams: at a broker, or over a Meshtastic node."""
    if endpoint.scheme == "mesh":
        from echostep.team.mesh import MeshListener

        listener = MeshListener(endpoint, checked_name("--team", team) if team else None, plan, inbox.put)
        return Receiver(listener, lambda text: print_line(f"{endpoint}: {text}"))
    topics = [f"echostep/{checked_name('--team', team) if team else '+'}/+/+", ALL]
    return Receiver(Listener(endpoint, topics, inbox.put), lambda text: print_line(f"{endpoint}: {text}"))


def _follow(
    operation: Operation, inbox: Inbox, receiver: Receiver, page: TablePage | None, console: Console, seconds: float,
    views: Views,
) -> None:  # fmt: skip
    """Show the team for so many seconds."""
    end_s, table_s = time.monotonic() + seconds, -math.inf
    pause_s = FRAME_S if page else TABLE_S
    with Live(console=console, auto_refresh=False, transient=False, redirect_stdout=False) as shown:
        while (now_s := time.monotonic()) < end_s:
            time.sleep(min(pause_s, max(end_s - now_s, 0.0)))
            now_s, connected = time.monotonic(), receiver.connected
            operation.update(inbox, now_s, time.time())
            if page:
                page.publish(operation.scene(now_s, time.time(), connected=connected))
                while page.notices:
                    console.print(page.notices.popleft(), markup=False)
            if not views.as_json and now_s - table_s >= TABLE_S:
                table_s = now_s
                lines = table(operation.roster, operation.plan, now_s, connected=connected, columns=console.width)
                shown.update(lines, refresh=True)


def _finish(operation: Operation, views: Views) -> None:
    """Draw the picture and print the roster, where asked for."""
    now_s, roster, plan = time.monotonic(), operation.roster, operation.plan
    if views.picture:
        draw_team(views.picture, plan, roster.members(now_s), now_s)
    if views.as_json:
        json.dump(as_tree(roster, plan, now_s), sys.stdout, indent=2)
        sys.stdout.write("\n")
