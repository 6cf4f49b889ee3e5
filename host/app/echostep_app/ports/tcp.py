# SPDX-License-Identifier: MIT
"""A serial port over TCP, as ser2net gives it, and standard input, with the methods of a serial port.

In: a URL, socket://HOST:PORT. Out: the bytes that wait, in blocks: pyserial's own port of this kind reports one byte at a time. Owns the socket.
"""

from __future__ import annotations

import os
import select
import socket
from urllib.parse import urlsplit

from echostep.errors import EchostepError
from echostep_app.printing.lines import as_error, faults_of

READ_TIMEOUT_S = 0.1  # the reading thread sees `close` in time
CONNECT_TIMEOUT_S = 3.0
BLOCK = 4096  # bytes of a read at most: some milliseconds of a port


class TcpPort:
    """A connection to the URL's address; raises EchostepError when it fails."""

    def __init__(self, url: str, write_timeout_s: float) -> None:
        parts = urlsplit(url)
        with faults_of(url, "; expected socket://HOST:PORT"):
            host, port = parts.hostname, parts.port
        if not host or port is None or parts.path or parts.query:
            raise EchostepError(f"{url}: expected socket://HOST:PORT, for instance socket://127.0.0.1:7011")
        with as_error(f"{url}: cannot connect", "; is ser2net, or what gives the port, running there?"):
            self._socket = socket.create_connection((host, port), CONNECT_TIMEOUT_S)
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket.settimeout(write_timeout_s)

    @property
    def in_waiting(self) -> int:
        """Largest useful `size` of a read, bytes; the number of waiting bytes is not known."""
        return BLOCK

    def read(self, size: int) -> bytes:
        """The waiting bytes, at most `size`; empty after `READ_TIMEOUT_S` without one. Raises OSError when the other end has closed."""
        ready, _, _ = select.select([self._socket], [], [], READ_TIMEOUT_S)
        if not ready:
            return b""
        received = self._socket.recv(size)
        if not received:
            raise ConnectionError("the other end closed the connection")
        return received

    def write(self, sent: bytes) -> int:
        """Send bytes; returns their number."""
        self._socket.sendall(sent)
        return len(sent)

    def close(self) -> None:
        """Close the connection."""
        self._socket.close()


class StandardInput:
    """Standard input, which can only be read."""

    in_waiting = BLOCK

    def __init__(self) -> None:
        if os.name != "posix":
            raise EchostepError(
                "-: standard input is a port on Linux and macOS only: give a serial port, tcp:// or udp://"
            )

    def read(self, size: int) -> bytes:
        """The waiting bytes, at most `size`; empty after `READ_TIMEOUT_S` without one. Raises EOFError at the end."""
        ready, _, _ = select.select([0], [], [], READ_TIMEOUT_S)
        if not ready:
            return b""
        received = os.read(0, size)
        if not received:
            raise EOFError
        return received

    def write(self, sent: bytes) -> int:
        """Discard the bytes; returns their number."""
        return len(sent)

    def close(self) -> None:
        """Leave it open: it is the process's."""
