# SPDX-License-Identifier: MIT
"""The commander's page: an operation served to browsers.

In: an operation, an address. Out: the page, in the role of a commander. Owns the server.
"""

from __future__ import annotations

from collections import deque
from types import TracebackType
from typing import Self

from starlette.websockets import WebSocket

from echostep_app.operation.operation import Operation
from echostep_app.operation.recorded.tape import OperationTape
from echostep_app.operation.session import TableFeed, TableSession
from echostep_app.page.server import Address, PageSite, SocketServer
from echostep_app.page.shared import PageCounts
from echostep_app.page.web.faults import Faults


class TablePage:
    """Serves the scenes that are published until it is closed; raises EchostepError when it cannot listen at the address."""

    def __init__(self, operation: Operation, title: str, address: Address, tape: OperationTape | None = None) -> None:
        self.feed = feed = TableFeed(operation, title, tape)
        faults, counts = Faults(), PageCounts()
        self.notices: deque[str] = faults.notices  # faults of the server that are not printed yet

        def session(socket: WebSocket) -> TableSession:
            return TableSession(socket, feed, faults, counts)

        site = PageSite("commander", operation.plan, session, faults, counts)
        self.server = SocketServer(site, address)

    @property
    def url(self) -> str:
        """Address of the page."""
        return self.server.url

    def __enter__(self) -> Self:
        self.feed.on_publish = self.server.request_wake
        self.server.__enter__()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.feed.on_publish = None
        self.server.__exit__(kind, error, at)
