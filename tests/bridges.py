# SPDX-License-Identifier: MIT
"""Serial ports over a network, for the tests: raw TCP and RFC 2217, as ser2net gives them."""

from __future__ import annotations

import os
import select
import socket
import threading
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import SimpleNamespace

import serial
from serial.rfc2217 import PortManager

from waiting import PATIENCE_S

BLOCK = 4096  # bytes


def _raw(_connection: socket.socket) -> tuple[Callable[[bytes], bytes], Callable[[bytes], bytes]]:
    """What becomes of the port's bytes and of the client's: nothing."""
    return bytes, bytes


def _telnet(connection: socket.socket) -> tuple[Callable[[bytes], bytes], Callable[[bytes], bytes]]:
    """The same by RFC 2217; the client's settings go to a port that does not exist."""
    answers = SimpleNamespace(write=connection.sendall)
    manager = PortManager(serial.serial_for_url("loop://"), answers)
    return lambda sent: b"".join(manager.escape(sent)), lambda sent: b"".join(manager.filter(sent))


def _carry(port: str, connection: socket.socket, over: threading.Event, telnet: bool) -> None:
    """Bytes in both directions until one end closes."""
    outward, inward = (_telnet if telnet else _raw)(connection)
    device = os.open(port, os.O_RDWR | os.O_NOCTTY)
    tty.setraw(device)
    try:
        while not over.is_set():
            ready, _, _ = select.select([device, connection.fileno()], [], [], 0.1)
            if device in ready:
                connection.sendall(outward(os.read(device, BLOCK)))
            if connection.fileno() in ready:
                received = connection.recv(BLOCK)
                if not received:
                    return
                os.write(device, inward(received))
    except OSError:
        return
    finally:
        os.close(device)


@contextmanager
def bridged(port: str, scheme: str = "socket") -> Iterator[str]:
    """The URL of the port over TCP, `socket` or `rfc2217`, for one client after the other."""
    over = threading.Event()
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(0.1)

        def serve() -> None:
            while not over.is_set():
                with suppress(TimeoutError), server.accept()[0] as connection:
                    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                    _carry(port, connection, over, scheme == "rfc2217")

        thread = threading.Thread(target=serve)
        thread.start()
        try:
            yield f"{scheme}://127.0.0.1:{server.getsockname()[1]}"
        finally:
            over.set()
            thread.join(timeout=PATIENCE_S)
