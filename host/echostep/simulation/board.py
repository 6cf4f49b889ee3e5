"""The sensor board of the simulation: the Python board, or a child process that speaks the bench protocol (host/DESIGN.md).

In: rows of one millisecond, bytes from the host, fault switches. Out: (t_ns, bytes) as they leave the board's USB port. Owns the board's state.
"""

from __future__ import annotations

import contextlib
import os
import select
import struct
import subprocess
import time
from collections import deque
from collections.abc import Sequence
from typing import IO, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from echostep import messages as m
from echostep.errors import EchostepError
from echostep.frames import BoardReader, encode
from echostep.simulation.stimulus import NO_SYNC, ROW

Sent = list[tuple[int, bytes]]
TIMEOUT_S = 60.0
MINIMUM_US, WINDOW_US = 875, 35_000  # 15 cm and 600 cm, out and back
RANGING_MS = 61
PERIOD_MS, JITTER_MS = 65.0, 3.0
SEQUENTIAL_MS = 70
ALL_SENSORS = 0xFF


class Board(Protocol):
    """What the simulation asks of a board."""

    def advance(self, rows: NDArray[Any]) -> Sent:
        """Let n milliseconds pass; bytes that left the board meanwhile."""

    def send(self, sent: bytes) -> None:
        """Bytes from the host."""

    def fault(self, text: str) -> None:
        """A fault switch, `name=value`; raises EchostepError when there is none of that name."""

    def close(self) -> None:
        """The end."""


class PythonBoard:
    """Sends what the firmware would send, without being it: no buses, no faults, no lost frames."""

    def __init__(self, seed: int = 0) -> None:
        self._rng = np.random.default_rng([seed, 2])
        self._ms = 0
        self._sequence = 0
        self._edge = 0
        self._inbox = BoardReader()
        self._configuration = m.Configuration(0, ALL_SENSORS, m.Schedule.CONCURRENT, 200, 10, m.PressureMode.HIGH_SPEED)
        self._due_ms = [20.0, 20.0 + 0.5 * PERIOD_MS]
        self._grid_ms = list(self._due_ms)
        self._triggers: list[deque[tuple[int, int, int]]] = [
            deque(maxlen=4),
            deque(maxlen=4),
        ]  # ms, own us, cross us at the other
        self._pending: list[int | None] = [None, None]
        self._out: Sent = []
        self._answers: Sent = []

    def advance(self, rows: NDArray[Any]) -> Sent:
        """Let n milliseconds pass."""
        self._out = []
        for row in rows:
            self._tick(row)
            self._ms += 1
        return self._out

    def send(self, sent: bytes) -> None:
        """Answer identify, clock_query and configure."""
        self._out = []
        for message in self._inbox.feed(sent):
            if isinstance(message, m.Identify):
                self._introduce()
            elif isinstance(message, m.ClockQuery):
                self._emit(m.ClockReply(self._ticks(), message.token))
            elif isinstance(message, m.Configure):
                rate = min(max(message.gyro_rate_hz, 10), 200)
                compass = min(max(message.compass_rate_hz, 1), 20)
                self._configuration = m.Configuration(
                    0, message.sensors, message.schedule, rate, compass, message.pressure_mode
                )
                self._emit(self._configuration._replace(ticks=self._ticks()))
        self._answers = self._out

    def fault(self, text: str) -> None:
        """The Python board knows no faults."""
        raise EchostepError(f"{text}: the Python board has no fault switches; build the twin (make demo)")

    def close(self) -> None:
        """Nothing to give back."""

    def _ticks(self, us: int = 0) -> int:
        return (self._ms * 2000 + 2 * us) & 0xFFFFFFFF

    def _emit(self, message: m.Message) -> None:
        self._out.append(((self._ms + 1) * 1_000_000, encode(message, self._sequence)))
        self._sequence += 1

    def _introduce(self) -> None:
        self._emit(m.Identity(self._ticks(), m.SCHEMA_HASH, 0, 0, 0, m.ResetCause.POWER_ON))
        self._emit(self._configuration._replace(ticks=self._ticks()))

    def _tick(self, row: Any) -> None:
        on, c = self._configuration.sensors, self._configuration
        if self._answers:
            self._out += self._answers
            self._answers = []
        if self._ms == 0:
            self._introduce()
        elif self._ms % 1000 == 0:
            self._report()
        if on & m.Sensors.SYNC and row["sync_us"] != NO_SYNC:
            self._emit(m.Sync(self._ticks(int(row["sync_us"])), self._edge & 0xFFFF))
            self._edge += 1
        if self._ms % max(1, 1000 // c.gyro_rate_hz) == 0 and on & (m.Sensors.THIGH | m.Sensors.CALF | m.Sensors.BELT):
            self._emit(m.Gyros(self._ticks(), int(row["thigh"]), int(row["calf"]), int(row["belt"])))
        if on & m.Sensors.COMPASS and self._ms % (1000 // c.compass_rate_hz) == 0:
            self._emit(m.Compass(self._ticks(), int(row["bearing"])))
        slow = c.pressure_mode == m.PressureMode.HIGH_RESOLUTION
        if on & m.Sensors.PRESSURE and self._ms % (556 if slow else 111) == 110:
            self._emit(m.Pressure(self._ticks(), int(row["pressure"]), int(row["temperature"])))
        for ranger in range(2):
            if on & (1 << ranger):
                self._range(ranger, row)

    def _report(self) -> None:
        self._emit(m.Identity(self._ticks(), m.SCHEMA_HASH, 0, 0, 0, m.ResetCause.POWER_ON))
        self._emit(m.Status(self._ticks(), 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, healthy=0x7F, memory_used=0))

    def _range(self, ranger: int, row: Any) -> None:
        began = self._pending[ranger]
        if began is not None and self._ms - began >= RANGING_MS:
            self._pending[ranger] = None
            self._answer(ranger, began)
        if self._pending[ranger] is None and self._ms >= self._due_ms[ranger]:
            self._pending[ranger] = self._ms
            self._triggers[ranger].append((self._ms, int(row["own_us"][ranger]), int(row["cross_us"][1 - ranger])))
            self._schedule(ranger)

    def _schedule(self, ranger: int) -> None:
        """Concurrent: a locked grid, half a period apart, with jitter. Sequential: the other one, 70 ms later [Girard 2011, 2.6.5]."""
        if self._configuration.schedule == m.Schedule.SEQUENTIAL:
            self._due_ms[1 - ranger] = self._ms + SEQUENTIAL_MS
            self._due_ms[ranger] = self._ms + 2 * SEQUENTIAL_MS
            return
        self._grid_ms[ranger] = max(self._grid_ms[ranger] + PERIOD_MS, self._ms + RANGING_MS + 1.0)
        self._due_ms[ranger] = self._grid_ms[ranger] + JITTER_MS * float(self._rng.random())

    def _answer(self, ranger: int, began_ms: int) -> None:
        """The earliest audible arrival: the own echo, or the other ranger's."""
        own = next(us for ms, us, _ in self._triggers[ranger] if ms == began_ms)
        arrivals = [own] if own else []
        arrivals += [(ms - began_ms) * 1000 + cross for ms, _, cross in self._triggers[1 - ranger] if cross]
        heard = [us for us in arrivals if MINIMUM_US <= us <= WINDOW_US]
        ticks = (began_ms * 2000) & 0xFFFFFFFF
        outcome = m.Outcome.ECHO if heard else m.Outcome.NO_ECHO
        self._emit(m.Ping(ticks, ranger, outcome, min(heard, default=0)))


class BoardProcess:
    """A board in a child process; raises EchostepError when it cannot start, dies, or does not answer in time."""

    def __init__(self, command: Sequence[str]) -> None:
        self._name = command[0] if command else "(no command)"
        try:
            self._child = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        except (OSError, IndexError) as error:
            raise EchostepError(f"{self._name}: cannot start the board: {error}") from error
        assert self._child.stdin is not None
        assert self._child.stdout is not None
        self._in: IO[bytes] = self._child.stdin
        self._out_fd = self._child.stdout.fileno()
        self._rest = b""
        self.trace: list[tuple[int, str]] = []  # truth about the buses, for tests and measurements

    def advance(self, rows: NDArray[Any]) -> Sent:
        """Let n milliseconds pass."""
        self._write(b"R", np.ascontiguousarray(rows, ROW).tobytes())
        sent: Sent = []
        while True:
            kind, body = self._read()
            t_ns = struct.unpack_from("<Q", body)[0]
            if kind == b"A":
                return sent
            if kind == b"B":
                sent.append((t_ns, body[8:]))
            elif kind == b"T":
                self.trace.append((t_ns, body[8:].decode(errors="replace")))

    def send(self, sent: bytes) -> None:
        """Bytes from the host."""
        self._write(b"H", sent)

    def fault(self, text: str) -> None:
        """A fault switch of the twin (tools/twin/README.md)."""
        self._write(b"F", text.encode())

    def close(self) -> None:
        """Ask the child to end; make it, if it does not."""
        with contextlib.suppress(EchostepError):
            self._write(b"Q", b"")
        with contextlib.suppress(OSError):
            self._in.close()
        try:
            self._child.wait(timeout=5.0)
        except subprocess.TimeoutExpired:
            self._child.kill()
            self._child.wait()
        assert self._child.stdout is not None
        self._child.stdout.close()

    def _write(self, kind: bytes, body: bytes) -> None:
        try:
            self._in.write(kind + len(body).to_bytes(4, "little") + body)
            self._in.flush()
        except (OSError, ValueError) as error:
            raise self._death() from error

    def _read(self) -> tuple[bytes, bytes]:
        head = self._take(5)
        length = int.from_bytes(head[1:], "little")
        if length < 8 or length > 1 << 20:
            raise EchostepError(f"{self._name}: does not speak the bench protocol")
        return head[:1], self._take(length)

    def _take(self, length: int) -> bytes:
        deadline = time.monotonic() + TIMEOUT_S
        while len(self._rest) < length:
            ready, _, _ = select.select([self._out_fd], [], [], max(0.0, deadline - time.monotonic()))
            if not ready:
                raise EchostepError(f"{self._name}: the board did not answer for {TIMEOUT_S:.0f} s")
            received = os.read(self._out_fd, 1 << 16)
            if not received:
                raise self._death()
            self._rest += received
        taken, self._rest = self._rest[:length], self._rest[length:]
        return taken

    def _death(self) -> EchostepError:
        status = self._child.poll()
        return EchostepError(
            f"{self._name}: the board ended ({'still running' if status is None else f'status {status}'})"
        )
