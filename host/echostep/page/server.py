# SPDX-License-Identifier: MIT
"""The server: the page and its sockets, in a thread with an event loop of its own.

In: a mailbox, an address. Out: HTML, walls and frames to browsers. Owns the thread, the listening socket and the sessions.
"""

from __future__ import annotations

import asyncio
import contextlib
import secrets
import socket
import threading
from collections.abc import AsyncIterator
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

import uvicorn
from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import FileResponse, PlainTextResponse, Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.websockets import WebSocket

from echostep.errors import EchostepError
from echostep.page import protocol
from echostep.page.access import LOOPBACK, AccessControl
from echostep.page.connections import Connections
from echostep.page.gated_server import GatedServer
from echostep.page.log_budget import logged_to
from echostep.page.mailbox import Mailbox
from echostep.page.requests import MOST_REQUEST
from echostep.page.session import PageSession
from echostep.page.shared import PageCounts, Shared

STATIC = Path(__file__).parent / "static"
LOCAL = "127.0.0.1"
PORT = 8420
MOST_PAGES = 32  # open at the same time; further ones are refused
TRY_AGAIN_LATER = 1013  # WebSocket close code [IANA]
STOP_S = 5.0  # time for the thread to end
BACKLOG = 64  # connections that wait to be accepted


@dataclass(frozen=True, slots=True)
class Address:
    """Where the page is served. `port` None: 8420, or any free port when 8420 is in use."""

    host: str = LOCAL
    port: int | None = None


class PageServer:
    """Serves the scenes of a mailbox until it is closed; raises EchostepError when it cannot listen at the address."""

    def __init__(self, mailbox: Mailbox, address: Address = Address()) -> None:
        self.shared = Shared.of(mailbox.plan)
        self.sessions: set[PageSession] = set()
        self._mailbox = mailbox
        self._listener = open_listener(address)
        token = None if address.host in LOOPBACK else secrets.token_urlsafe(16)
        self.url = _url(self._listener, token)
        self.connections = Connections(self._listener)
        self.access_control = AccessControl(self._application(token), token, self.connections)
        self._loop: asyncio.AbstractEventLoop | None = None
        self._wake_pending = False
        settings = uvicorn.Config(
            self.access_control, log_config=None, log_level="critical", access_log=False, server_header=False, date_header=False,
            ws_max_size=MOST_REQUEST, ws_per_message_deflate=False, timeout_graceful_shutdown=1,
        )  # fmt: skip
        self._server = GatedServer(settings, self.connections)
        self._thread = threading.Thread(target=self._server.run, name="echostep page", daemon=True)
        self._logged = contextlib.ExitStack()

    def __enter__(self) -> Self:
        self._mailbox.on_publish = self._request_wake
        self._logged.enter_context(logged_to(self.shared.faults.note_text))
        self._thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._mailbox.on_publish = None
        self._server.should_exit = True
        self._thread.join(STOP_S)
        self._logged.close()
        self._listener.close()

    @property
    def pages(self) -> int:
        """Number of connected pages."""
        return len(self.sessions)

    @property
    def counts(self) -> PageCounts:
        """Counts over all pages."""
        return self.shared.counts

    def _request_wake(self) -> None:
        """Have the loop wake the sessions; may be called from any thread. Requests until the loop runs count as one."""
        loop = self._loop
        if loop is not None and not self._wake_pending:
            self._wake_pending = True
            with contextlib.suppress(RuntimeError):  # the loop is just closing
                loop.call_soon_threadsafe(self._wake)

    def _wake(self) -> None:
        self._wake_pending = False
        for session in self.sessions:
            session.wake()

    def _application(self, token: str | None) -> Starlette:
        routes = [
            Route("/", self._index),
            Route("/walls/{level:int}", self._walls),
            WebSocketRoute("/socket", self._socket),
            Mount("/static", StaticFiles(directory=STATIC)),
        ]
        return Starlette(
            routes=[Mount(f"/{token}", routes=routes)] if token else routes,
            lifespan=self._lifespan,
            exception_handlers={Exception: self._fail},
        )

    async def _fail(self, _: Request, error: Exception) -> Response:
        """Log a fault and answer with it."""
        return PlainTextResponse(self.shared.faults.note(error), 500)

    @contextlib.asynccontextmanager
    async def _lifespan(self, _: Starlette) -> AsyncIterator[None]:
        self._loop = asyncio.get_running_loop()
        yield
        self._loop = None

    async def _index(self, _: Request) -> Response:
        return FileResponse(STATIC / "index.html")

    async def _walls(self, request: Request) -> Response:
        level = request.path_params["level"]
        if level >= len(self._mailbox.plan.levels):
            raise HTTPException(404)
        return Response(protocol.walls(self._mailbox.plan, level), media_type="application/octet-stream")

    async def _socket(self, websocket: WebSocket) -> None:
        await websocket.accept()
        if len(self.sessions) >= MOST_PAGES:
            self.shared.counts.refused += 1
            await websocket.close(TRY_AGAIN_LATER)
            return
        session = PageSession(websocket, self._mailbox, self.shared)
        self.sessions.add(session)
        try:
            session.wake()
            await session.run()
        finally:
            self.sessions.discard(session)


def _url(listener: socket.socket, token: str | None) -> str:
    """Address of the page for a browser; a socket on all interfaces is named by the host."""
    host, port = listener.getsockname()[:2]
    name = socket.gethostname() if host in ("0.0.0.0", "::") else host
    name = f"[{name}]" if ":" in name else name
    return f"http://{name}:{port}/" + (f"{token}/" if token else "")


def open_listener(address: Address) -> socket.socket:
    """A socket that listens at an address; raises EchostepError when that is not possible."""
    try:
        return _bind(address.host, PORT if address.port is None else address.port)
    except OSError as error:
        if address.port is None and address.host in LOOPBACK:
            return _bind(address.host, 0)
        raise EchostepError(
            f"--host {address.host} --port {address.port}: cannot serve the page there: {error.strerror or error}"
        ) from error


def _bind(host: str, port: int) -> socket.socket:
    found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
    family, kind, ip_protocol, _, address = found[0]
    listener = socket.socket(family, kind, ip_protocol)
    try:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind(address)
        listener.listen(BACKLOG)
    except OSError:
        listener.close()
        raise
    return listener
