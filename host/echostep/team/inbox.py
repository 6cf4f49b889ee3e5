"""The inbox: what a broker brings, kept short, for a commander who looks a few times a second.

In: messages from a listener, in a thread of its own. Out: for each topic the newest few, on demand. Owns the thread and the bounds: a flood on one
topic costs that topic its older messages, never the others theirs, and never memory.
"""

from __future__ import annotations

import threading
import time
from collections import Counter, deque
from collections.abc import Callable
from typing import NamedTuple

from echostep.team.mqtt import Listener
from echostep.team.outbox import BACKOFF_S
from echostep.team.report import MAX_PAYLOAD

PER_TOPIC = 8
MOST_TOPICS = 1024
TURN_S = 0.1


class Letter(NamedTuple):
    """A payload as it came; `heard_s` by the monotonic clock, `unix_s` by the wall clock."""

    topic: str | None
    payload: bytes
    retained: bool
    heard_s: float
    unix_s: float


class Inbox:
    """`take` what has come since the last time, and how many messages were refused for what reason."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._letters: dict[str | None, deque[Letter]] = {}
        self._refused: Counter[str] = Counter()

    def hear(self, topic: str | None, payload: bytes, retained: bool) -> None:
        """Keep a message; microseconds."""
        with self._lock:
            if len(payload) > MAX_PAYLOAD:
                self._refused["too long"] += 1
                return
            letters = self._letters.get(topic)
            if letters is None:
                if len(self._letters) >= MOST_TOPICS:
                    self._refused["flood of topics"] += 1
                    return
                letters = self._letters[topic] = deque(maxlen=PER_TOPIC)
            if len(letters) == PER_TOPIC:
                self._refused["flood"] += 1
            letters.append(Letter(topic, payload, retained, time.monotonic(), time.time()))

    def take(self) -> tuple[list[Letter], Counter[str]]:
        """Everything kept, oldest first within a topic."""
        with self._lock:
            letters, self._letters = self._letters, {}
            refused, self._refused = self._refused, Counter()
        return [letter for of_topic in letters.values() for letter in of_topic], refused


class Reception:
    """Runs a listener in a thread, through every break, until `close`."""

    def __init__(self, listener: Listener, say: Callable[[str], None]) -> None:
        self.connected = False
        self._listener, self._say = listener, say
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._work, name="reception", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the thread."""
        self._closing.set()
        self._thread.join(12.0)

    def _work(self) -> None:
        failures = 0
        while not self._closing.is_set():
            try:
                self._listener.open()
                if failures:
                    self._say("connected again")
                failures, self.connected = 0, True
                while not self._closing.is_set():
                    self._listener.turn(TURN_S)
            except Exception as error:  # whatever it is, it is said and tried again
                self.connected = False
                self._listener.close()
                if failures == 0:
                    self._say(f"{error}; trying again")
                self._closing.wait(BACKOFF_S[min(failures, len(BACKOFF_S) - 1)])
                failures += 1
        self._listener.close()
