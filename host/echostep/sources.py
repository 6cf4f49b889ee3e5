"""Where bytes come from: the only place where live and replay differ.

In: serial ports (pyserial URLs), a recording, or a simulation. Out: `Chunk`s in order of arrival. Owns the ports and the wall clock.
"""

from __future__ import annotations

import queue
import threading
import time
from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import serial

from echostep.errors import EchostepError

IDLE_S = 0.05  # no longer, so that the MTx is asked again in time
READ_TIMEOUT_S = 0.1
WRITE_TIMEOUT_S = 0.5
REOPEN_S = 0.5
BOARD = "board"
MTX = "mtx"


@dataclass(frozen=True, slots=True)
class Chunk:
    """Bytes as one port delivered them; `t_arrival_ns` is the host's monotonic clock, or the simulated or recorded one."""

    port: str
    t_arrival_ns: int
    data: bytes


class SerialPorts:
    """Two serial ports (pyserial URLs) read by a thread each; a port that goes away is opened again.

    Raises EchostepError when a port cannot be opened at the start. `notices` says in words what happened to the ports.
    """

    def __init__(self, urls: Mapping[str, str], baud: Mapping[str, int]) -> None:
        """`urls` and `baud` by port name; only the ports named are opened."""
        self._queue: queue.Queue[Chunk] = queue.Queue()
        self._stop = threading.Event()
        self._ports = {name: _open(url, baud[name]) for name, url in urls.items()}
        self.notices: deque[str] = deque(maxlen=8)
        self._threads = [
            threading.Thread(target=self._read, args=(name, url, baud[name]), daemon=True) for name, url in urls.items()
        ]
        for thread in self._threads:
            thread.start()

    def chunks(self) -> Iterator[Chunk | None]:
        """Chunks in order of arrival until `close`; None when nothing came for `IDLE_S`."""
        while not self._stop.is_set():
            try:
                yield self._queue.get(timeout=IDLE_S)
            except queue.Empty:
                yield None

    def send(self, port: str, sent: bytes) -> None:
        """Write to a port; a port that is away or full is reported, never waited for longer than its timeout."""
        try:
            self._ports[port].write(sent)
        except (serial.SerialException, OSError) as error:
            self.notices.append(f"{port}: cannot write: {error}")

    def close(self) -> None:
        """Stop reading and give the ports back."""
        self._stop.set()
        for thread in self._threads:
            thread.join(timeout=2.0)
        for port in self._ports.values():
            port.close()

    def _read(self, name: str, url: str, baud: int) -> None:
        while not self._stop.is_set():
            port = self._ports[name]
            try:
                received = port.read(max(1, port.in_waiting))
            except (serial.SerialException, OSError, TypeError) as error:  # TypeError: closed under a blocking read
                self._reopen(name, url, baud, error)
                continue
            if received:
                self._queue.put(Chunk(name, time.monotonic_ns(), received))

    def _reopen(self, name: str, url: str, baud: int, error: Exception) -> None:
        if self._stop.is_set():
            return
        self.notices.append(f"{name}: {url} went away ({error}); trying again")
        self._ports[name].close()
        while not self._stop.wait(REOPEN_S):
            try:
                self._ports[name] = _open(url, baud)
            except EchostepError:
                continue
            self.notices.append(f"{name}: {url} is back")
            return


def _open(url: str, baud: int) -> serial.SerialBase:
    try:
        return serial.serial_for_url(url, baudrate=baud, timeout=READ_TIMEOUT_S, write_timeout=WRITE_TIMEOUT_S)
    except (serial.SerialException, OSError, ValueError) as error:
        raise EchostepError(
            f"{url}: cannot open the port: {error}; see which ports there are: ls /dev/serial/by-id"
        ) from error
