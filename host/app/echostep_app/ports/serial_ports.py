# SPDX-License-Identifier: MIT
"""The serial ports of a live run.

In: URLs of ports (pyserial, udp://, or - for standard input, whose end ends the run). Out: `Chunk`s in order of arrival. Owns the open ports,
which are locked for this process, their threads.

A lost port is opened again, under its device's new name if the device has a USB serial number. Its first chunk is then empty.
The queue to the run is bounded for each port, so that one port never crowds out another.
"""

from __future__ import annotations

import errno
import os
import sys
import threading
import time
from collections import Counter, deque
from collections.abc import Iterator, Mapping
from contextlib import suppress
from itertools import combinations
from typing import TypeAlias

import serial
from serial import rfc2217

from echostep.errors import EchostepError
from echostep.ports.chunks import Chunk
from echostep_app.ports.access import (
    PORT_FAULTS,
    TAKERS,
    holders,
    is_url,
    port_of_number,
    refusal,
    taker_of,
    usb_number,
)
from echostep_app.ports.arrival_clock import now_ns
from echostep_app.ports.tcp import StandardInput, TcpPort
from echostep_app.ports.udp import UdpPort

MOST_BYTES = 1 << 24  # of one port that wait: minutes of the board's or the MTx's bytes
CHUNK_BYTES = 100  # approximate memory that a chunk takes besides its bytes


class ChunkQueue:
    """Call `put` from any thread, `get` from one. `dropped`: chunks by port that found no room."""

    def __init__(self) -> None:
        self.dropped: Counter[str] = Counter()
        self._chunks: deque[Chunk] = deque()
        self._bytes: Counter[str] = Counter()  # that wait, by port
        self._changed = threading.Condition()

    def put(self, chunk: Chunk) -> None:
        """Append a chunk; it is dropped and counted when too many bytes of its port wait."""
        size = len(chunk.data) + CHUNK_BYTES
        with self._changed:
            if self._bytes[chunk.port] + size > MOST_BYTES:
                self.dropped[chunk.port] += 1
                return
            self._bytes[chunk.port] += size
            self._chunks.append(chunk)
            self._changed.notify()

    def get(self, timeout_s: float) -> Chunk | None:
        """The oldest chunk; None after the timeout."""
        with self._changed:
            if not self._chunks and not self._changed.wait_for(lambda: bool(self._chunks), timeout_s):
                return None
            chunk = self._chunks.popleft()
            self._bytes[chunk.port] -= len(chunk.data) + CHUNK_BYTES
            return chunk


AnyPort: TypeAlias = "serial.SerialBase | UdpPort | TcpPort | StandardInput"

# All assumed.
IDLE_S = 0.05  # longest wait for a chunk; short, so that the set-up of the MTx repeats its requests in time
READ_TIMEOUT_S = 0.1
WRITE_TIMEOUT_S = 0.5
TOGETHER_S = 0.002  # pyserial's thread hands the bytes of one segment over in less
REOPEN_S = 0.5  # between two attempts to open a lost port
JOIN_S = 2.0  # longest wait for the end of a reading thread
SEE_PORTS = "see which ports there are: " + (
    "ls /dev/serial/by-id" if sys.platform == "linux" else "python -m serial.tools.list_ports"
)
STANDARD_INPUT = "-"
MOST_NOTICES = 8  # kept; the oldest is dropped


class SerialPorts:
    """Ports (pyserial URLs, udp://HOST:PORT[?key=FILE]), each read by its own thread. A port that is lost is opened again.

    Raises EchostepError when a port cannot be opened at the start, or is given twice. `notices` holds messages about lost and reopened ports.
    """

    def __init__(self, urls: Mapping[str, str], baud: Mapping[str, int]) -> None:
        """`urls` and `baud` by port name; only the ports named are opened."""
        self._queue = ChunkQueue()
        self._stop = threading.Event()
        self._told: Counter[str] = Counter()  # dropped chunks by port that a notice has reported
        self.urls = dict(urls)
        self.unused: list[Chunk] = []  # that come first: read by those who had to know what a port sends
        self._ports: dict[str, AnyPort] = {}
        self.lost: set[str] = set()  # names under which the ports that are away at present were opened
        # By the name of the device: the name under which its chunks come
        self._opened_as = {name: name for name in urls}
        check_different(urls)
        try:
            for name, url in urls.items():
                self._ports[name] = _open(url, baud[name])
        except EchostepError:
            for port in self._ports.values():
                _close(port)
            raise
        self._numbers = {name: usb_number(url) for name, url in urls.items()}
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
        """Chunks in order of arrival until `stop`, then those that have arrived; None after `IDLE_S` without a chunk."""
        yield from self.unused
        self.unused = []
        while not self._stop.is_set():
            yield self._queue.get(IDLE_S)
            for port in [port for port, count in self._queue.dropped.items() if count > self._told[port]]:
                if not self._told[port]:
                    self.notices.append(f"{port}: its bytes come faster than they are used; some are dropped")
                self._told[port] = self._queue.dropped[port]
        while (chunk := self._queue.get(0.0)) is not None:
            yield chunk

    def stop(self) -> None:
        """Receive no more."""
        if self._stop.is_set():
            return
        self._stop.set()
        for thread in self._threads:
            thread.join(timeout=JOIN_S)

    def send(self, port: str, sent: bytes) -> None:
        """Write to a port, for at most `WRITE_TIMEOUT_S`; a failure becomes a notice."""
        try:
            self._ports[self._opened_as[port]].write(sent)
        except PORT_FAULTS as error:
            self.notices.append(f"{port}: cannot write: {error}")

    def exchange(self, one: str, other: str) -> None:
        """The devices of two names have exchanged their ports: bytes to either go to the port of the other; chunks keep their names."""
        self._opened_as[one], self._opened_as[other] = self._opened_as[other], self._opened_as[one]
        self.urls[one], self.urls[other] = self.urls[other], self.urls[one]

    def close(self) -> None:
        """Stop, and close the ports."""
        self.stop()
        for port in self._ports.values():
            _close(port)

    def _read(self, name: str, url: str, baud: int) -> None:
        """The thread of one port: put its chunks into the queue until `close`."""
        while not self._stop.is_set():
            port = self._ports[name]
            try:
                received = _read_block(port)
            except EOFError:
                self._stop.set()
                return
            except (TypeError, *PORT_FAULTS) as error:  # TypeError: closed under a blocking read
                url = self._reopen(name, url, baud, error)
                continue
            if isinstance(port, UdpPort) and (news := port.news()):
                self.notices.append(f"{name}: {news}")
            if received:
                self._queue.put(Chunk(name, now_ns(), received))
        self._read_rest(name)

    def _read_rest(self, name: str) -> None:
        """Put the bytes that the operating system received before `stop` into the queue."""
        with suppress(TypeError, EOFError, *PORT_FAULTS):
            port = self._ports[name]
            if (waiting := port.in_waiting) and (received := port.read(waiting)):
                self._queue.put(Chunk(name, now_ns(), received))

    def _reopen(self, name: str, url: str, baud: int, error: Exception) -> str:
        """Close a lost port and try to open it until that succeeds or `close` is called; returns its URL, which may be another one."""
        if self._stop.is_set():
            return url
        is_usual = isinstance(error, serial.SerialException | TypeError)
        why = "" if is_usual else f" ({getattr(error, 'strerror', '') or error})"
        self.notices.append(f"{name}: {url} went away{why}: it is opened again as soon as it is back")
        _close(self._ports[name])
        self.lost.add(name)
        while not self._stop.wait(REOPEN_S):
            place = self._place_of(name, url)
            try:
                if place is None:
                    continue
                self._ports[name] = _open(place, baud)
            except EchostepError:
                continue
            self.notices.append(f"{name}: {url} is back" + (f" as {place}" if place != url else ""))
            device = next(device for device, opened in self._opened_as.items() if opened == name)
            self.urls[device] = place
            self._queue.put(Chunk(name, now_ns(), b""))
            self.lost.discard(name)
            return place
        return url

    def _place_of(self, name: str, url: str) -> str | None:
        """Where the device of a lost port is now: by its serial number, if it has one; None while it is not plugged in."""
        number = self._numbers[name]
        if not number:
            return url
        place = port_of_number(number)
        return url if place and os.path.realpath(url) == os.path.realpath(place) else place


def _close(port: AnyPort) -> None:
    """Close a port; one whose close fails is closed all the same [close(2)], and a second attempt could hit the number of another file."""
    try:
        port.close()
    except PORT_FAULTS:
        if isinstance(port, serial.Serial):
            port.fd = None


def _read_block(port: AnyPort) -> bytes:
    """All bytes that wait, or the first that come; empty after `READ_TIMEOUT_S` without one."""
    received = bytes(port.read(max(1, port.in_waiting)))
    if not received or not isinstance(port, serial.SerialBase):
        return received
    # A read of a serial port that has waited returns its first byte alone; one of RFC 2217 gets its bytes singly from a thread.
    if isinstance(port, rfc2217.Serial):
        time.sleep(TOGETHER_S)
    waiting = port.in_waiting
    return received + bytes(port.read(waiting)) if waiting else received


def check_different(urls: Mapping[str, str]) -> None:
    """Raise EchostepError when two names have the same port."""
    for (name, url), (other, again) in combinations(urls.items(), 2):
        if os.path.realpath(url) == os.path.realpath(again):
            raise EchostepError(f"{url} is given twice, for {name} and {other}: each has a port of its own")


def _open(url: str, baud: int) -> AnyPort:
    """The port, locked for this process; raises EchostepError that names the program that has it open."""
    if refused := refusal(url):
        raise EchostepError(str(refused))
    try:
        if url.startswith("udp://"):
            return UdpPort(url)
        if url == STANDARD_INPUT:
            return StandardInput()
        if url.startswith("socket://"):
            return TcpPort(url, WRITE_TIMEOUT_S)
        write_timeout_s = None if url.startswith("rfc2217://") else WRITE_TIMEOUT_S  # pyserial has a fixed one there
        return serial.serial_for_url(
            url, baudrate=baud, timeout=READ_TIMEOUT_S, write_timeout=write_timeout_s, exclusive=True
        )
    except PORT_FAULTS as error:
        if getattr(error, "errno", None) in (errno.EWOULDBLOCK, errno.EBUSY):
            held = ", ".join(holders(url))
            known = [name for name in TAKERS if name in held or not held]
            remedy = taker_of(known) or "end that program, or give another port"
            held = held or "a program of another user"
            raise EchostepError(f"{url} is in use by {held}: {remedy}") from error
        there = "is what gives the port (ser2net) running there?" if is_url(url) else SEE_PORTS
        raise EchostepError(f"{url}: cannot open the port: {error}; {there}") from error
