# SPDX-License-Identifier: MIT
"""Faults of the server: exceptions in words, for the log and for the page.

In: exceptions that no code of the page handles. Out: texts. Owns texts that are not printed yet; each is logged once, because a page tries again and
again.
"""

from __future__ import annotations

import traceback
from collections import deque
from pathlib import Path

MOST_KEPT = 20  # different texts; further ones are not logged


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

    def tell(self, sentence: str) -> None:
        """A sentence that is not a fault of the server, for the terminal."""
        self.notices.append(sentence)

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
