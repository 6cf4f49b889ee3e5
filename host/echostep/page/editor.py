"""The plan's page: walls and doors are drawn over a picture of a plan, in a browser on this machine.

In: a plan's file (which need not exist yet), a picture, what the page posts. Out: the page, the plan as JSON, the file.
Owns the server, and the file while it runs. Loopback only; the address holds a random token, without which nothing answers.
"""

from __future__ import annotations

import asyncio
import hashlib
import os
import secrets
import shutil
import threading
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np
import uvicorn
from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request
from starlette.responses import FileResponse, JSONResponse, Response
from starlette.routing import Mount, Route

from echostep.errors import EchostepError
from echostep.page.access import Guard
from echostep.page.server import STATIC, STOP_S, Address, listen
from echostep.plan.model import Level, Plan, load_plan, parse_plan
from echostep.plan.writer import plan_json

PAGE = Path(__file__).parent / "edit"
SHARED = ("style.css", "icon.svg", "theme.js", "view.js")  # of the live page
MOST_BODY = 8_000_000  # a browser draws so much without stumbling
MOST_PICTURE = 32_000_000
POST_S = 20.0
NO_FILE = "none"


class PlanFile:
    """A plan's file: read, and written so that there is always one whole plan; raises EchostepError when what it holds is no plan or too large."""

    def __init__(self, path: Path) -> None:
        self.path = path.resolve()
        if self.path.exists():
            if self.path.is_file() and self.path.stat().st_size > MOST_BODY:
                raise EchostepError(
                    f"{path}: larger than {MOST_BODY // 1_000_000} MB: draw it in the program it came from and import it again"
                )
            load_plan(path)
        elif not self.path.parent.is_dir():
            raise EchostepError(f"{path}: there is no folder {self.path.parent}")

    def read(self) -> tuple[str, str]:
        """The plan as JSON, and the state of the file (its digest) that it shows."""
        if not self.path.exists():
            return plan_json(_empty(self.path.stem)), NO_FILE
        plan = load_plan(self.path)
        return plan_json(plan), plan.digest

    def write(self, plan: Plan) -> str:
        """The plan into the file, the former file into PLAN.bak; returns the digest of what the file now holds."""
        raw = plan_json(plan).encode()
        try:
            former = self.path.read_bytes() if self.path.exists() else None
            if former is not None and former != raw:
                self._replace(self.path.with_name(self.path.name + ".bak"), former)
            if former != raw:
                self._replace(self.path, raw)
        except OSError as error:
            raise EchostepError(f"{self.path}: cannot write the plan: {error.strerror or error}") from error
        return hashlib.sha256(raw).hexdigest()

    def state(self) -> str:
        """Digest of the file as it is now."""
        try:
            return hashlib.sha256(self.path.read_bytes()).hexdigest()
        except FileNotFoundError:
            return NO_FILE
        except OSError as error:
            raise EchostepError(f"{self.path}: cannot read the plan: {error.strerror or error}") from error

    def _replace(self, path: Path, raw: bytes) -> None:
        """Bytes into a new file beside it, onto the disk, then in its place."""
        new = path.with_name(f".{path.name}.{secrets.token_hex(4)}")
        try:
            with new.open("xb") as file:
                file.write(raw)
                file.flush()
                os.fsync(file.fileno())
            if self.path.exists():
                shutil.copymode(self.path, new)
            new.replace(path)
        finally:
            new.unlink(missing_ok=True)


class EditServer:
    """Serves the page until it is closed; raises EchostepError when file, picture or port cannot be had."""

    def __init__(self, plan: Path, picture: Path | None = None, port: int | None = None) -> None:
        self.file = PlanFile(plan)
        self._picture = None if picture is None else _picture(picture)
        self._pages = {name: STATIC / name for name in SHARED} | {path.name: path for path in PAGE.iterdir()}
        self._listening = listen(Address(port=port))
        token = secrets.token_urlsafe(16)
        self.url = f"http://127.0.0.1:{self._listening.getsockname()[1]}/{token}/"
        self.guard = Guard(Guard(self._application(token), token), None)  # the outer one looks at Host
        settings = uvicorn.Config(
            self.guard, log_config=None, log_level="critical", access_log=False, server_header=False, date_header=False,
            limit_concurrency=64, timeout_graceful_shutdown=1,
        )  # fmt: skip
        self._server = uvicorn.Server(settings)
        self._thread = threading.Thread(
            target=self._server.run, kwargs={"sockets": [self._listening]}, name="echostep plan edit", daemon=True
        )

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._server.should_exit = True
        self._thread.join(STOP_S)
        self._listening.close()

    def wait(self) -> None:
        """Until Ctrl-C."""
        while self._thread.is_alive():
            self._thread.join(0.5)

    def _application(self, token: str) -> Starlette:
        routes = [
            Route("/", self._index),
            Route("/static/{name}", self._static),
            Route("/picture", self._show),
            Route("/plan", self._read, methods=["GET"]),
            Route("/plan", self._write, methods=["POST"]),
        ]
        return Starlette(routes=[Mount(f"/{token}", routes=routes)])

    async def _index(self, _: Request) -> Response:
        return FileResponse(self._pages["index.html"])

    async def _static(self, request: Request) -> Response:
        found = self._pages.get(request.path_params["name"])
        if found is None:
            raise HTTPException(404)
        return FileResponse(found)

    async def _show(self, _: Request) -> Response:
        if self._picture is None:
            return Response(status_code=204)
        raw, kind = self._picture
        return Response(raw, media_type=kind)

    async def _read(self, _: Request) -> Response:
        try:
            text, state = self.file.read()
        except EchostepError as error:
            return _no(500, str(error))
        return Response(text, media_type="application/json", headers={"etag": f'"{state}"'})

    async def _write(self, request: Request) -> Response:
        try:
            async with asyncio.timeout(POST_S):
                raw = await _body(request)
        except (TimeoutError, ClientDisconnect):
            return _no(408, f"the plan did not come within {POST_S:.0f} s")
        if raw is None:
            return _no(413, f"larger than {MOST_BODY // 1_000_000} MB")
        try:
            plan = parse_plan(raw)
        except ValueError as error:
            return _no(422, str(error))
        try:
            known = request.headers.get("if-match")
            if known is not None and known.strip('"') != self.file.state():
                return _no(409, f"{self.file.path.name} has changed since this page read it")
            state = self.file.write(plan)
        except EchostepError as error:
            return _no(500, str(error))
        return JSONResponse({"saved": self.file.path.name}, headers={"etag": f'"{state}"'})


async def _body(request: Request) -> bytes | None:
    """What was posted; None when it is too large."""
    raw = bytearray()
    async for part in request.stream():
        raw += part
        if len(raw) > MOST_BODY:
            return None
    return bytes(raw)


def _no(status: int, why: str) -> Response:
    return JSONResponse({"error": why[:500]}, status)


def _empty(name: str) -> Plan:
    return Plan(name, (Level("Ground floor", 0.0, np.zeros((0, 4))),), None, "")


def _picture(path: Path) -> tuple[bytes, str]:
    """Bytes and kind of a picture: PNG, JPEG or SVG, told by what it holds."""
    try:
        if path.stat().st_size > MOST_PICTURE:
            raise EchostepError(f"{path}: larger than {MOST_PICTURE // 1_000_000} MB: make the picture smaller")
        raw = path.read_bytes()
    except OSError as error:
        raise EchostepError(f"{path}: cannot read the picture: {error.strerror or error}") from error
    if raw.startswith(b"\x89PNG\r\n\x1a\n"):
        return raw, "image/png"
    if raw.startswith(b"\xff\xd8\xff"):
        return raw, "image/jpeg"
    if b"<svg" in raw[:4096]:
        return raw, "image/svg+xml"
    raise EchostepError(f"{path}: neither PNG, JPEG nor SVG: convert the picture to one of these")


def edit_plan(plan: Path, picture: Path | None, port: int | None, *, browser: bool) -> None:
    """Serve the page until Ctrl-C."""
    import webbrowser

    with EditServer(plan, picture, port) as server:
        print(f"Draw {plan} at {server.url} (until Ctrl-C).", flush=True)
        if browser:
            webbrowser.open(server.url)
        server.wait()
