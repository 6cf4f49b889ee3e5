# SPDX-License-Identifier: MIT
"""The tape: a recorded operation with its state at some moments, from which any other moment is reached.

In: an operation's file. Out: the state at a time: the recorded messages go through the code that shows them live. Owns the kept states, one a minute.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from echostep.ports.chunks import Portion
from echostep.recording import open_recording
from echostep_app.operation.operation import Operation, TableScene
from echostep_app.operation.recorded.record import OPERATION, Condition, Heard, decode_record
from echostep_app.team.inbox import ReceivedMessage

# Assumed, all of them.
STEP_S = 0.25  # of an operation that is played: a state changes at most so much later than it did
MOST_STEPS = 1000  # for one gap without messages, so that a damaged time does not keep the reader busy
KEYFRAME_S = 60.0  # between two keyframes at least; one of 20 wearers takes about 0.1 MB
PLAYER_STEP_S = 10.0


@dataclass(frozen=True, slots=True)
class Keyframe:
    """The state of an operation at `t_s`; reading goes on at byte `offset`."""

    t_s: float
    unix_s: float
    offset: int
    connected: bool
    operation: Operation


class Reader:
    """Reads a file on from a keyframe: `advance` brings `operation`, at first the keyframe's, to a later time."""

    def __init__(self, path: Path, keyframe: Keyframe) -> None:
        self.operation = keyframe.operation
        self.t_s, self.unix_s, self.connected = keyframe.t_s, keyframe.unix_s, keyframe.connected
        self.unknown = 0  # chunks that are no record
        self.file = open_recording(path)
        self._offset = keyframe.offset  # behind the messages that are read; -1: inside a compressed part of the file
        self._portions: Iterator[Portion] = self.file.portions_from(keyframe.offset)
        self._waiting: deque[tuple[float, Heard | Condition]] = deque()

    def advance(self, to_s: float) -> None:
        """Bring the operation to `to_s`."""
        while self.t_s < to_s:
            self.step(to_s)

    def step(self, to_s: float = math.inf) -> bool:
        """Take the messages of the next `STEP_S` at most, not beyond `to_s`; False at the end of the file."""
        following = self.following()
        if following is None and math.isinf(to_s):
            return False
        ahead_s = min(following[0] if following else to_s, to_s) - self.t_s
        end_s = min(to_s, self.t_s + max(STEP_S, ahead_s / MOST_STEPS))
        unix_s, messages = self.unix_s + end_s - self.t_s, list[ReceivedMessage]()
        while self._waiting and self._waiting[0][0] <= end_s:
            t_s, record = self._waiting.popleft()
            if not self._waiting:  # the next ones are not read yet
                end_s = max(t_s, self.t_s)
            unix_s = record.unix_s + end_s - t_s
            if isinstance(record, Heard):
                messages.append(ReceivedMessage(record.topic, record.payload, record.retained, t_s, record.unix_s))
            else:
                self.connected = record.connected
                self.operation.set_counts(record.received, record.rejected)
        self.operation.receive(messages, {}, end_s, unix_s)
        self.t_s, self.unix_s = end_s, unix_s
        return True

    def following(self) -> tuple[float, Heard | Condition] | None:
        """The next record and its time; None at the end of the file."""
        while not self._waiting and (portion := next(self._portions, None)) is not None:
            self._offset, newest_s = self.file.resume, self.t_s
            for chunk in portion.chunks():
                record = decode_record(chunk.data) if chunk.port == OPERATION else None
                newest_s = max(newest_s, 1e-9 * chunk.t_arrival_ns)
                if record is None:
                    self.unknown += 1
                else:
                    self._waiting.append((newest_s, record))
        return self._waiting[0] if self._waiting else None

    def scene(self) -> TableScene:
        """The present moment of the reader."""
        return self.operation.scene(self.t_s, self.unix_s, connected=self.connected)

    def keyframe(self) -> Keyframe | None:
        """The present state, which later messages do not change; None where another reader could not go on from it."""
        if self._waiting or self._offset < 0:
            return None
        return Keyframe(self.t_s, self.unix_s, self._offset, self.connected, self.operation.copy())


class OperationTape:
    """`read` reads the whole file and keeps its keyframes; meanwhile any thread may ask for a moment that has been read."""

    def __init__(self, path: Path, operation: Operation) -> None:
        """`operation`: without a message; after `read` it is at the end of the file."""
        self.path, self.operation = path, operation
        self._end_s = -math.inf
        self._keyframes: list[Keyframe] = []  # only appended to

    def read(self) -> Iterator[Reader]:
        """Gives the reader, which goes on, after each step; nothing if no record can be read."""
        reader = Reader(self.path, Keyframe(0.0, 0.0, 0, connected=True, operation=self.operation))
        if (first := reader.following()) is None:
            return
        reader.t_s, reader.unix_s = first[0], first[1].unix_s
        self._keyframes.append(Keyframe(reader.t_s, reader.unix_s, 0, connected=True, operation=self.operation.copy()))
        self._end_s = reader.t_s
        while reader.step():
            self._end_s = reader.t_s
            if reader.t_s - self._keyframes[-1].t_s >= KEYFRAME_S and (keyframe := reader.keyframe()) is not None:
                self._keyframes.append(keyframe)
            yield reader

    @property
    def span_s(self) -> tuple[float, float] | None:
        """The first and the last moment by now; None while there is none."""
        return (self._keyframes[0].t_s, self._end_s) if self._keyframes else None

    def stepped(self, t_s: float, steps: int) -> float:
        """The time `steps` times 10 s after `t_s`."""
        return t_s + steps * PLAYER_STEP_S

    def before(self, t_s: float) -> Keyframe:
        """The last keyframe at or before a time, else the first one, of a tape that has one."""
        k = bisect_right(self._keyframes, t_s, key=lambda keyframe: keyframe.t_s)
        return self._keyframes[max(k - 1, 0)]


class TapeHead:
    """The moment of the tape that one page reads."""

    def __init__(self, tape: OperationTape) -> None:
        self._tape = tape
        self._reader: Reader | None = None
        self._scene: TableScene | None = None

    def at(self, t_s: float) -> tuple[Operation, TableScene]:
        """The operation and the scene of a time: played on, or from the last keyframe before it; it may take a second.

        The scene is the same while the time is the same.
        """
        reader, keyframe = self._reader, self._tape.before(t_s)
        if reader is None or t_s < reader.t_s or keyframe.t_s > reader.t_s:
            own = replace(keyframe, operation=keyframe.operation.copy())
            reader, self._scene = Reader(self._tape.path, own), None
            self._reader = reader
        if self._scene is None or t_s > reader.t_s:
            reader.advance(t_s)
            self._scene = reader.scene()
        return reader.operation, self._scene
