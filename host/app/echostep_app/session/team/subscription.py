# SPDX-License-Identifier: MIT
"""The subscription of a run to its team: one connection to the broker it publishes to, for all who read there.

In: topics with their readers; messages of the broker, and messages for it. Out: each message to the readers of its topic. Owns the connection, its
thread and the buffer of messages; the tracker never waits for it.
"""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Sequence

from paho.mqtt.client import topic_matches_sub

from echostep_app.team.endpoint import Endpoint
from echostep_app.team.inbox import Inbox, ListenerThread, ReceivedMessage
from echostep_app.team.mqtt.publisher import Listener

LOOK_S = 0.5  # between two looks of a reader at what has come; assumed


class TeamSubscription:
    """`add` readers, then `open`; `look` passes on new messages. Messages that no reader gets are counted in `rejected`."""

    def __init__(self, broker: Endpoint, print_line: Callable[[str], None]) -> None:
        """`print_line` gets a line for each break of the connection, in another thread."""
        self.rejected: Counter[str] = Counter()
        self._broker, self._print_line = broker, print_line
        self._readers: list[tuple[Sequence[str], Callable[[ReceivedMessage], None]]] = []
        self._inbox = Inbox()
        self._receiver: ListenerThread | None = None

    def add(self, topics: Sequence[str], receive: Callable[[ReceivedMessage], None]) -> Callable[[], bool]:
        """Have messages on these topics passed to a reader; returns a `look` for it, which says whether `LOOK_S` has passed since its last one."""
        self._readers.append((topics, receive))
        looked_s = -math.inf

        def look() -> bool:
            nonlocal looked_s
            if time.monotonic() - looked_s < LOOK_S:
                return False
            looked_s = time.monotonic()
            self.look()
            return True

        return look

    def open(self) -> None:
        """Connect, in a thread."""
        topics = [topic for topics, _ in self._readers for topic in topics]
        self._receiver = ListenerThread(
            Listener(self._broker, topics, self._inbox.put),
            lambda text: self._print_line(f"{self._broker}: team: {text}"),
        )

    @property
    def fault(self) -> str:
        """Why nothing, or not all, of the team comes and goes at present; empty while all does."""
        fault = self._receiver.fault if self._receiver else ""
        return f"team: {fault}" if fault else ""

    def look(self) -> None:
        """Pass the messages that have come since the last call to their readers; never waits."""
        messages, dropped = self._inbox.take_all()
        self.rejected.update(dropped)
        for message in messages:
            if message.topic is None:
                self.rejected["unknown topic"] += 1
                continue
            for topics, receive in self._readers:
                if any(topic_matches_sub(topic, message.topic) for topic in topics):
                    receive(message)

    def send(self, topic: str, payload: bytes) -> bool:
        """Have the broker keep a message; it waits while the connection is broken. False when too many wait."""
        return self._receiver is not None and self._receiver.send(topic, payload)

    def close(self) -> None:
        """Disconnect."""
        if self._receiver is not None:
            self._receiver.close()
