"""Bytes of the ports: `Chunk`, `Portion`, and the serial ports of a live run.

In: URLs of ports (pyserial, or udp://), or chunks from a recording or a simulation. Out: `Chunk`s in order of arrival, or many of them as the
columns of a `Portion`. Owns the open ports, their threads and the wall clock.
"""

from __future__ import annotations

import queue
import threading
import time
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise

import numpy as np
import serial

from echostep.arrays import Ints, Octets
from echostep.errors import EchostepError
from echostep.jit import kernel
from echostep.ports.udp import UdpPort

# Names of the ports.
BOARD = "board"
MTX = "mtx"
GATEWAY = "gateway"

# All by reason.
LATEST_NS = 1 << 62  # a later arrival time (damage in a recording) is replaced by this one
IDLE_S = 0.05  # longest wait for a chunk; short, so that the set-up of the MTx repeats its requests in time
READ_TIMEOUT_S = 0.1
WRITE_TIMEOUT_S = 0.5
REOPEN_S = 0.5  # between two attempts to open a lost port
JOIN_S = 2.0  # longest wait for the end of a reading thread
MOST_NOTICES = 8  # kept; the oldest is dropped


@dataclass(frozen=True, slots=True)
class Chunk:
    """Bytes of one read of a port; `t_arrival_ns` is on the host's monotonic clock, or on the simulated or recorded one."""

    port: str
    t_arrival_ns: int
    data: bytes


@dataclass(frozen=True, slots=True)
class PortBytes:
    """All bytes of one port in a portion, joined in `received`.

    Chunk k of the port is row `row[k]` of the portion and ends before byte `end[k]` of `received`.
    """

    received: bytes
    row: Ints
    end: Ints

    def rows_of(self, ends: Ints) -> Ints:
        """Row of the chunk with the last byte of each frame; `ends` (n,) are the frames' ends in `received`, ascending."""
        return self.row[np.searchsorted(self.end, ends)]


_NO_BYTES = PortBytes(b"", np.empty(0, np.int64), np.empty(0, np.int64))


@dataclass(frozen=True, slots=True)
class Portion:
    """Chunks in order of arrival, as columns (n,).

    Chunk k came from `ports[port[k]]` at `t_arrival_ns[k]`; its bytes are `received[start[k] : end[k]]`. The names in `ports` are unique.
    """

    ports: tuple[str, ...]
    port: Ints
    t_arrival_ns: Ints
    start: Ints
    end: Ints
    received: bytes

    def chunks(self) -> Iterator[Chunk]:
        """The chunks one by one."""
        columns = (self.port.tolist(), self.t_arrival_ns.tolist(), self.start.tolist(), self.end.tolist())
        for port, t_arrival_ns, start, end in zip(*columns, strict=True):
            yield Chunk(self.ports[port], t_arrival_ns, self.received[start:end])

    def rows(self, begin: int, end: int) -> Portion:
        """The chunks from row `begin` up to row `end`."""
        kept = slice(begin, end)
        return Portion(
            self.ports, self.port[kept], self.t_arrival_ns[kept], self.start[kept], self.end[kept], self.received
        )

    def cut_after(self, name: str) -> Iterator[Portion]:
        """The portion in pieces; each chunk of the named port is the last one of its piece."""
        cuts = self._rows_from(name) + 1
        for begin, end in pairwise(dict.fromkeys([0, *cuts.tolist(), len(self.port)])):
            yield self.rows(begin, end)

    def of(self, name: str) -> PortBytes:
        """All bytes of the named port."""
        if name not in self.ports:
            return _NO_BYTES
        row = self._rows_from(name)
        start, end = self.start[row], self.end[row]
        total = (end - start).cumsum()
        joined = np.empty(int(total[-1]) if len(total) else 0, np.uint8)
        _copy_ranges(np.frombuffer(self.received, np.uint8), start, end, joined)
        return PortBytes(joined.tobytes(), row, total)

    def _rows_from(self, name: str) -> Ints:
        """Rows of the named port's chunks; empty when the portion has no such port."""
        return (self.port == self.ports.index(name)).nonzero()[0] if name in self.ports else np.empty(0, np.int64)


def portion_of(chunks: Sequence[Chunk]) -> Portion:
    """Chunks as the columns of a portion; arrival times are limited to 0 ... `LATEST_NS`."""
    port_index = {port: k for k, port in enumerate(dict.fromkeys(chunk.port for chunk in chunks))}
    edges = [0, *accumulate(len(chunk.data) for chunk in chunks)]
    return Portion(
        tuple(port_index),
        np.array([port_index[chunk.port] for chunk in chunks], np.int64),
        np.array([min(max(chunk.t_arrival_ns, 0), LATEST_NS) for chunk in chunks], np.int64),
        np.array(edges[:-1], np.int64),
        np.array(edges[1:], np.int64),
        b"".join(chunk.data for chunk in chunks),
    )


@kernel
def _copy_ranges(received: Octets, start: Ints, end: Ints, joined: Octets) -> None:
    """Copy received[start[k] : end[k]] for each k into `joined`, one after the other."""
    joined_index = 0
    for k in range(len(start)):
        for byte_index in range(start[k], end[k]):
            joined[joined_index] = received[byte_index]
            joined_index += 1


class SerialPorts:
    """Ports (pyserial URLs, udp://HOST:PORT), each read by its own thread. A port that is lost is opened again.

    Raises EchostepError when a port cannot be opened at the start. `notices` holds messages about lost and reopened ports.
    """

    def __init__(self, urls: Mapping[str, str], baud: Mapping[str, int]) -> None:
        """`urls` and `baud` by port name; only the ports named are opened."""
        self._queue: queue.Queue[Chunk] = queue.Queue()
        self._stop = threading.Event()
        self._ports = {name: _open(url, baud[name]) for name, url in urls.items()}
        self.notices: deque[str] = deque(maxlen=MOST_NOTICES)
        self._threads = [
            threading.Thread(target=self._read, args=(name, url, baud[name]), daemon=True) for name, url in urls.items()
        ]
        for thread in self._threads:
            thread.start()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the open ports."""
        return tuple(self._ports)

    def chunks(self) -> Iterator[Chunk | None]:
        """Chunks in order of arrival until `close`; None after `IDLE_S` without a chunk."""
        while not self._stop.is_set():
            try:
                yield self._queue.get(timeout=IDLE_S)
            except queue.Empty:
                yield None

    def send(self, port: str, sent: bytes) -> None:
        """Write to a port, for at most `WRITE_TIMEOUT_S`; a failure becomes a notice."""
        try:
            self._ports[port].write(sent)
        except (serial.SerialException, OSError) as error:
            self.notices.append(f"{port}: cannot write: {error}")

    def close(self) -> None:
        """Stop the threads and close the ports."""
        self._stop.set()
        for thread in self._threads:
            thread.join(timeout=JOIN_S)
        for port in self._ports.values():
            port.close()

    def _read(self, name: str, url: str, baud: int) -> None:
        """The thread of one port: put its chunks into the queue until `close`."""
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
        """Close a lost port and try to open it until that succeeds or `close` is called."""
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


def _open(url: str, baud: int) -> serial.SerialBase | UdpPort:
    try:
        if url.startswith("udp://"):
            return UdpPort(url)
        return serial.serial_for_url(url, baudrate=baud, timeout=READ_TIMEOUT_S, write_timeout=WRITE_TIMEOUT_S)
    except (serial.SerialException, OSError, ValueError) as error:
        raise EchostepError(
            f"{url}: cannot open the port: {error}; see which ports there are: ls /dev/serial/by-id"
        ) from error
