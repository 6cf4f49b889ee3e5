# SPDX-License-Identifier: MIT
"""The tape: an operation's file that is played from any moment on, while it is written too.

In: the file, keyframes (the state at some moments). Out: `Player`s, each with an operation of its own that goes on with the recorded messages by the
same code as the live one. Owns the keyframes; their number is bounded: when there are too many, every second one is forgotten.
"""

from __future__ import annotations

import math
import threading
from bisect import bisect_right
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from echostep.errors import EchostepError
from echostep.ports.chunks import Portion
from echostep.recording.reading import Recording
from echostep_app.operation.operation import Operation, TableScene
from echostep_app.operation.recorded.record import OPERATION, Condition, Heard, decode_record
from echostep_app.team.inbox import ReceivedMessage

# Assumed, all of them.
STEP_S = 0.25  # of an operation that is played: a state changes at most so much later than it did
MOST_STEPS = 1000  # for one gap without messages, so that a damaged time does not keep the player busy
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
    """`keep` stores a keyframe; `player` returns a player at a time. `grows`: the file is being written. Thread-safe."""

    def __init__(self, path: Path, *, grows: bool) -> None:
        self.path, self.grows = path, grows
        self.end_s = -math.inf
        self._keyframes: list[Keyframe] = []
        self._lock = threading.Lock()
        self._messages, self._span_s = MESSAGES, SPAN_S
        self._since = 0  # messages since the last keyframe

    @property
    def begin_s(self) -> float | None:
        """The first moment; None while there is none."""
        with self._lock:
            return self._keyframes[0].t_s if self._keyframes else None

    def note(self, t_s: float, messages: int) -> bool:
        """The operation has reached `t_s`, with so many more messages; returns whether a keyframe is due."""
        self.end_s = max(self.end_s, t_s)
        self._since += messages
        last_s = self._keyframes[-1].t_s if self._keyframes else -math.inf
        return self._since >= self._messages or (t_s - last_s >= self._span_s)

    def keep(self, keyframe: Keyframe) -> None:
        """Remember a state."""
        with self._lock:
            self._since = 0
            self._keyframes.append(keyframe)
            self.end_s = max(self.end_s, keyframe.t_s)
            if len(self._keyframes) > MOST_KEYFRAMES:
                del self._keyframes[1::2]
                self._messages, self._span_s = 2 * self._messages, 2.0 * self._span_s

    def before(self, t_s: float) -> Keyframe | None:
        """The last keyframe at or before a time, else the first one."""
        with self._lock:
            k = bisect_right(self._keyframes, t_s, key=lambda keyframe: keyframe.t_s)
            return self._keyframes[max(k - 1, 0)] if self._keyframes else None

    def player(self, keyframe: Keyframe) -> Player:
        """A player that begins at a keyframe."""
        return Player(self.path, keyframe, grows=self.grows)


class Player:
    """Plays a file on from a keyframe: `advance` brings `operation` to a later time."""

    def __init__(self, path: Path, keyframe: Keyframe, *, grows: bool) -> None:
        self.operation = keyframe.operation.copy()
        self.t_s, self.unix_s, self.connected = keyframe.t_s, keyframe.unix_s, keyframe.connected
        self.offset = keyframe.offset  # behind the messages that are read; -1: inside a compressed part of the file
        self.ended = False
        self.unknown = 0  # chunks that are no record
        self.file = Recording(path, grows=grows)
        self._opened = False
        self._portions: Iterator[Portion] = iter(())
        self._waiting: deque[tuple[float, Heard | Condition]] = deque()

    def advance(self, to_s: float) -> None:
        """Bring the operation to `to_s`."""
        while self.t_s < to_s:
            self.step(to_s)

    def step(self, to_s: float = math.inf) -> int:
        """Take the messages of the next `STEP_S` at most, not beyond `to_s`; returns how many. At the end of the file `ended` is set."""
        if not self._waiting:
            self._read()
        if not self._waiting and math.isinf(to_s):
            self.ended = True
            return 0
        next_s = self._waiting[0][0] if self._waiting else to_s
        ahead_s = min(next_s, to_s) - self.t_s
        end_s = min(to_s, self.t_s + max(STEP_S, ahead_s / MOST_STEPS))
        unix_s, messages = self.unix_s + end_s - self.t_s, self._messages_until(end_s)
        if self._taken is not None:
            t_s, taken_unix_s = self._taken
            if not self._waiting:  # the next ones are not read yet
                end_s = max(t_s, self.t_s)
            unix_s = taken_unix_s + end_s - t_s
        self.operation.receive(messages, {}, end_s, unix_s)
        self.t_s, self.unix_s = end_s, unix_s
        return len(messages)

    @property
    def resumes(self) -> bool:
        """Whether another player can go on from `offset`: all records before it have been taken."""
        return not self._waiting and self.offset >= 0

    def first(self) -> tuple[float, float] | None:
        """Time and Unix time of the next record; None when there is none."""
        self._read()
        return (self._waiting[0][0], self._waiting[0][1].unix_s) if self._waiting else None

    def _messages_until(self, end_s: float) -> list[ReceivedMessage]:
        """Take the records until a time: messages are returned, the rest is applied. Sets `_taken`, times of the last one."""
        messages: list[ReceivedMessage] = []
        self._taken: tuple[float, float] | None = None
        while self._waiting and self._waiting[0][0] <= end_s:
            t_s, record = self._waiting.popleft()
            self._taken = t_s, record.unix_s
            if isinstance(record, Heard):
                messages.append(ReceivedMessage(record.topic, record.payload, record.retained, t_s, record.unix_s))
            else:
                self.connected = record.connected
                self.operation.set_counts(record.received, record.rejected)
        return messages

    def scene(self) -> TableScene:
        """The present moment of the player."""
        return self.operation.scene(self.t_s, self.unix_s, connected=self.connected)

    def _read(self) -> None:
        """Read the next portion with records; none is left at the end of the file."""
        while not self._waiting:
            portion = next(self._portions, None)
            if portion is None and (self.file.grows or not self._opened):
                portion = self._read_on()
            if portion is None:
                return
            self.offset, newest_s = self.file.resume, self.t_s
            for chunk in portion.chunks():
                record = decode_record(chunk.data) if chunk.port == OPERATION else None
                newest_s = max(newest_s, 1e-9 * chunk.t_arrival_ns)
                if record is None:
                    self.unknown += 1
                else:
                    self._waiting.append((newest_s, record))

    def _read_on(self) -> Portion | None:
        """The first portion behind the last one, of a file that may have grown."""
        self._opened = True
        try:
            self._portions = self.file.portions_from(max(self.offset, 0))
            return next(self._portions, None)
        except EchostepError:
            if self.file.grows:
                return None  # nothing of it is on the disk yet
            raise


def load(tape: Tape, operation: Operation) -> Iterator[Player]:
    """Read a whole file and keep its keyframes; gives the player, whose operation goes on, after each step."""
    player = Player(tape.path, Keyframe(0.0, 0.0, 0, connected=True, operation=operation), grows=False)
    first = player.first()
    if first is None:
        return
    player.t_s, player.unix_s = first
    player.operation = operation
    tape.keep(Keyframe(player.t_s, player.unix_s, 0, connected=True, operation=operation.copy()))
    while not player.ended:
        count = player.step()
        if tape.note(player.t_s, count) and player.resumes:
            tape.keep(Keyframe(player.t_s, player.unix_s, player.offset, player.connected, operation.copy()))
        yield player
