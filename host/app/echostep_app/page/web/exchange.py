# SPDX-License-Identifier: MIT
"""Messages between a run and its pages other than scenes: signs of life of the run, and answers to requests.

In: signs of life of the run; requests with an identity, which a page sends again until it has the answer. Out: the age of the run's last sign of
life; the answer, the same one however often the request comes. Owns the answers. The run's thread writes one number, the server's thread reads it.
"""

from __future__ import annotations

import secrets
import time
from collections import OrderedDict
from collections.abc import Awaitable, Callable

MOST_ANSWERS = 1000  # of which the oldest is forgotten first: hours of a person's requests


class Exchange:
    """`run`: a random name of this run. `note_alive`: the run works; `rest`: nothing new is expected any more."""

    def __init__(self) -> None:
        self.run = secrets.token_hex(4)
        self._alive_s: float | None = None
        self._answers: OrderedDict[str, str] = OrderedDict()

    def note_alive(self) -> None:
        """The run has just taken its input."""
        self._alive_s = time.monotonic()

    def rest(self) -> None:
        """The run is over."""
        self._alive_s = None

    @property
    def age_s(self) -> float:
        """Seconds since the run was last alive; 0 before its first sign of life and after its end."""
        alive_s = self._alive_s
        return 0.0 if alive_s is None else time.monotonic() - alive_s

    def knows(self, identity: str) -> bool:
        """Whether this request has come before."""
        return identity in self._answers

    async def once(self, identity: str, act: Callable[[], Awaitable[str]]) -> str:
        """The answer to a request, which is carried out when it comes for the first time: the reason of a refusal, or nothing."""
        if identity not in self._answers:
            # Stays if it does: such a request does not come for ever
            self._answers[identity] = "The program failed on this."
            self._answers[identity] = await act()
            if len(self._answers) > MOST_ANSWERS:
                self._answers.popitem(last=False)
        return self._answers[identity]
