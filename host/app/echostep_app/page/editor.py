# SPDX-License-Identifier: MIT
"""The plan editor: a plan is cleaned, mended and named in a browser on this machine, over a picture of it if there is one.

In: a plan file (which need not exist yet), a picture, plans posted by the page. Out: the page, the plan as JSON, the plan file. Owns the server, and
the plan file while it runs. It listens on the loopback interface only; the address contains a random token, and requests without it are refused.
"""

from __future__ import annotations

import asyncio
import hashlib
import secrets
import sys
import threading
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np
import uvicorn
from starlette.applications import Starlette
from starlette.requests import ClientDisconnect, Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles

from echostep.errors import EchostepError
from echostep.plan import Level, Plan, load_plan, parse_plan
from echostep_app.page.server import STATIC, STOP_S, Address, open_listener, page_in
from echostep_app.page.web.access import AccessControl
from echostep_app.page.web.connections import Connections, GatedServer
from echostep_app.plan.check import check_plan
from echostep_app.plan.writer import plan_json
from echostep_app.printing.lines import as_error, say, write_whole

PAGE = Path(__file__).parent / "edit"
MOST_BODY = 8_000_000  # bytes of a plan: a browser draws this much smoothly
MOST_PICTURE = 32_000_000  # bytes
MOST_FOUND = 200  # findings of a check
POST_S = 20.0  # time for a posted plan to arrive
NO_FILE = "none"  # state of a plan file that does not exist


class PlanFile:
    """A plan file, replaced in one step when it is written, so that it always holds a complete plan."""

    def __init__(self, path: Path) -> None:
        """Raises EchostepError when the file is not a plan or too large, or when its folder does not exist."""
        self.path = path.resolve()
        if self.path.exists():
            if self.path.is_file() and self.path.stat().st_size > MOST_BODY:
                raise EchostepError(
                    f"{path}: larger than {MOST_BODY // 1_000_000} MB: change it in the program it came from and import it again"
                )
            load_plan(path)
        elif not self.path.parent.is_dir():
            raise EchostepError(f"{path}: there is no folder {self.path.parent}: make it first")

    def read(self) -> tuple[str, str]:
        """The plan as JSON, and the SHA-256 of the file; an empty plan and `NO_FILE` without a file."""
        if not self.path.exists():
            return plan_json(Plan(self.path.stem, (Level("Ground floor", 0.0, np.zeros((0, 4))),), None, "")), NO_FILE
        plan = load_plan(self.path)
        return plan_json(plan), plan.digest

    def write(self, plan: Plan) -> str:
        """Write the plan; the previous file is kept as PLAN.bak. Returns the SHA-256 of the new file."""
        raw = plan_json(plan).encode()
        try:
            previous = self.path.read_bytes() if self.path.exists() else None
            if previous is not None and previous != raw:
                write_whole(self.path.with_name(self.path.name + ".bak"), previous, like=self.path)
            if previous != raw:
                write_whole(self.path, raw)
        except OSError as error:
            raise EchostepError(
                f"{error.filename2 or self.path}: cannot write the plan: {error.strerror or error}"
            ) from error
        return hashlib.sha256(raw).hexdigest()

    def state(self) -> str:
        """SHA-256 of the file as it is now, or `NO_FILE`."""
        try:
            return hashlib.sha256(self.path.read_bytes()).hexdigest()
        except FileNotFoundError:
            return NO_FILE
        except OSError as error:
            raise EchostepError(f"{self.path}: cannot read the plan: {error.strerror or error}") from error


class EditServer:
    """Serves the editor until it is closed; raises EchostepError when the plan, the picture or the port cannot be opened."""

    def __init__(
        self, plan: Path, picture: Path | None = None, port: int | None = None, lang: str | None = None
    ) -> None:
        self.file = PlanFile(plan)
        self._picture = None if picture is None else _picture(picture)
        self._lang = lang
        self._listener = open_listener(Address(port=port))
        token = secrets.token_urlsafe(16)
        self.url = f"http://127.0.0.1:{self._listener.getsockname()[1]}/{token}/"
        connections = Connections(self._listener)
        checks_token = AccessControl(self._application(token), token, connections)
        self.access_control = AccessControl(checks_token, None, connections)  # checks that Host is this machine
        settings = uvicorn.Config(
            self.access_control, log_config=None, log_level="critical", access_log=False, server_header=False, date_header=False,
            timeout_graceful_shutdown=1,
        )  # fmt: skip
        self._server = GatedServer(settings, connections)
        self._thread = threading.Thread(target=self._server.run, name="echostep plan edit", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._server.should_exit = True
        self._thread.join(STOP_S)
        self._listener.close()

    def wait(self) -> None:
        """Wait until Ctrl-C or until the server ends."""
        while self._thread.is_alive():
            self._thread.join(0.5)

    def _application(self, token: str) -> Starlette:
        routes = [
            Route("/", self._index),
            Mount("/static", StaticFiles(directory=STATIC)),
            Mount("/edit", StaticFiles(directory=PAGE)),
            Route("/picture", self._get_picture),
            Route("/plan", self._get_plan, methods=["GET"]),
            Route("/plan", self._post_plan, methods=["POST"]),
            Route("/check", self._check, methods=["POST"]),
        ]
        return Starlette(routes=[Mount(f"/{token}", routes=routes)])

    async def _index(self, _: Request) -> Response:
        return await page_in(PAGE / "index.html", self._lang)

    async def _get_picture(self, _: Request) -> Response:
        if self._picture is None:
            return Response(status_code=204)
        raw, media_type = self._picture
        return Response(raw, media_type=media_type)

    async def _get_plan(self, _: Request) -> Response:
        try:
            text, state = self.file.read()
        except EchostepError as error:
            return _error(500, str(error))
        return Response(text, media_type="application/json", headers={"etag": f'"{state}"'})

    async def _post_plan(self, request: Request) -> Response:
        """Write a posted plan, unless the file has changed since the page read it (If-Match)."""
        raw = await _body(request)
        if isinstance(raw, Response):
            return raw
        try:
            plan = parse_plan(raw)
        except ValueError as error:
            return _error(422, str(error))
        try:
            known = request.headers.get("if-match")
            if known is not None and known.strip('"') != self.file.state():
                return _error(409, f"{self.file.path.name} has changed since this page read it")
            state = self.file.write(plan)
        except EchostepError as error:
            return _error(500, str(error))
        return JSONResponse({"saved": self.file.path.name}, headers={"etag": f'"{state}"'})

    async def _check(self, request: Request) -> Response:
        """The findings of `plan check` in a posted plan; nothing is written."""
        raw = await _body(request)
        if isinstance(raw, Response):
            return raw
        try:
            found = await asyncio.to_thread(lambda: check_plan(parse_plan(raw))[:MOST_FOUND])
        except (ValueError, EchostepError) as error:
            return _error(422, str(error))
        return JSONResponse({"found": [{"level": f.level, "at": f.position_m, "text": f.text} for f in found]})


async def _body(request: Request) -> bytes | Response:
    """The body of a request; an error when it is larger than `MOST_BODY` or takes longer than `POST_S`."""
    raw = bytearray()
    try:
        async with asyncio.timeout(POST_S):
            async for part in request.stream():
                raw += part
                if len(raw) > MOST_BODY:
                    return _error(413, f"larger than {MOST_BODY // 1_000_000} MB")
    except (TimeoutError, ClientDisconnect):
        return _error(408, f"the request did not arrive within {POST_S:.0f} s")
    return bytes(raw)


def _error(status: int, reason: str) -> Response:
    return JSONResponse({"error": reason[:500]}, status)


def _picture(path: Path) -> tuple[bytes, str]:
    """Bytes and media type of a picture: PNG, JPEG or SVG, recognised by the file's contents."""
    with as_error(f"{path}: cannot read the picture"):
        if path.stat().st_size > MOST_PICTURE:
            raise EchostepError(f"{path}: larger than {MOST_PICTURE // 1_000_000} MB: make the picture smaller")
        raw = path.read_bytes()
    if raw.startswith(b"\x89PNG\r\n\x1a\n"):
        return raw, "image/png"
    if raw.startswith(b"\xff\xd8\xff"):
        return raw, "image/jpeg"
    if b"<svg" in raw[:4096]:
        return raw, "image/svg+xml"
    raise EchostepError(f"{path}: neither PNG, JPEG nor SVG: convert the picture to one of these")


def edit_plan(plan: Path, picture: Path | None, port: int | None, lang: str | None, *, browser: bool) -> None:
    """Serve the editor until Ctrl-C. `lang` None: the browser's language; `browser`: open it in the browser too."""
    import webbrowser

    with EditServer(plan, picture, port, lang) as server:
        say(f"Draw {plan} at {server.url} (until Ctrl-C).")
        sys.stdout.flush()
        if browser:
            webbrowser.open(server.url)
        server.wait()
