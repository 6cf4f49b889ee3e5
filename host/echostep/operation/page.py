# SPDX-License-Identifier: MIT
"""The commander's page: an operation served to browsers.

In: an operation, an address, options of the command. Out: the page, a picture, the roster as JSON. Owns the
server. Server, guards and style are those of the live page (`echostep.page`).
"""

from __future__ import annotations

import json
import sys
from collections import deque
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

from starlette.websockets import WebSocket

from echostep.operation.operation import Operation, TableScene
from echostep.operation.session import TableFeed, TableSession
from echostep.operation.tape import Tape
from echostep.page.server import STATIC, Address, Site, SocketServer
from echostep.page.shared import PageCounts
from echostep.page.web.faults import Faults
from echostep.team.commander import as_tree
from echostep.team.picture import draw_team

TABLE = Path(__file__).parent / "static"


@dataclass(frozen=True, slots=True)
class Views:
    """Where a team is shown. `page` None: no page. `picture`: drawn at the end. `as_json`: the roster at the end, instead of the table."""

    page: Address | None = None
    picture: Path | None = None
    as_json: bool = False


def finish(operation: Operation, now_s: float, views: Views) -> None:
    """Draw the picture and print the roster, where asked for; `now_s` on the operation's clock."""
    roster, plan = operation.roster, operation.plan
    if views.picture:
        draw_team(views.picture, plan, roster.members(now_s), now_s)
    if views.as_json:
        json.dump(as_tree(roster, plan, now_s), sys.stdout, indent=2)
        sys.stdout.write("\n")


class TablePage:
    """Serves the scenes that are published until it is closed; raises EchostepError when it cannot listen at the address."""

    def __init__(self, operation: Operation, title: str, address: Address, tape: Tape | None = None) -> None:
        self.feed = feed = TableFeed(operation, title, tape)
        faults, counts = Faults(), PageCounts()
        self.notices: deque[str] = faults.notices  # faults of the server that are not printed yet

        def session(socket: WebSocket) -> TableSession:
            return TableSession(socket, feed, faults, counts)

        folders = {"static": STATIC, "table": TABLE}
        site = Site("echostep table", operation.plan, TABLE / "index.html", folders, session, faults, counts)
        self.server = SocketServer(site, address)

    @property
    def url(self) -> str:
        """Address of the page."""
        return self.server.url

    def publish(self, scene: TableScene) -> None:
        """Show a scene on all pages; never waits."""
        self.feed.publish(scene)

    def __enter__(self) -> Self:
        self.feed.on_publish = self.server.request_wake
        self.server.__enter__()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.feed.on_publish = None
        self.server.__exit__(kind, error, at)
