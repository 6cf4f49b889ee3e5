# SPDX-License-Identifier: MIT
"""Access control: which requests the server answers.

In: every request to the server. Out: the same request, or a refusal. Owns the count of refused requests; tells the connections
when a request begins and ends. On the loopback interface a web page of
another site must not reach the socket: `Host` must name this machine and `Origin` must be the page's own. On other interfaces the address contains
a random token, and requests without it are refused.
"""

from __future__ import annotations

import hmac
from urllib.parse import urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from echostep.page.web.connections import Connections, Peer

LOOPBACK = ("127.0.0.1", "localhost", "::1")
SECURITY_HEADERS = {
    "content-security-policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
        "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cache-control": "no-store",
}


class AccessControl:
    """ASGI middleware. `token`: first part of each path; None: only requests to the loopback interface are answered."""

    def __init__(self, app: ASGIApp, token: str | None, connections: Connections) -> None:
        self.refused = 0
        self._connections = connections
        self._app = app
        self._token = token

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass an allowed request to the application; answer any other with 404 or close code 1008 (policy violation)."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        peer = _peer(scope)
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
                return False
        elif not hmac.compare_digest(scope["path"].split("/")[1].encode(), self._token.encode()):
            return False
        if origin is None:
            return bool(scope["type"] == "http")
        return origin.lower() == f"http://{host.lower()}"


def _peer(scope: Scope) -> Peer:
    """Address and port of the other end."""
    host, port = scope.get("client") or ("", 0)
    return str(host), int(port)


def _host_name(host: str) -> str | None:
    """The host name in a Host header, without the port; None when the header is malformed."""
    try:
        return urlsplit(f"//{host}").hostname
    except ValueError:
        return None
