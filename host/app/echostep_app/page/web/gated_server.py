# SPDX-License-Identifier: MIT
"""A web server whose connections are accepted by `Connections`.

In: an application, connections. Out: answers. Owns the task that accepts.
"""

from __future__ import annotations

import asyncio
import socket
from typing import Any

import uvicorn

from echostep_app.page.web.connections import Connections


class GatedServer(uvicorn.Server):
    """A server whose connections are accepted by `Connections`."""

    def __init__(self, config: uvicorn.Config, connections: Connections) -> None:
        super().__init__(config)
        self._connections = connections
        self._accepting: asyncio.Task[None] | None = None

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Start without listening sockets, then accept."""
        await super().startup(sockets=sockets or [])
        self._accepting = asyncio.create_task(self._connections.accept(self._protocol))

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Accept no more, then shut down."""
        if self._accepting is not None:
            self._accepting.cancel()
        await super().shutdown(sockets)

    def _protocol(self) -> asyncio.Protocol:
        kind: Any = self.config.http_protocol_class
        protocol: asyncio.Protocol = kind(
            config=self.config, server_state=self.server_state, app_state=self.lifespan.state
        )
        return protocol
