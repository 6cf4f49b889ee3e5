# SPDX-License-Identifier: MIT
"""Arrival times that cannot be true are corrected by their neighbours.

In: messages of a recording in the order of the file. Out: the same messages; the chunks of each port in order of time. Owns the messages that wait
for the next one of their port, and the number of corrected times.

One thread reads a port, so its arrival times never decrease. A time that is not between the times of the chunks before and after is replaced by the
later one: bytes that arrive late harm no clock, bytes that arrive early do.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

from echostep.recording.mcap_records import port_of
from echostep_app.recording.repair.recovery import RecordedMessage

MOST_WAITING = 4096  # messages: some seconds of a walk, while another port is silent


@dataclass(slots=True)
class _Waiting:
    """A message that waits for the next one of its port; `port` is empty for a derived one, which does not wait."""

    message: RecordedMessage
    port: str
    settled: bool


@dataclass
class ArrivalOrder:
    """Corrects the messages of one recording; `corrected` counts them."""

    corrected: int = 0
    _waiting: deque[_Waiting] = field(default_factory=deque)
    _newest: dict[str, _Waiting] = field(default_factory=dict)  # by port
    _before_ns: dict[str, int] = field(default_factory=dict)  # by port: time of the last settled chunk

    def correct(self, messages: Iterable[RecordedMessage]) -> Iterator[RecordedMessage]:
        """The messages, chunks with corrected times."""
        for message in messages:
            port = port_of(message.channel)
            if port and port in self._newest:
                self._settle(self._newest[port], message.t_ns)
            waiting = _Waiting(message, port, not port)
            if port:
                self._newest[port] = waiting
            self._waiting.append(waiting)
            while self._waiting and (self._waiting[0].settled or len(self._waiting) > MOST_WAITING):
                yield self._pop()
        while self._waiting:
            yield self._pop()

    def _settle(self, waiting: _Waiting, next_ns: int) -> None:
        """Decide the time of a chunk whose successor is known."""
        if waiting.settled:
            return
        before_ns = self._before_ns.get(waiting.port, -1)
        if before_ns <= next_ns and not before_ns <= waiting.message.t_ns <= next_ns:
            waiting.message = waiting.message._replace(t_ns=next_ns)
            self.corrected += 1
        waiting.settled = True
        self._before_ns[waiting.port] = waiting.message.t_ns

    def _pop(self) -> RecordedMessage:
        """The oldest message; without a successor its time stays."""
        waiting = self._waiting.popleft()
        if not waiting.settled:
            waiting.settled = True
            self._before_ns[waiting.port] = waiting.message.t_ns
        return waiting.message
