# SPDX-License-Identifier: MIT
"""Access control: which requests the server answers.

In: every request to the server. Out: the same request, or a refusal. Owns the count of refused requests; tells the connections
when a request begins and ends. On the loopback interface a web page of
another site must not reach the socket: `Host` must name this machine and `Origin` must be the page's own. On other interfaces, and on a computer of
several users, the address contains a random token, and requests without it are refused.

Behind a proxy the page's own address may begin with https, and is in `X-Forwarded-Host` where the proxy puts its target into `Host`: a page of
another site cannot set that header for a socket. Pages refused for their address are reported, because a proxy may be the reason.

Every user of a computer reaches its loopback interface. Where one person alone can log in, the page's address stays short, and fixed for a proxy.
Accounts that are only listed on request (LDAP) are not seen: give `--host` there.
"""

from __future__ import annotations

import hmac
import os
from collections.abc import Callable
from pathlib import Path
from urllib.parse import urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from echostep_app.page.web.connections import Connections

LOOPBACK = ("127.0.0.1", "localhost", "::1")
SECURITY_HEADERS = {
    "content-security-policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; manifest-src 'self'; "
        "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cache-control": "no-store",
}


MOST_TOLD = 4  # addresses that are reported; a hostile page may invent others
SAID_CHARACTERS = 100  # of an address
# Accounts of people [login.defs(5), UID_MIN and UID_MAX by default]; no shell: a service
PEOPLE = range(1000, 60_001)
NO_SHELLS = ("nologin", "false", "sync")


class AccessControl:
    """ASGI middleware. `token`: first part of each path; None: only requests to the loopback interface are answered."""

    def __init__(
        self, app: ASGIApp, token: str | None, connections: Connections, tell: Callable[[str], None] | None = None
    ) -> None:
        """`tell` gets a sentence on a page refused by its address."""
        self.refused = 0
        self._tell = tell
        self._told: set[str] = set()
        self._connections = connections
        self._app = app
        self._token = token

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass an allowed request to the application; answer any other with 404 or close code 1008 (policy violation)."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        host, port = scope.get("client") or ("", 0)
        peer = str(host), int(port)
        self._connections.begin(peer, stays=scope["type"] == "websocket" and self._is_allowed(scope))
        try:
            await self._answer(scope, receive, send)
        finally:
            self._connections.end(peer)

    async def _answer(self, scope: Scope, receive: Receive, send: Send) -> None:
        if not self._is_allowed(scope):
            self.refused += 1
            if scope["type"] == "http":
                await PlainTextResponse("not here", 404)(scope, receive, send)
            else:
                await send({"type": "websocket.close", "code": 1008})
            return

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message).update(SECURITY_HEADERS)
            await send(message)

        await self._app(scope, receive, send_with_headers)

    def _is_allowed(self, scope: Scope) -> bool:
        headers = Headers(scope=scope)
        host, origin = headers.get("host", ""), headers.get("origin")
        if self._token is None:
            if _host_name(host) not in LOOPBACK:
                self._tell_of(
                    f"a page at {host}",
                    "a proxy before it must send Host: 127.0.0.1 and its own name as X-Forwarded-Host",
                )
                return False
        elif not hmac.compare_digest(f"{scope['path']}/".split("/")[1].encode(), self._token.encode()):
            return False
        if origin is None:
            return bool(scope["type"] == "http")
        own = {name.strip().lower() for name in (host, headers.get("x-forwarded-host", "")) if name.strip()}
        if _netloc(origin) in own:
            return True
        self._tell_of(
            f"a page of {origin} (Host {host})",
            "a proxy before it must pass the browser's Host, or send it as X-Forwarded-Host",
        )
        return False

    def _tell_of(self, page: str, remedy: str) -> None:
        """Report a page that is refused, once."""
        page = "".join(c for c in page[:SAID_CHARACTERS] if c.isprintable())
        if self._tell and page not in self._told and len(self._told) < MOST_TOLD:
            self._told.add(page)
            self._tell(f"{page} is refused by the page's server: {remedy}")


def _netloc(origin: str) -> str | None:
    """Host and port of an origin of the web; None when it is not an origin."""
    try:
        parts = urlsplit(origin.lower())
    except ValueError:
        return None
    return parts.netloc if parts.scheme in ("http", "https") else None


def _host_name(host: str) -> str | None:
    """The host name in a Host header, without the port; None when the header is malformed."""
    try:
        return urlsplit(f"//{host}").hostname
    except ValueError:
        return None


def has_other_users() -> bool:
    """Whether an account of another person than this process's user has a shell; where accounts cannot be listed (Windows), no."""
    try:
        import pwd
    except ImportError:
        return False
    own = os.getuid()
    return any(
        entry.pw_uid in PEOPLE and entry.pw_uid != own and Path(entry.pw_shell).name not in NO_SHELLS
        for entry in pwd.getpwall()
    )
