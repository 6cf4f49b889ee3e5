# SPDX-License-Identifier: MIT
"""The server: a page and its sockets, in a thread with an event loop of its own.

In: a site or a mailbox, an address. Out: HTML, plans and frames to browsers. Owns the thread, the listening socket and the sessions.
"""

from __future__ import annotations

import asyncio
import contextlib
import secrets
import socket
import threading
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass, replace
from pathlib import Path
from types import TracebackType
from typing import Generic, Literal, Protocol, Self, TypeVar

import uvicorn
from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import HTMLResponse, PlainTextResponse, Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.websockets import WebSocket

from echostep.errors import EchostepError
from echostep.plan import Plan
from echostep_app.page import protocol
from echostep_app.page.mailbox import Mailbox
from echostep_app.page.requests import MOST_REQUEST
from echostep_app.page.session import PageSession
from echostep_app.page.shared import PageCounts, Shared
from echostep_app.page.web import access
from echostep_app.page.web.access import LOOPBACK, AccessControl
from echostep_app.page.web.addresses import page_urls
from echostep_app.page.web.connections import Connections, GatedServer
from echostep_app.page.web.faults import Faults, logged_to
from echostep_app.page.web.uploads import Uploads

STATIC = Path(__file__).parent / "static"
LOCAL = "127.0.0.1"
HTML = '<html lang="en"'  # of a page; static/language.js reads which language was chosen, static/main.js the role
PORT = 8420
MOST_PAGES = 32  # open at the same time; further ones are refused
TRY_AGAIN_LATER = 1013  # WebSocket close code [IANA]
STOP_S = 5.0  # time for the thread to end
BACKLOG = 320  # connections that wait to be accepted: as many as are accepted at once


@dataclass(frozen=True, slots=True)
class Address:
    """Where the page is served, and in which language. `port` None: 8420, or any free port when 8420 is in use; `lang` None: each browser's."""

    host: str = LOCAL
    port: int | None = None
    lang: str | None = None


class SocketSession(Protocol):
    """The server's end of one page's socket."""

    def wake(self) -> None:
        """Look for something new to send."""

    async def disconnect(self) -> None:
        """End the connection; the page comes back for the content served then."""

    async def run(self) -> None:
        """Serve until the page disconnects."""


S = TypeVar("S", bound=SocketSession)


@dataclass(frozen=True, slots=True)
class PageSite(Generic[S]):
    """The content of a server: the page of a role, lines of `plan`, a session for each socket."""

    role: Literal["wearer", "commander"]
    plan: Plan
    session: Callable[[WebSocket], S]
    faults: Faults
    counts: PageCounts


class SocketServer(Generic[S]):
    """Serves a site until it is closed; raises EchostepError when it cannot listen at the address."""

    def __init__(self, site: PageSite[S], address: Address = Address()) -> None:
        self.sessions: set[S] = set()
        self._site, self._lang = site, address.lang
        self._listener = open_listener(address)
        token = None if address.host in LOOPBACK and not access.has_other_users() else secrets.token_urlsafe(16)
        host, port = self._listener.getsockname()[:2]
        self.urls = page_urls(host, port, token)  # the likeliest first
        self.connections = Connections(self._listener)
        self.access_control = AccessControl(
            self._application(token), token, self.connections, site.faults.notices.append
        )
        self._loop: asyncio.AbstractEventLoop | None = None
        self._wake_pending = False
        settings = uvicorn.Config(
            self.access_control, log_config=None, log_level="critical", access_log=False, server_header=False, date_header=False,
            ws_max_size=MOST_REQUEST, ws_per_message_deflate=False, timeout_graceful_shutdown=1,
        )  # fmt: skip
        self._server = GatedServer(settings, self.connections)
        self._thread = threading.Thread(target=self._serve, name=f"echostep page: {site.role}", daemon=True)
        self._logged = contextlib.ExitStack()

    def __enter__(self) -> Self:
        self._logged.enter_context(logged_to(self._site.faults.note_text))
        self._thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._server.should_exit = True
        self._thread.join(STOP_S)
        self._logged.close()
        self._listener.close()

    def _serve(self) -> None:
        """The thread."""
        try:
            self._server.run()
        except Exception as error:  # whatever it is, the run needs no page
            self._site.faults.note_end(error)

    @property
    def url(self) -> str:
        """Address of the page for a browser."""
        return self.urls[0]

    @property
    def pages(self) -> int:
        """Number of connected pages."""
        return len(self.sessions)

    @property
    def counts(self) -> PageCounts:
        """Counts over all pages."""
        return self._site.counts

    def request_wake(self) -> None:
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
            Route("/lines/{level:int}", self._lines),
            WebSocketRoute("/socket", self._socket),
            *self._own_routes(),
            Mount("/static", StaticFiles(directory=STATIC)),
        ]
        return Starlette(
            routes=[Mount(f"/{token}", routes=routes)] if token else routes,
            lifespan=self._lifespan,
            exception_handlers={Exception: self._fail},
        )

    def _own_routes(self) -> list[Route]:
        """Further routes of this site."""
        return []

    async def _fail(self, _: Request, error: Exception) -> Response:
        """Log a fault and answer with it."""
        return PlainTextResponse(self._site.faults.note(error), 500)

    @contextlib.asynccontextmanager
    async def _lifespan(self, _: Starlette) -> AsyncIterator[None]:
        self._loop = asyncio.get_running_loop()
        yield
        self._loop = None

    async def _index(self, _: Request) -> Response:
        return await page_in(STATIC / "index.html", self._lang, self._site.role)

    async def _lines(self, request: Request) -> Response:
        level = request.path_params["level"]
        if level >= len(self._site.plan.levels):
            raise HTTPException(404)
        rows = await asyncio.to_thread(protocol.lines, self._site.plan, level)  # exits of a large plan take a second
        return Response(rows, media_type="application/octet-stream")

    async def _socket(self, websocket: WebSocket) -> None:
        await websocket.accept()
        if len(self.sessions) >= MOST_PAGES:
            self.counts.refused += 1
            await websocket.close(TRY_AGAIN_LATER)
            return
        session = self._site.session(websocket)
        self.sessions.add(session)
        try:
            session.wake()
            await session.run()
        finally:
            self.sessions.discard(session)


class PageServer(SocketServer[PageSession]):
    """Serves the scenes of a mailbox until it is closed; raises EchostepError when it cannot listen at the address.

    `uploads` takes files that are dropped onto the page; None if it takes none.
    """

    def __init__(self, mailbox: Mailbox, address: Address = Address(), uploads: Uploads | None = None) -> None:
        self.shared = shared = Shared.of(mailbox.plan, takes_files=uploads is not None)
        self._mailbox, self._uploads = mailbox, uploads
        self._disconnecting: set[asyncio.Task[None]] = set()

        def session(socket: WebSocket) -> PageSession:
            return PageSession(socket, self._mailbox, self.shared)

        site = PageSite("wearer", mailbox.plan, session, shared.faults, shared.counts)
        super().__init__(site, address)

    def _own_routes(self) -> list[Route]:
        uploads = self._uploads
        posts = {"/file": uploads.take, "/without-plan": uploads.play_without_plan} if uploads else {}
        return [
            Route("/over-time/{begin:int}", self._over_time),
            *(Route(path, take, methods=["POST"]) for path, take in posts.items()),
        ]

    async def _over_time(self, request: Request) -> Response:
        """The run over time, from row number `begin` on."""
        answer = protocol.over_time(self._mailbox.over_time, request.path_params["begin"])
        return Response(answer, media_type="application/octet-stream")

    def show(self, mailbox: Mailbox) -> None:
        """Serve another mailbox from now on: pages that are open come back for it. May be called from any thread."""
        self._mailbox.on_publish, mailbox.on_publish = None, self.request_wake
        self._mailbox, self.shared = mailbox, self.shared.on(mailbox.plan)
        self._site = replace(self._site, plan=mailbox.plan)
        if (loop := self._loop) is not None:
            loop.call_soon_threadsafe(self._disconnect)

    def _disconnect(self) -> None:
        for session in self.sessions:
            task = asyncio.create_task(session.disconnect())
            self._disconnecting.add(task)
            task.add_done_callback(self._disconnecting.discard)

    def __enter__(self) -> Self:
        self._mailbox.on_publish = self.request_wake
        return super().__enter__()

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._mailbox.on_publish = None
        super().__exit__(kind, error, at)


async def page_in(path: Path, lang: str | None, role: str = "") -> Response:
    """A page in a language, None: in each browser's language; with the parts of a role."""
    page = await asyncio.to_thread(path.read_text, "utf-8")
    attributes = f' data-lang="{lang}"' * bool(lang) + f' class="{role}"' * bool(role)
    return HTMLResponse(page.replace(HTML, HTML + attributes, 1))


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
    addresses = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
    family, kind, ip_protocol, _, address = addresses[0]
    listener = socket.socket(family, kind, ip_protocol)
    try:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind(address)
        listener.listen(BACKLOG)
    except OSError:
        listener.close()
        raise
    return listener
