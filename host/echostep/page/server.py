"""The server: the page and its sockets, in a thread with an event loop of its own.

In: a stage, an address. Out: pages in browsers. Owns the thread, the listening socket and the sessions.
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
from starlette.responses import FileResponse, Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.websockets import WebSocket

from echostep.errors import EchostepError
from echostep.page import protocol as wire
from echostep.page.access import LOOPBACK, Guard
from echostep.page.elements.guidance import Ways
from echostep.page.mailbox import Mailbox
from echostep.page.session import PageCounts, Session

STATIC = Path(__file__).parent / "static"
LOCAL = "127.0.0.1"
PORT = 8420
MOST_PAGES = 32
FULL = 1013
STOP_S = 5.0


@dataclass(frozen=True, slots=True)
class Address:
    """Where the page is served; port None: 8420, or any free one when that is taken."""

    host: str = LOCAL
    port: int | None = None


class PageServer:
    """Serves a stage until it is closed; raises EchostepError when the address cannot be had."""

    def __init__(self, stage: Mailbox, address: Address = Address()) -> None:
        self.counts = PageCounts()
        self.sessions: set[Session] = set()
        self._stage = stage
        self._ways = Ways(stage.plan)
        self._listening = listen(address)
        token = None if address.host in LOOPBACK else secrets.token_urlsafe(16)
        host, port = self._listening.getsockname()[:2]
        shown = {"0.0.0.0": socket.gethostname(), "::": socket.gethostname()}.get(host, host)
        shown = f"[{shown}]" if ":" in shown else shown
        self.url = f"http://{shown}:{port}/" + (f"{token}/" if token else "")
        self.guard = Guard(self._application(token), token)
        self._loop: asyncio.AbstractEventLoop | None = None
        self._rung = False
        settings = uvicorn.Config(
            self.guard, log_config=None, log_level="critical", access_log=False, server_header=False, date_header=False,
            ws_max_size=wire.MOST_REQUEST, ws_per_message_deflate=False, limit_concurrency=512, timeout_graceful_shutdown=1,
        )  # fmt: skip
        self._server = uvicorn.Server(settings)
        self._thread = threading.Thread(
            target=self._server.run, kwargs={"sockets": [self._listening]}, name="echostep page", daemon=True
        )

    def __enter__(self) -> Self:
        self._stage.on_news = self._ring
        self._thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._stage.on_news = None
        self._server.should_exit = True
        self._thread.join(STOP_S)
        self._listening.close()

    @property
    def pages(self) -> int:
        """How many pages look."""
        return len(self.sessions)

    def _ring(self) -> None:
        """Wake the sessions, from any thread; many rings before the loop gets to it are one."""
        loop = self._loop
        if loop is not None and not self._rung:
            self._rung = True
            with contextlib.suppress(RuntimeError):  # the loop is just closing
                loop.call_soon_threadsafe(self._wake)

    def _wake(self) -> None:
        self._rung = False
        for session in self.sessions:
            session.wake()

    def _application(self, token: str | None) -> Starlette:
        routes = [
            Route("/", self._index),
            Route("/walls/{level:int}", self._walls),
            WebSocketRoute("/socket", self._socket),
            Mount("/static", StaticFiles(directory=STATIC)),
        ]
        return Starlette(routes=[Mount(f"/{token}", routes=routes)] if token else routes, lifespan=self._lifespan)

    @contextlib.asynccontextmanager
    async def _lifespan(self, _: Starlette) -> AsyncIterator[None]:
        self._loop = asyncio.get_running_loop()
        yield
        self._loop = None

    async def _index(self, _: Request) -> Response:
        return FileResponse(STATIC / "index.html")

    async def _walls(self, request: Request) -> Response:
        level = request.path_params["level"]
        if level >= len(self._stage.plan.levels):
            raise HTTPException(404)
        return Response(wire.walls(self._stage.plan, level), media_type="application/octet-stream")

    async def _socket(self, opened: WebSocket) -> None:
        await opened.accept()
        if len(self.sessions) >= MOST_PAGES:
            self.counts.refused += 1
            await opened.close(FULL)
            return
        session = Session(opened, self._stage, self._ways, self.counts)
        self.sessions.add(session)
        try:
            session.wake()
            await session.run()
        finally:
            self.sessions.discard(session)


def listen(address: Address) -> socket.socket:
    """A socket that listens at an address."""
    try:
        return _bound(address.host, PORT if address.port is None else address.port)
    except OSError as error:
        if address.port is None and address.host in LOOPBACK:
            return _bound(address.host, 0)
        raise EchostepError(
            f"--host {address.host} --port {address.port}: cannot serve the page there: {error.strerror or error}"
        ) from error


def _bound(host: str, port: int) -> socket.socket:
    family, kind, protocol, _, place = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[
        0
    ]
    listening = socket.socket(family, kind, protocol)
    try:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind(place)
        listening.listen(64)
    except OSError:
        listening.close()
        raise
    return listening
