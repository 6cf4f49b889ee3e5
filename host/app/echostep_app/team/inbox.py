# SPDX-License-Identifier: MIT
"""The inbox: a bounded buffer between the broker's messages and the commander's view, which empties it a few times a second; and the way back.

In: messages from a `Subscription`, in its own thread. Out: the newest messages of each topic, on demand. Owns the thread and the limits: a flood on
one topic drops older messages of that topic only, and memory stays bounded.
"""

from __future__ import annotations

import threading
import time
from collections import Counter, deque
from collections.abc import Callable
from typing import NamedTuple, Protocol

from echostep_app.team.faults import in_words
from echostep_app.team.messages.report import MAX_PAYLOAD
from echostep_app.team.outbox import RETRY_PAUSES_S, Answer

MESSAGES_PER_TOPIC = 8  # kept until the next look: trackers send about two a second
MAX_TOPICS = 1024
MOST_OUTGOING = 64  # messages to the broker that wait
MOST_TRIES = 5  # to publish a message; one at which the connection breaks every time holds up those behind it
PACKET_WAIT_S = 0.1
PROBE_S = 0.5  # between two answers of the broker


class ReceivedMessage(NamedTuple):
    """A payload as it was received; `received_s` on the monotonic clock, `unix_s` in Unix time."""

    topic: str | None
    payload: bytes
    retained: bool
    received_s: float
    unix_s: float


class Inbox:
    """`put` keeps a message; `take_all` returns the kept ones, and how many were dropped, by reason."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._messages: dict[str | None, deque[ReceivedMessage]] = {}
        self._dropped: Counter[str] = Counter()

    def put(self, topic: str | None, payload: bytes, retained: bool) -> None:
        """Keep a message; never blocks for longer than microseconds."""
        with self._lock:
            if len(payload) > MAX_PAYLOAD:
                self._dropped["too long"] += 1
                return
            messages = self._messages.get(topic)
            if messages is None:
                if len(self._messages) >= MAX_TOPICS:
                    self._dropped["flood of topics"] += 1
                    return
                messages = self._messages[topic] = deque(maxlen=MESSAGES_PER_TOPIC)
            if len(messages) == MESSAGES_PER_TOPIC:
                self._dropped["flood"] += 1
            messages.append(ReceivedMessage(topic, payload, retained, time.monotonic(), time.time()))

    def take_all(self) -> tuple[list[ReceivedMessage], Counter[str]]:
        """The kept messages, oldest first, and the counts of dropped ones; both are reset."""
        with self._lock:
            messages, self._messages = self._messages, {}
            dropped, self._dropped = self._dropped, Counter()
        waiting = [message for of_topic in messages.values() for message in of_topic]
        return sorted(waiting, key=lambda message: message.received_s), dropped


class Subscription(Protocol):
    """Where messages come from: a broker."""

    def open(self) -> str:
        """Connect; returns the refused part in words, empty if there is none; raises OSError."""

    def run_once(self, timeout_s: float) -> None:
        """Wait for one message and pass it on; raises OSError when the connection is broken."""

    def probe(self) -> None:
        """Wait for an answer; raises OSError."""

    def publish(self, topic: str, payload: bytes) -> None:
        """Have the broker keep a message; raises OSError."""

    def close(self) -> None:
        """Disconnect; raises nothing."""


class ListenerThread:
    """Runs a listener in a thread until `close`, and connects again after each break.

    `fault`: why nothing, or not all, comes and goes at present; empty while all does. A broker that does not answer is not connected.
    """

    def __init__(self, listener: Subscription, print_line: Callable[[str], None]) -> None:
        self._connected, self._fault, self._answer = False, "", Answer()
        self._refused = ""  # of the subscription
        self._told: set[str] = set()
        self._failures = 0  # to connect, in a row
        self._outgoing: deque[tuple[str, bytes]] = deque()
        self._tries = 0  # to publish the first of these
        self._listener, self._print_line = listener, print_line
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._work, name="receiver", daemon=True)
        self._thread.start()

    @property
    def connected(self) -> bool:
        """Whether messages come and go."""
        return self._connected and not self._answer.words

    @property
    def fault(self) -> str:
        """Why not all of them do."""
        return self._fault or self._answer.words

    def send(self, topic: str, payload: bytes) -> bool:
        """Have the broker keep a message; it waits while the connection is broken. False when too many wait."""
        if len(self._outgoing) >= MOST_OUTGOING:
            return False
        self._outgoing.append((topic, payload))
        return True

    @property
    def waiting(self) -> int:
        """How many messages wait for the broker."""
        return len(self._outgoing)

    def close(self) -> None:
        """Disconnect and end the thread; says how many messages were not sent."""
        self._closing.set()
        self._thread.join(12.0)
        if self.waiting:
            self._print_line(f"not sent: {self.waiting} of the messages that waited for the broker")

    def _work(self) -> None:
        while not self._closing.is_set():
            try:
                with self._answer:
                    refused = self._listener.open()
                self._exchange(refused)
            except Exception as error:  # any fault is printed, then the connection is tried again
                self._handle_break(error)
        self._listener.close()

    def _exchange(self, refused: str) -> None:
        """Pass messages both ways until `close`; `refused`: of the subscription, in words. Raises OSError when the connection breaks."""
        self._connected, probed_s = True, time.monotonic()
        self._listener.run_once(PACKET_WAIT_S)  # a connection that breaks at once is none
        if self._failures:
            self._print_line("connected again")
        self._failures, self._refused = 0, refused
        self._tell(refused)
        while not self._closing.is_set():
            while self._outgoing:
                self._publish_first()
            if time.monotonic() - probed_s > PROBE_S:
                with self._answer:
                    self._listener.probe()
                probed_s = time.monotonic()
            self._listener.run_once(PACKET_WAIT_S)

    def _handle_break(self, error: Exception) -> None:
        """Close the connection and wait before the next try; the first failure of a series is printed."""
        self._connected = False
        self._listener.close()
        self._fault = in_words(error)
        if self._failures == 0:
            self._print_line(f"{self._fault}; trying again")
        self._closing.wait(RETRY_PAUSES_S[min(self._failures, len(RETRY_PAUSES_S) - 1)])
        self._failures += 1

    def _tell(self, fault: str) -> None:
        """Keep a fault of a connection that works otherwise; each is printed once."""
        self._fault = fault
        if fault and fault not in self._told:
            self._told.add(fault)
            self._print_line(fault)

    def _publish_first(self) -> None:
        """Publish the message that has waited longest; after MOST_TRIES it is given up. Raises OSError."""
        topic, payload = self._outgoing[0]
        self._tries += 1
        try:
            with self._answer:
                self._listener.publish(topic, payload)
        except PermissionError as error:
            self._drop_first()
            self._tell(f"the broker does not accept what is sent on {topic} ({error}): check its access rules")
            return
        except OSError:
            if self._tries >= MOST_TRIES:
                self._drop_first()
                self._print_line(
                    f"a message of {len(payload)} bytes on {topic} is given up: the broker does not take it"
                )
            raise
        self._drop_first()
        self._fault = self._refused

    def _drop_first(self) -> None:
        self._outgoing.popleft()
        self._tries = 0
