# SPDX-License-Identifier: MIT
"""Connections of the page's server: how fast they are accepted, how many there are, how long they may take.

In: a listening socket; from the application, when a request begins and ends. Out: accepted connections, each given to a protocol. Owns the open
connections and their timeouts.

A connection without a request in progress is closed after `REQUEST_S`, and at once when a new one needs its place: so silent connections
never keep a page out. Connections beyond `ACCEPTS_A_SECOND` wait in the operating system's queue and cost the tracker nothing.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import uvicorn

# Assumed.
MOST_CONNECTIONS = 256
MOST_OF_ADDRESS = 128  # a page needs about eight for a moment
REQUEST_S = 5.0  # for the first request, and between two
ANSWER_S = 30.0  # for a request until its answer is read
ACCEPTS_A_SECOND = 200.0
BURST = 320  # accepted without delay: 40 pages that open at once, eight connections each
SWEEP_S = 0.5  # between two looks at the timeouts
REFUSED_S = 0.5  # pause after the operating system refused a connection: it has no file descriptors left
Peer = tuple[str, int]  # address and port


@dataclass(slots=True)
class _Connection:
    """`requests` in progress; `since_s`: when the first of them began, or the last one ended. `stays`: a WebSocket, without timeout."""

    transport: asyncio.BaseTransport
    since_s: float
    requests: int = 0
    stays: bool = False


class Connections:
    """Run `accept` in the server's loop. The application calls `begin` and `end` for each request."""

    def __init__(self, listener: socket.socket) -> None:
        self.closed = 0  # by timeout, or for a new one
        self._listener = listener
        self._open: dict[Peer, _Connection] = {}

    def __len__(self) -> int:
        return len(self._open)

    async def accept(self, protocol: Callable[[], asyncio.Protocol]) -> None:
        """Accept connections until cancelled."""
        loop = asyncio.get_running_loop()
        self._listener.setblocking(False)
        budget, filled_s = float(BURST), time.monotonic()
        sweeper = asyncio.create_task(self._sweep())
        try:
            while True:
                now_s = time.monotonic()
                budget, filled_s = min(budget + (now_s - filled_s) * ACCEPTS_A_SECOND, BURST), now_s
                if budget < 1.0:
                    await asyncio.sleep((1.0 - budget) / ACCEPTS_A_SECOND)
                    continue
                budget -= 1.0
                try:
                    accepted, address = await loop.sock_accept(self._listener)
                except OSError:
                    await asyncio.sleep(REFUSED_S)
                    continue
                await self._add(loop, protocol, accepted, (str(address[0]), int(address[1])))
        finally:
            sweeper.cancel()

    async def _add(
        self,
        loop: asyncio.AbstractEventLoop,
        protocol: Callable[[], asyncio.Protocol],
        accepted: socket.socket,
        peer: Peer,
    ) -> None:
        """Give a new connection to a protocol, if there is a place for it."""
        self._forget_closed()
        of_address = [other for other in self._open if other[0] == peer[0]]
        if len(of_address) >= MOST_OF_ADDRESS or len(self._open) >= MOST_CONNECTIONS:
            places = of_address if len(of_address) >= MOST_OF_ADDRESS else list(self._open)
            idle = [other for other in places if not self._open[other].requests]
            self.closed += 1
            if not idle:
                accepted.close()
                return
            self._close(min(idle, key=lambda other: self._open[other].since_s))
        with contextlib.suppress(OSError):
            transport, _ = await loop.connect_accepted_socket(protocol, accepted)
            self._open[peer] = _Connection(transport, time.monotonic())

    async def _sweep(self) -> None:
        """Close connections that take too long."""
        while True:
            await asyncio.sleep(SWEEP_S)
            self._forget_closed()
            now_s = time.monotonic()
            for peer, connection in list(self._open.items()):
                limit_s = ANSWER_S if connection.requests else REQUEST_S
                if not connection.stays and now_s - connection.since_s > limit_s:
                    self.closed += 1
                    self._close(peer)

    def begin(self, peer: Peer, *, stays: bool) -> None:
        """A request begins on a connection; `stays`: it is a WebSocket's."""
        if (connection := self._open.get(peer)) is not None:
            connection.requests += 1
            connection.stays = connection.stays or stays
            connection.since_s = time.monotonic()

    def end(self, peer: Peer) -> None:
        """A request has ended."""
        if (connection := self._open.get(peer)) is not None:
            connection.requests -= 1
            connection.since_s = time.monotonic()

    def _close(self, peer: Peer) -> None:
        """Close a connection at once; unsent bytes are dropped."""
        transport = self._open.pop(peer).transport
        if isinstance(transport, asyncio.WriteTransport):
            transport.abort()

    def _forget_closed(self) -> None:
        for peer in [peer for peer, connection in self._open.items() if connection.transport.is_closing()]:
            del self._open[peer]


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
