# SPDX-License-Identifier: MIT
"""The tape: an operation's file with the state at some moments, from which it is played on while it is written too.

In: keyframes (the state at some moments). Out: the one from which a moment is reached. Owns the keyframes; their number is bounded: when there are
too many, every second one is forgotten.
"""

from __future__ import annotations

import math
import threading
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from echostep_app.operation.operation import Operation

# Assumed, all of them.
MESSAGES, SPAN_S = 5000, 300.0  # between two keyframes at most, at first: 0.1 to 0.7 s of work
MOST_KEYFRAMES = 256  # a keyframe of 200 wearers takes about 1 MB


@dataclass(frozen=True, slots=True)
class Keyframe:
    """The state of an operation at `t_s`; reading goes on at byte `offset`."""

    t_s: float
    unix_s: float
    offset: int
    connected: bool
    operation: Operation


class Tape:
    """`note` takes the states of an operation. `grows`: the file is being written. Thread-safe."""

    def __init__(self, path: Path, *, grows: bool) -> None:
        self.path, self.grows = path, grows
        self.end_s = -math.inf
        self._keyframes: list[Keyframe] = []
        self._lock = threading.Lock()
        self._messages, self._span_s = MESSAGES, SPAN_S
        self._since = 0  # messages since the last keyframe

    @property
    def span_s(self) -> tuple[float, float] | None:
        """The first and the last moment; None while there is none."""
        with self._lock:
            return (self._keyframes[0].t_s, self.end_s) if self._keyframes else None

    def note(self, t_s: float, messages: int, state: Callable[[], Keyframe] | None) -> None:
        """The operation has reached `t_s`, with so many more messages; its `state` is kept when one is due. None: there is no way on from it."""
        self.end_s = max(self.end_s, t_s)
        self._since += messages
        is_due = not self._keyframes or self._since >= self._messages or t_s - self._keyframes[-1].t_s >= self._span_s
        if state is None or not is_due:
            return
        keyframe = state()
        with self._lock:
            self._since = 0
            self._keyframes.append(keyframe)
            if len(self._keyframes) > MOST_KEYFRAMES:
                del self._keyframes[1::2]
                self._messages, self._span_s = 2 * self._messages, 2.0 * self._span_s

    def before(self, t_s: float) -> Keyframe:
        """The last keyframe at or before a time, else the first one, of a tape that has one."""
        with self._lock:
            k = bisect_right(self._keyframes, t_s, key=lambda keyframe: keyframe.t_s)
            return self._keyframes[max(k - 1, 0)]
