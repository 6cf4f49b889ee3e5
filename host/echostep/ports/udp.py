"""A UDP address with the methods of a serial port.

In: a URL, udp://HOST:PORT. Out: the bytes of the received datagrams. A zero is put before and after each datagram: frames end in zeros
(protocol/README.md), so a damaged datagram does not damage its neighbours. Owns the socket.
"""

from __future__ import annotations

import select
import socket
from urllib.parse import urlsplit

from echostep.errors import EchostepError

READ_TIMEOUT_S = 0.1  # by reason: the reading thread sees `close` in time
READ_BYTES = 65536  # of one read; no datagram is larger: its length field has 16 bits [RFC 768]
KERNEL_BUFFER_BYTES = 1 << 20  # by reason: datagrams wait there while the host is busy


class UdpPort:
    """A socket bound to the URL's address; raises EchostepError when the URL is not valid or the address cannot be bound."""

    def __init__(self, url: str) -> None:
        parts = urlsplit(url)
        try:
            host, port = parts.hostname, parts.port
        except ValueError as error:
            raise EchostepError(f"{url}: {error}; expected udp://HOST:PORT") from error
        if not host or port is None or parts.path:
            raise EchostepError(f"{url}: expected udp://HOST:PORT, for instance udp://127.0.0.1:9000")
        self._socket = socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, KERNEL_BUFFER_BYTES)
            self._socket.bind((host, port))
            self._socket.setblocking(False)
        except OSError as error:
            self._socket.close()
            raise EchostepError(f"{url}: cannot listen there: {error.strerror or error}") from error

    @property
    def in_waiting(self) -> int:
        """Largest useful `size` of a read, bytes; the number of waiting bytes is not known."""
        return READ_BYTES

    def read(self, size: int) -> bytes:
        """Waiting datagrams until `size` bytes are reached; empty after `READ_TIMEOUT_S` without a datagram."""
        ready, _, _ = select.select([self._socket], [], [], READ_TIMEOUT_S)
        received = bytearray()
        while ready and len(received) < size:
            try:
                received += b"\0" + self._socket.recv(READ_BYTES) + b"\0"
            except BlockingIOError:
                break
        return bytes(received)

    def write(self, sent: bytes) -> int:
        """Discard the bytes: a gateway receives no commands. Returns their number, as a serial port does."""
        return len(sent)

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()
