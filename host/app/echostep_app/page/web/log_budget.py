# SPDX-License-Identifier: MIT
"""Log lines of the libraries that serve the page: they go to the page's faults, which keep few, instead of the terminal.

In: log records. Out: texts for `Faults`. Owns the handlers while it is entered.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager

LOGGERS = ("asyncio", "uvicorn", "websockets")
LONGEST = 200  # characters


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
