"""A UDP address as a port that is read like a serial one.

In: a URL, udp://HOST:PORT. Out: the bytes of the datagrams that come there, each between two zeros, so that a damaged one spoils no other (frames
end in zeros, protocol/README.md). Owns the socket.
"""

from __future__ import annotations

import select
import socket
from urllib.parse import urlsplit

from echostep.errors import EchostepError

READ_TIMEOUT_S = 0.1
MOST = 65536  # bytes a read
KERNEL_BUFFER = 1 << 20


class UdpPort:
    """Bound to one address; raises EchostepError when that is not possible."""

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
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, KERNEL_BUFFER)
            self._socket.bind((host, port))
            self._socket.setblocking(False)
        except OSError as error:
            self._socket.close()
            raise EchostepError(f"{url}: cannot listen there: {error.strerror or error}") from error

    @property
    def in_waiting(self) -> int:
        """How much a read may bring."""
        return MOST

    def read(self, size: int) -> bytes:
        """All datagrams that wait, at most about `size` bytes; nothing when none came for `READ_TIMEOUT_S`."""
        ready, _, _ = select.select([self._socket], [], [], READ_TIMEOUT_S)
        received = bytearray()
        while ready and len(received) < size:
            try:
                received += b"\0" + self._socket.recv(MOST) + b"\0"
            except BlockingIOError:
                break
        return bytes(received)

    def write(self, sent: bytes) -> int:
        """A gateway takes no orders: nothing is sent."""
        return len(sent)

    def close(self) -> None:
        """Give the address back."""
        self._socket.close()
