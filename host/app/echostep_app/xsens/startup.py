# SPDX-License-Identifier: MIT
"""Setup of the MTx on a live port: at the start, and again after each WakeUp.

In: the chunks of all ports, in order, after they were recorded. Out: bytes to the MTx, and messages for the terminal. Owns the `MtxSetup`.
"""

from __future__ import annotations

from collections.abc import Callable

from echostep.errors import EchostepError
from echostep.ports.chunks import MTX, Chunk
from echostep_app.ports.arrival_clock import now_s as clock_s
from echostep_app.xsens.requests import project_requests
from echostep_app.xsens.setup import MtxSetup, State


class MtxStart:
    """Passes the MTx's bytes to `MtxSetup` and sends its requests; raises EchostepError for an unusable format that cannot be changed."""

    def __init__(self, rate_hz: float, send: Callable[[bytes], None], say: Callable[[str], None]) -> None:
        """`send` writes to the MTx's port, `say` prints a message."""
        try:
            requests = project_requests(rate_hz)
        except ValueError as error:
            raise EchostepError(str(error)) from error
        self._setup = MtxSetup(requests, rate_hz)
        self._send, self._say = send, say
        self._usable = False  # whether the MTx was once in the wanted format

    @property
    def product(self) -> str:
        """Product code of the device; "" until it is received."""
        return self._setup.product

    def advance(self, chunk: Chunk | None) -> None:
        """Process the next chunk of any port; None when nothing was received, so that timeouts are checked."""
        was_busy = not self._setup.finished
        wake_ups = self._setup.wake_ups
        now_s = clock_s()
        received, arrived_s = b"", now_s
        if chunk is not None and chunk.port == MTX:
            received, arrived_s = chunk.data, chunk.t_arrival_ns * 1e-9
        if sent := self._setup.advance(received, now_s, arrived_s):
            self._send(sent)
        if self._setup.wake_ups > wake_ups and self._usable:
            self._say("MTx: restarted")
        if self._setup.finished and (was_busy or self._setup.wake_ups > wake_ups):
            self._report_result()

    def _report_result(self) -> None:
        """Print the result of the setup; raise it as an error when the MTx was never usable."""
        state = self._setup.state
        if state is State.WRONG_MODE and not self._usable:
            raise EchostepError(self._setup.verdict)
        self._usable = self._usable or state in (State.CONFIGURED, State.UNANSWERED)
        self._say(self._setup.verdict)
