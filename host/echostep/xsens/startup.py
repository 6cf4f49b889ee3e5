"""The MTx on a live port: set up at the start, and again whenever it wakes up.

In: the chunks of all ports, in order, after they were recorded. Out: bytes to the MTx, and lines for people. Owns the setup.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from echostep.errors import EchostepError
from echostep.ports.chunks import MTX, Chunk
from echostep.xsens.requests import project_requests
from echostep.xsens.setup import MtxSetup, State


class MtxStart:
    """Follows the MTx's bytes and talks to it; raises EchostepError when it measures in a mode that cannot be used and does not listen."""

    def __init__(self, rate_hz: float, send: Callable[[bytes], None], say: Callable[[str], None]) -> None:
        """`send` writes to the MTx's port, `say` tells the wearer."""
        try:
            requests = project_requests(rate_hz)
        except ValueError as error:
            raise EchostepError(str(error)) from error
        self._setup = MtxSetup(requests, rate_hz)
        self._send, self._say = send, say
        self._usable = False

    def follow(self, chunk: Chunk | None) -> None:
        """Take the next chunk of any port; None when nothing came."""
        was_busy = not self._setup.finished
        wakes = self._setup.wake_ups
        now_s = time.monotonic()
        received, arrived_s = b"", now_s
        if chunk is not None and chunk.port == MTX:
            received, arrived_s = chunk.data, chunk.t_arrival_ns * 1e-9
        if sent := self._setup.advance(received, now_s, arrived_s):
            self._send(sent)
        if self._setup.wake_ups > wakes and self._usable:
            self._say("MTx: it started anew")
        if self._setup.finished and (was_busy or self._setup.wake_ups > wakes):
            self._conclude()

    def _conclude(self) -> None:
        state = self._setup.state
        if state is State.WRONG_MODE and not self._usable:
            raise EchostepError(self._setup.verdict)
        self._usable = self._usable or state in (State.CONFIGURED, State.UNANSWERED)
        self._say(self._setup.verdict)
