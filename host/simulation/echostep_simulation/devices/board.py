# SPDX-License-Identifier: MIT
"""The sensor board of the simulation: the Python board, or a child process that speaks the bench protocol (docs/design/bench.md).

In: rows of one millisecond, bytes from the host, fault switches. Out: (t_ns, bytes) as they leave the board's USB port. Owns the board's state.
"""

from __future__ import annotations

import contextlib
import math
import os
import select
import struct
import subprocess
import time
from collections.abc import Iterator, Sequence
from operator import itemgetter
from typing import IO, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from echostep.board import messages as m
from echostep.board.frames import BoardReader, encode
from echostep.errors import EchostepError
from echostep_simulation.devices.srf02 import TICKS_US, Rangers
from echostep_simulation.stimulus import EXTENDED_ROW, NO_SYNC, ROW

Sent = list[tuple[int, bytes]]
TIMEOUT_S = 60.0
ALL_SENSORS = 0xFF
GYROS = ("thigh", "calf", "belt")
SELF_TEST_US = 560_000  # after the start the gyros test themselves and give no rates
GYRO_COUNTS_PER_DEGREE, GYRO_RESPONSE = 6.88, 221  # [ADIS16100 data sheet]
PRESSURE_US = {m.PressureMode.HIGH_SPEED: 1e6 / 9.0, m.PressureMode.HIGH_RESOLUTION: 1e6 / 1.8}  # [SCP1000 data sheet]


class Board(Protocol):
    """Interface of a simulated board."""

    def advance(self, rows: NDArray[Any]) -> Sent:
        """Let n milliseconds pass; bytes that left the board in that time."""

    def send(self, sent: bytes) -> None:
        """Bytes from the host."""

    def fault(self, text: str) -> None:
        """A fault switch, `name=value`; raises EchostepError when no switch has that name."""

    def close(self) -> None:
        """Close the board."""


class PythonBoard:
    """Sends the messages of the firmware without running it: no buses, no faults, no lost frames."""

    def __init__(self, seed: int = 0) -> None:
        self._rangers = Rangers(np.random.default_rng([seed, 2]))
        self._ms = 0
        self._sequence = 0
        self._edge = 0
        self._inbox = BoardReader()
        self._answers: list[m.Message] = []
        self._configuration = m.Configuration(0, ALL_SENSORS, m.Schedule.CONCURRENT, 200, 10, m.PressureMode.HIGH_SPEED)
        self._began_us = 0  # when the sensors were started

    def advance(self, rows: NDArray[Any]) -> Sent:
        """Let n milliseconds pass."""
        start_us = 1000 * self._ms
        messages: list[tuple[int, m.Message]] = [(start_us, answer) for answer in self._answers]
        self._answers = []
        messages += self._reports(rows) + self._edges(rows) + self._samples(rows)
        messages += self._rangers.advance(start_us, rows, self._configuration.sensors)
        messages.sort(key=itemgetter(0))
        self._ms += len(rows)
        return [self._sent(us, message) for us, message in messages]

    def may_range(self, count: int) -> NDArray[np.bool_]:
        """Which of the next `count` milliseconds may need echoes; orders in between may change them."""
        return self._rangers.may_fire(1000 * self._ms, count)

    def send(self, sent: bytes) -> None:
        """Answer identify, clock_query and configure, with the next millisecond."""
        for message in self._inbox.feed(sent):
            if isinstance(message, m.Identify):
                self._answers += self._introduction(1000 * self._ms)
            elif isinstance(message, m.ClockQuery):
                self._answers.append(m.ClockReply(_ticks(1000 * self._ms), message.token))
            elif isinstance(message, m.Configure):
                self._configure(message)

    def fault(self, text: str) -> None:
        """Ignored: the Python board has no faults."""
        raise EchostepError(f"{text}: the Python board has no fault switches; build the twin (make demo)")

    def close(self) -> None:
        """Nothing to release."""

    def _configure(self, wanted: m.Configure) -> None:
        """Take the settings, clamped as the firmware does (firmware/configuration.c), and restart the sensors."""
        self._began_us = 1000 * self._ms
        schedule = m.Schedule(min(wanted.schedule, m.Schedule.SIMULTANEOUS))
        mode = m.PressureMode(min(wanted.pressure_mode, m.PressureMode.HIGH_RESOLUTION))
        gyro_hz, compass_hz = min(max(wanted.gyro_rate_hz, 10), 200), min(max(wanted.compass_rate_hz, 1), 20)
        ticks = _ticks(self._began_us)
        self._configuration = m.Configuration(ticks, wanted.sensors, schedule, gyro_hz, compass_hz, mode)
        self._rangers.start(self._began_us, schedule)
        self._answers.append(self._configuration)

    def _sent(self, us: int, message: m.Message) -> tuple[int, bytes]:
        """The frame, and when it leaves: at the start of the next USB frame."""
        self._sequence += 1
        return (us // 1000 + 1) * 1_000_000, encode(message, self._sequence - 1)

    def _introduction(self, us: int) -> list[m.Message]:
        identity = m.Identity(_ticks(us), m.SCHEMA_HASH, 0, 0, 0, m.ResetCause.POWER_ON)
        return [identity, self._configuration._replace(ticks=_ticks(us))]

    def _reports(self, rows: NDArray[Any]) -> list[tuple[int, m.Message]]:
        """Identification at the start; identification and state once a second."""
        messages: list[tuple[int, m.Message]] = []
        for ms in range(self._ms, self._ms + len(rows)):
            if ms == 0:
                messages += [(0, message) for message in self._introduction(0)]
            elif ms % 1000 == 0:
                us = 1000 * ms
                messages += [(us, self._introduction(us)[0]), (us, self._status(us))]
                messages += self._gyro_health(us, rows[ms - self._ms])
        return messages

    def _status(self, us: int) -> m.Status:
        bad = self._inbox.counts.rejected & 0xFFFF
        none = dict.fromkeys(m.Status._fields, 0)
        return m.Status(**none | {"ticks": _ticks(us), "bad_frames": bad, "healthy": 0x7F})

    def _gyro_health(self, us: int, row: Any) -> list[tuple[int, m.Message]]:
        """Gyros that passed their self-test, as warm as the barometer."""
        counts = round((int(row["temperature"]) / 20.0 - 25.0) * GYRO_COUNTS_PER_DEGREE)
        return [
            (us, m.GyroHealth(_ticks(us), gyro, counts, m.SelfTest.PASSED, -GYRO_RESPONSE, GYRO_RESPONSE))
            for gyro, sensor in zip(m.Gyro, (m.Sensors.THIGH, m.Sensors.CALF, m.Sensors.BELT), strict=True)
            if self._configuration.sensors & sensor
        ]

    def _edges(self, rows: NDArray[Any]) -> list[tuple[int, m.Message]]:
        messages: list[tuple[int, m.Message]] = []
        if self._configuration.sensors & m.Sensors.SYNC:
            for k in np.flatnonzero(rows["sync_us"] != NO_SYNC).tolist():
                us = 1000 * (self._ms + k) + int(rows["sync_us"][k])
                messages.append((us, m.Sync(_ticks(us), self._edge & 0xFFFF)))
                self._edge += 1
        return messages

    def _samples(self, rows: NDArray[Any]) -> list[tuple[int, m.Message]]:
        """Gyros, compass and barometer, each at its own rate."""
        c = self._configuration
        on = [bool(c.sensors & one) for one in (m.Sensors.THIGH, m.Sensors.CALF, m.Sensors.BELT)]
        messages: list[tuple[int, m.Message]] = []
        for us, row in self._due(rows, 1e6 / c.gyro_rate_hz) if any(on) else ():
            rates = [
                int(row[name]) if there and us >= SELF_TEST_US else m.GYROS_INVALID
                for name, there in zip(GYROS, on, strict=True)
            ]
            messages.append((us, m.Gyros(_ticks(us), *rates)))
        for us, row in self._due(rows, 1e6 / c.compass_rate_hz) if c.sensors & m.Sensors.COMPASS else ():
            messages.append((us, m.Compass(_ticks(us), int(row["bearing"]))))
        for us, row in (
            self._due(rows, PRESSURE_US[m.PressureMode(c.pressure_mode)]) if c.sensors & m.Sensors.PRESSURE else ()
        ):
            messages.append((us, m.Pressure(_ticks(us), int(row["pressure"]), int(row["temperature"]))))
        return messages

    def _due(self, rows: NDArray[Any], period_us: float) -> Iterator[tuple[int, Any]]:
        """Times on a grid from the start of the sensors that fall into these rows, and the row of each."""
        start_us = 1000 * self._ms
        k = math.ceil((start_us - self._began_us) / period_us)
        while (us := self._began_us + round(k * period_us)) < start_us + 1000 * len(rows):
            if us >= start_us:
                yield us, rows[(us - start_us) // 1000]
            k += 1


def _ticks(us: int) -> int:
    return (TICKS_US * us) & 0xFFFFFFFF


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

    @property
    def pid(self) -> int:
        """Number of the process."""
        return self._child.pid

    def advance(self, rows: NDArray[Any]) -> Sent:
        """Let n milliseconds pass; `rows` (n,) are plain or extended ones."""
        extended = rows.dtype == EXTENDED_ROW
        self._write(b"E" if extended else b"R", np.ascontiguousarray(rows, EXTENDED_ROW if extended else ROW).tobytes())
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
        """Request the child's end; kill it after the timeout."""
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
