# SPDX-License-Identifier: MIT
"""A UDP address with the methods of a serial port.

In: a URL, udp://HOST:PORT or udp://HOST:PORT?key=FILE. Out: the bytes of the received datagrams. A zero is put before and after each datagram: frames
end in zeros (protocol/README.md), so a damaged datagram does not damage its neighbours. Owns the socket and the counts.

Whatever is sent, at most `BYTES_A_SECOND` come out, and at most `DATAGRAMS_A_SECOND` are examined; the rest is dropped and counted. With a key only
authentic datagrams count.
"""

from __future__ import annotations

import select
import socket
import time
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

from echostep.errors import EchostepError
from echostep_app.ports.datagram_key import Opener, read_key
from echostep_app.printing.lines import faults_of

READ_TIMEOUT_S = 0.1  # the reading thread sees `close` in time
LARGEST = 1472  # bytes of a datagram: one Ethernet frame; longer ones are dropped
# Assumed: 64 beacons, 20 measurements a second each, one datagram of 25 bytes each.
BYTES_A_SECOND = 32_000.0
DATAGRAMS_A_SECOND = 2_000.0
BURST_S = 1.0  # of either budget that may be used at once
KERNEL_BUFFER_BYTES = 1 << 16  # datagrams wait there while the host is busy; the operating system drops the rest
NEWS_S = 10.0  # between two notices


@dataclass
class _Budget:
    """`left` of an amount a second, at most the amount of `BURST_S`."""

    a_second: float
    left: float

    def fill(self, passed_s: float) -> None:
        self.left = min(self.left + passed_s * self.a_second, BURST_S * self.a_second)


class UdpPort:
    """A socket bound to the URL's address; raises EchostepError when the URL is not valid or the address cannot be bound.

    `dropped`: datagrams that were too long, or more than the budget. `refused`: not authentic, or sent again.
    """

    def __init__(self, url: str) -> None:
        host, port, self._opener = _parse(url)
        self._socket = socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, KERNEL_BUFFER_BYTES)
            self._socket.bind((host, port))
            self._socket.setblocking(False)
        except OSError as error:
            self._socket.close()
            raise EchostepError(f"{url}: cannot listen there: {error.strerror or error}") from error
        self.dropped = self.refused = 0
        self._bytes = _Budget(BYTES_A_SECOND, BURST_S * BYTES_A_SECOND)
        self._looks = _Budget(DATAGRAMS_A_SECOND, BURST_S * DATAGRAMS_A_SECOND)
        self._filled_s = time.monotonic()
        self._news_s, self._told = -NEWS_S, (0, 0)

    @property
    def in_waiting(self) -> int:
        """Largest useful `size` of a read, bytes; the number of waiting bytes is not known."""
        return round(BYTES_A_SECOND)

    def read(self, size: int) -> bytes:
        """Waiting datagrams until `size` bytes are reached; empty after `READ_TIMEOUT_S` without one, or while more come than are examined."""
        self._fill()
        if self._looks.left < 1.0:
            time.sleep(READ_TIMEOUT_S)
            return b""
        ready, _, _ = select.select([self._socket], [], [], READ_TIMEOUT_S)
        received = bytearray()
        while ready and len(received) < size and self._looks.left >= 1.0:
            self._looks.left -= 1.0
            try:
                received += self._accepted(self._socket.recv(LARGEST + 1))
            except OSError:  # none waits, or the other end has refused something
                break
        return bytes(received)

    def _fill(self) -> None:
        now_s = time.monotonic()
        passed_s, self._filled_s = now_s - self._filled_s, now_s
        self._bytes.fill(passed_s)
        self._looks.fill(passed_s)

    def _accepted(self, datagram: bytes) -> bytes:
        """The datagram's bytes between zeros; empty if it is dropped or refused."""
        if len(datagram) > LARGEST:
            self.dropped += 1
            return b""
        opened = self._opener.open(datagram) if self._opener else datagram
        if opened is None:
            self.refused += 1
            return b""
        if len(opened) + 2 > self._bytes.left:
            self.dropped += 1
            return b""
        self._bytes.left -= len(opened) + 2
        return b"\0" + opened + b"\0"

    def news(self) -> str:
        """How many datagrams were not used, if there are new ones; not more often than every `NEWS_S`."""
        now = (self.dropped, self.refused)
        if now == self._told or time.monotonic() - self._news_s < NEWS_S:
            return ""
        self._news_s, self._told = time.monotonic(), now
        return f"{self.dropped} datagrams were dropped (too long or too many), {self.refused} had no valid key"

    def write(self, sent: bytes) -> int:
        """Discard the bytes: a gateway receives no commands. Returns their number, as a serial port does."""
        return len(sent)

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


def _parse(url: str) -> tuple[str, int, Opener | None]:
    """Host, port and, with a key, the opener of the datagrams."""
    parts = urlsplit(url)
    with faults_of(url, "; expected udp://HOST:PORT"):
        host, port = parts.hostname, parts.port
    if not host or port is None or parts.path:
        raise EchostepError(f"{url}: expected udp://HOST:PORT, for instance udp://127.0.0.1:9000")
    key = key_of(url)
    return host, port, Opener(key) if key else None


def key_of(url: str) -> bytes | None:
    """The key that a URL names, None without one; raises EchostepError for anything else after the port, so that no key is left out by mistake."""
    parts = urlsplit(url)
    with faults_of(url, "; expected udp://HOST:PORT?key=FILE"):
        query = parse_qs(parts.query, keep_blank_values=True, strict_parsing=bool(parts.query))
    if parts.fragment or set(query) - {"key"} or len(query.get("key", ())) > 1:
        raise EchostepError(f"{url}: expected nothing behind the port but ?key=FILE")
    return read_key(Path(query["key"][0])) if query else None
