"""Where bytes come from: the only place where live and replay differ.

In: serial ports (pyserial URLs), a recording, or a simulation. Out: `Chunk`s in order of arrival, or many of them as a `Portion`. Owns the
ports and the wall clock.
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

IDLE_S = 0.05  # no longer, so that the MTx is asked again in time
READ_TIMEOUT_S = 0.1
WRITE_TIMEOUT_S = 0.5
REOPEN_S = 0.5
BOARD = "board"
MTX = "mtx"
GATEWAY = "gateway"
LATEST_NS = 1 << 62  # later arrivals (damage in a recording) count as this one


@dataclass(frozen=True, slots=True)
class Chunk:
    """Bytes as one port delivered them; `t_arrival_ns` is the host's monotonic clock, or the simulated or recorded one."""

    port: str
    t_arrival_ns: int
    data: bytes


@dataclass(frozen=True, slots=True)
class PortBytes:
    """What one port delivered in a portion: `received`, and of its chunk k the row `row[k]` in the portion and the end `end[k]` in `received`."""

    received: bytes
    row: Ints
    end: Ints

    def rows_of(self, ends: Ints) -> Ints:
        """Rows of the chunks that brought the last byte before each of these ends (ascending) in `received`."""
        return self.row[np.searchsorted(self.end, ends)]


_NOTHING = PortBytes(b"", np.empty(0, np.int64), np.empty(0, np.int64))


@dataclass(frozen=True, slots=True)
class Portion:
    """Chunks in order of arrival, as columns (n,): chunk k came from `ports[port[k]]` at `t_arrival_ns[k]` and is `received[start[k] : end[k]]`.

    No name is twice in `ports`.
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
        """The portion cut behind each chunk of the port of that name."""
        at = (self.port == self.ports.index(name)).nonzero()[0] + 1 if name in self.ports else np.empty(0, np.int64)
        for begin, end in pairwise(dict.fromkeys([0, *at.tolist(), len(self.port)])):
            yield self.rows(begin, end)

    def of(self, name: str) -> PortBytes:
        """What the port of that name delivered."""
        if name not in self.ports:
            return _NOTHING
        row = (self.port == self.ports.index(name)).nonzero()[0]
        start, end = self.start[row], self.end[row]
        total = (end - start).cumsum()
        joined = np.empty(int(total[-1]) if len(total) else 0, np.uint8)
        _join(np.frombuffer(self.received, np.uint8), start, end, joined)
        return PortBytes(joined.tobytes(), row, total)


def portion_of(chunks: Sequence[Chunk]) -> Portion:
    """Chunks as a portion."""
    place = {port: k for k, port in enumerate(dict.fromkeys(chunk.port for chunk in chunks))}
    edges = [0, *accumulate(len(chunk.data) for chunk in chunks)]
    return Portion(
        tuple(place),
        np.array([place[chunk.port] for chunk in chunks], np.int64),
        np.array([min(max(chunk.t_arrival_ns, 0), LATEST_NS) for chunk in chunks], np.int64),
        np.array(edges[:-1], np.int64),
        np.array(edges[1:], np.int64),
        b"".join(chunk.data for chunk in chunks),
    )


@kernel
def _join(received: Octets, start: Ints, end: Ints, joined: Octets) -> None:
    """Copy received[start[k] : end[k]] for each k, one after the other."""
    at = 0
    for k in range(len(start)):
        for i in range(start[k], end[k]):
            joined[at] = received[i]
            at += 1


class SerialPorts:
    """Serial ports (pyserial URLs) read by a thread each; a port that goes away is opened again.

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

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the ports that are read."""
        return tuple(self._ports)

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


def _open(url: str, baud: int) -> serial.SerialBase | UdpPort:
    try:
        if url.startswith("udp://"):
            return UdpPort(url)
        return serial.serial_for_url(url, baudrate=baud, timeout=READ_TIMEOUT_S, write_timeout=WRITE_TIMEOUT_S)
    except (serial.SerialException, OSError, ValueError) as error:
        raise EchostepError(
            f"{url}: cannot open the port: {error}; see which ports there are: ls /dev/serial/by-id"
        ) from error
