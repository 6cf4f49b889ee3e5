# SPDX-License-Identifier: MIT
"""Faults of the server: exceptions in words, for the log and for the page; log lines of the libraries that serve it, instead of the terminal.

In: exceptions that no code of the page handles, log records. Out: texts. Owns texts that are not printed yet; each is logged once, because a page
tries again and again.
"""

from __future__ import annotations

import logging
import traceback
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

MOST_KEPT = 20  # different texts; further ones are not logged
LOGGERS = ("asyncio", "uvicorn", "websockets")
LONGEST = 200  # characters


class Faults:
    """Call `note` with an exception; `notices` holds the texts for the terminal."""

    def __init__(self) -> None:
        self.notices: deque[str] = deque(maxlen=MOST_KEPT)
        self._known: set[str] = set()

    def note(self, error: BaseException) -> str:
        """The exception in words, with the line of code that raised it."""
        return self.note_text(_described(error))

    def note_end(self, error: BaseException) -> None:
        """The server's thread has ended before the run."""
        self.notices.append(f"The page is no longer served: {_described(error)}. The run goes on without it.")

    def note_text(self, what: str) -> str:
        """A fault that is not an exception, in words."""
        text = f"The page's server has a fault: {what}"
        if text not in self._known and len(self._known) < MOST_KEPT:
            self._known.add(text)
            self.notices.append(f"{text}. Please report it: the run goes on, and so does the page.")
        return text


def _described(error: BaseException) -> str:
    return f"{type(error).__name__}: {str(error)[:200]}{_place(error)}"


def _place(error: BaseException) -> str:
    """File and line of the innermost frame."""
    frames = traceback.extract_tb(error.__traceback__)
    return f" ({Path(frames[-1].filename).name}, line {frames[-1].lineno})" if frames else ""


class _Handler(logging.Handler):
    """Passes the text of each record on."""

    def __init__(self, note: Callable[[str], object]) -> None:
        super().__init__(logging.WARNING)
        self._note = note

    def emit(self, record: logging.LogRecord) -> None:
        """Pass the first line of a record on; a record that cannot be formatted is passed on as it is."""
        try:
            text = record.getMessage()
        except (TypeError, ValueError):
            text = str(record.msg)
        self._note(f"{record.name}: {text.splitlines()[0][:LONGEST] if text else ''}")


@contextmanager
def logged_to(note: Callable[[str], object]) -> Iterator[None]:
    """Have `note` called with each warning and error of the libraries."""
    handler = _Handler(note)
    loggers = [logging.getLogger(name) for name in LOGGERS]
    propagated = [logger.propagate for logger in loggers]
    for logger in loggers:
        logger.addHandler(handler)
        logger.propagate = False
    try:
        yield
    finally:
        for logger, before in zip(loggers, propagated, strict=True):
            logger.removeHandler(handler)
            logger.propagate = before
