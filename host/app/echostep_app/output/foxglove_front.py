# SPDX-License-Identifier: MIT
"""Foxglove's older subprotocol, in front of a server that knows the newer one alone.

In: connections of viewers. Out: the same bytes to and from the server behind; a viewer that offers only the older name of the protocol is answered by
that name. Owns the listening socket and a thread. The two names mean the same bytes for what is sent here (`decisions/0100-older-foxglove-name.md`).
"""

from __future__ import annotations

import asyncio
import re
import socket
from contextlib import suppress
from threading import Thread

LOCAL = "127.0.0.1"
OLDER, NEWER = b"foxglove.websocket.v1", b"foxglove.sdk.v1"
_OFFER = re.compile(rb"(?im)^sec-websocket-protocol:[^\r\n]*")
_HEAD_END = b"\r\n\r\n"
# Assumed.
HEAD_BYTES = 1 << 16  # of a request; a longer one is closed
HEAD_S = 10.0  # for a whole request and its answer
END_S = 1.0  # for the last bytes to viewers
COPIED_BYTES = 1 << 16  # at once


class SubprotocolFront:
    """Listens from the beginning, and serves from `serve` until `close`."""

    def __init__(self, host: str, port: int) -> None:
        """Raises OSError when it cannot listen there."""
        self._socket = socket.create_server((host, port), family=socket.AF_INET6 if ":" in host else socket.AF_INET)
        self.port = int(self._socket.getsockname()[1])
        self._loop, self._closed = asyncio.new_event_loop(), asyncio.Event()
        self._thread = Thread(target=self._run, name="Foxglove viewers", daemon=True)

    def serve(self, behind: int) -> None:
        """Serve viewers by the server at this port of this computer."""
        self._behind = behind
        self._thread.start()

    def close(self) -> None:
        """End all connections; those that the server behind has ended are brought to their end."""
        self._loop.call_soon_threadsafe(self._closed.set)
        self._thread.join()

    def _run(self) -> None:
        with asyncio.Runner(loop_factory=lambda: self._loop) as runner:
            runner.run(self._serve())

    async def _serve(self) -> None:
        server = await asyncio.start_server(self._relay, sock=self._socket, limit=HEAD_BYTES)
        await self._closed.wait()
        server.close()
        if relays := asyncio.all_tasks() - {asyncio.current_task()}:
            _, late = await asyncio.wait(relays, timeout=END_S)
            for relay in late:
                relay.cancel()
            await asyncio.gather(*late, return_exceptions=True)
            await asyncio.sleep(0)  # the loop closes their sockets in its next turn

    async def _relay(self, viewer: asyncio.StreamReader, to_viewer: asyncio.StreamWriter) -> None:
        """One viewer, from its handshake to its end."""
        with suppress(OSError, asyncio.IncompleteReadError, asyncio.LimitOverrunError, asyncio.CancelledError):
            async with asyncio.timeout(HEAD_S):
                request = await viewer.readuntil(_HEAD_END)
                is_older = not any(NEWER in offer for offer in _OFFER.findall(request))
                server, to_server = await asyncio.open_connection(LOCAL, self._behind)
                to_server.write(_renamed(request, OLDER, NEWER) if is_older else request)
                answer = await server.readuntil(_HEAD_END)
            to_viewer.write(_renamed(answer, NEWER, OLDER) if is_older else answer)
            await asyncio.gather(_copy(viewer, to_server), _copy(server, to_viewer), return_exceptions=True)
        to_viewer.close()


def _renamed(head: bytes, name: bytes, other: bytes) -> bytes:
    """A request or answer with another name of the protocol."""
    return _OFFER.sub(lambda offer: offer[0].replace(name, other), head)


async def _copy(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """Copy until one side ends; a viewer that takes nothing is waited for, and the server drops its oldest messages."""
    try:
        while received := await reader.read(COPIED_BYTES):
            writer.write(received)
            await writer.drain()
    finally:
        writer.close()
