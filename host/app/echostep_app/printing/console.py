# SPDX-License-Identifier: MIT
"""Consoles for people: they move their own cursor, and let no text do so.

In: what rich can render. Out: text on standard output, or on standard error. Owns nothing.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from typing import Any

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment

from echostep_app.printing.lines import shown


class PeopleConsole(Console):
    """A console that moves its own cursor, and lets no text do so."""

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """The segments; text as it is shown."""
        for segment in super().render(renderable, options):
            yield segment if segment.control else Segment(shown(segment.text), segment.style)


def console_for_people(**options: Any) -> PeopleConsole:
    """A console on standard output as it is at each call; each message stays on one line, whatever the width of the terminal."""
    return PeopleConsole(soft_wrap=True, **options)


console = console_for_people()  # that the commands print on


def print_notices(notices: deque[str], to: Console = console) -> None:
    """Print queued messages of a port, of a recorder or of a page, and empty the queue."""
    while notices:
        to.print(notices.popleft(), markup=False)
