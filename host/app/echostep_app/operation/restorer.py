# SPDX-License-Identifier: MIT
"""The restorer: after a new connection, what the commanders share is sent again where the broker has lost it.

In: the state of the connection, received topics, the known messages. Out: messages to send, a few at a time. Owns the topics received since then.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterable

from echostep_app.operation.operation import Operation
from echostep_app.team.inbox import ListenerThread, ReceivedMessage
from echostep_app.team.messages.marks import is_shared

RETAINED_S = 2.0  # within which a broker has sent all that it keeps: it does so before anything else
AT_ONCE = 16  # messages at one look: fewer than a connection lets wait (`inbox.MOST_OUTGOING`)
Message = tuple[str, bytes]  # topic and payload


class Restorer:
    """`look` gives the messages that are to be sent now."""

    def __init__(self) -> None:
        self._connected = False
        self._due_s = math.inf
        self._received: set[str] = set()
        self._missing: deque[Message] = deque()

    def look(
        self, connected: bool, received: Iterable[str], known: Callable[[], Iterable[Message]], now_s: float
    ) -> list[Message]:
        """Messages of `known` whose topic the broker has not sent since the connection; `received`: topics since the last call."""
        if connected != self._connected:
            self._connected, self._due_s = connected, now_s + RETAINED_S if connected else math.inf
            self._received.clear()
            self._missing.clear()
        if not connected:
            return []
        if self._due_s < math.inf:
            self._received.update(received)
        if now_s >= self._due_s:
            self._due_s = math.inf
            self._missing.extend(message for message in known() if message[0] not in self._received)
            self._received.clear()
        return [self._missing.popleft() for _ in range(min(AT_ONCE, len(self._missing)))]


def restore(
    restorer: Restorer, operation: Operation, receiver: ListenerThread, believed: list[ReceivedMessage], now_s: float
) -> None:
    """Send marks and acknowledgements again that the broker has lost or replaced; `believed`: messages since the last call."""
    topics = [m.topic for m in believed if m.topic and is_shared(m.topic)]
    lost = restorer.look(receiver.connected, topics, lambda: operation.shared, now_s)
    for topic, payload in lost + operation.take_answers():
        receiver.send(topic, payload)
