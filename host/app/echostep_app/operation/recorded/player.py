# SPDX-License-Identifier: MIT
"""Plays an operation's file: the recorded messages go through the code that shows them live.

In: a tape, an operation in the state of a keyframe. Out: the same operation at later times. Owns the position in the file.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace

from echostep.errors import EchostepError
from echostep.ports.chunks import Portion
from echostep.recording import Recording
from echostep_app.operation.operation import Operation, TableScene
from echostep_app.operation.recorded.record import OPERATION, Condition, Heard, decode_record
from echostep_app.operation.recorded.tape import Keyframe, Tape
from echostep_app.team.inbox import ReceivedMessage

# Assumed, both of them.
STEP_S = 0.25  # of an operation that is played: a state changes at most so much later than it did
MOST_STEPS = 1000  # for one gap without messages, so that a damaged time does not keep the player busy


class Player:
    """Plays a file on from a keyframe: `advance` brings `operation` to a later time."""

    def __init__(self, tape: Tape, keyframe: Keyframe, operation: Operation) -> None:
        self.operation = operation
        self.t_s, self.unix_s, self.connected = keyframe.t_s, keyframe.unix_s, keyframe.connected
        self.offset = keyframe.offset  # behind the messages that are read; -1: inside a compressed part of the file
        self.unknown = 0  # chunks that are no record
        self.file = Recording(tape.path, grows=tape.grows)
        self._portions: Iterator[Portion] = iter(()) if tape.grows else self.file.portions_from(self.offset)
        self._waiting: deque[tuple[float, Heard | Condition]] = deque()

    def advance(self, to_s: float) -> None:
        """Bring the operation to `to_s`."""
        while self.t_s < to_s:
            self.step(to_s)

    def step(self, to_s: float = math.inf) -> int | None:
        """Take the messages of the next `STEP_S` at most, not beyond `to_s`; returns how many; None at the end of the file."""
        following = self.following()
        if following is None and math.isinf(to_s):
            return None
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
        return len(messages)

    @property
    def resumes(self) -> bool:
        """Whether another player can go on from `offset`: all records before it have been taken."""
        return not self._waiting and self.offset >= 0

    def following(self) -> tuple[float, Heard | Condition] | None:
        """The next record and its time; None where the file has none by now."""
        while not self._waiting and (portion := self._portion()) is not None:
            self.offset, newest_s = self.file.resume, self.t_s
            for chunk in portion.chunks():
                record = decode_record(chunk.data) if chunk.port == OPERATION else None
                newest_s = max(newest_s, 1e-9 * chunk.t_arrival_ns)
                if record is None:
                    self.unknown += 1
                else:
                    self._waiting.append((newest_s, record))
        return self._waiting[0] if self._waiting else None

    def scene(self) -> TableScene:
        """The present moment of the player."""
        return self.operation.scene(self.t_s, self.unix_s, connected=self.connected)

    def keyframe(self) -> Keyframe:
        """The present state; what comes later does not change it."""
        return Keyframe(self.t_s, self.unix_s, self.offset, self.connected, self.operation.copy())

    def _portion(self) -> Portion | None:
        """The next portion, of a growing file also of what has come since the last one was read; None at the end."""
        portion = next(self._portions, None)
        if portion is None and self.file.grows:
            self._portions = self.file.portions_from(max(self.offset, 0))
            with suppress(EchostepError):  # nothing of it is on the disk yet
                portion = next(self._portions, None)
        return portion


def load(tape: Tape, operation: Operation) -> Iterator[Player]:
    """Read a whole file and keep its keyframes; gives the player, whose operation goes on, after each step."""
    player = Player(tape, Keyframe(0.0, 0.0, 0, connected=True, operation=operation), operation)
    if (first := player.following()) is None:
        return
    player.t_s, player.unix_s = first[0], first[1].unix_s
    tape.note(player.t_s, 0, lambda: replace(player.keyframe(), offset=0))
    while (count := player.step()) is not None:
        tape.note(player.t_s, count, player.keyframe if player.resumes else None)
        yield player
