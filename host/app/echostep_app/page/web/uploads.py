# SPDX-License-Identifier: MIT
"""Files that are dropped onto a page: its posts -> files in a temporary folder.

In: requests of pages, which may be hostile. Out: files, opened by a function that may refuse them; a sentence as the answer. Owns the folder, its
limits, and the order: one file is taken at a time.
"""

from __future__ import annotations

import asyncio
import tempfile
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Self

from starlette.requests import ClientDisconnect, Request
from starlette.responses import PlainTextResponse, Response

from echostep.errors import EchostepError, words_of

MOST_FILE = 1 << 30  # bytes; an hour of walking is about 60 MB
MOST_NAME = 100  # characters of a file's name
MOST_SENTENCE = 400  # characters of an answer


class Uploads:
    """`take` answers a post; `open_file` gets the stored file and returns the answer, or raises EchostepError. `again` takes the button's post."""

    def __init__(self, open_file: Callable[[Path], str], without_plan: Callable[[], str]) -> None:
        self._open, self._without_plan = open_file, without_plan
        self._folder = tempfile.TemporaryDirectory(prefix="echostep-page-", ignore_cleanup_errors=True)
        self._count = 0
        self._one_at_a_time = asyncio.Lock()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._folder.cleanup()

    async def take(self, request: Request) -> Response:
        """Store the body of a post under `?name=` and open it."""
        async with self._one_at_a_time:
            path = self._path(request.query_params.get("name", ""))
            try:
                path.parent.mkdir()
                await _store(request, path)
                return PlainTextResponse(await asyncio.to_thread(self._open, path))
            except (EchostepError, OSError) as error:
                path.unlink(missing_ok=True)
                return _refused(words_of(error).replace(f"{path.parent}/", ""))
            except ClientDisconnect:
                path.unlink(missing_ok=True)
                return _refused(f"{path.name} did not arrive whole: drop it again")

    async def play_without_plan(self, _: Request) -> Response:
        """The recording is played without a plan."""
        try:
            return PlainTextResponse(await asyncio.to_thread(self._without_plan))
        except EchostepError as error:
            return _refused(words_of(error))

    def _path(self, name: str) -> Path:
        """Where a file of this name is stored: each in a folder of its own."""
        self._count += 1
        plain = "".join(c if c.isalnum() or c in "-_. ()" else "_" for c in name)[-MOST_NAME:].lstrip(".")
        return Path(self._folder.name) / str(self._count) / (plain or "file")


async def _store(request: Request, path: Path) -> None:
    """Write the body of a request; raises EchostepError when it is too large."""
    length = request.headers.get("content-length", "")
    size = int(length) if length.isdecimal() and len(length) < 20 else 0
    with path.open("xb") as file:
        async for part in request.stream():
            size = max(size, file.tell() + len(part))
            if size > MOST_FILE:
                raise EchostepError(
                    f"{path.name}: larger than {MOST_FILE >> 30} GiB: echostep cut takes a piece out of it, "
                    "echostep replay plays it whole"
                )
            file.write(part)


def _refused(sentence: str) -> Response:
    return PlainTextResponse(sentence[:MOST_SENTENCE], 422)
