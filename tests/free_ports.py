# SPDX-License-Identifier: MIT
"""Numbers of free ports, for what must know its port before it opens it, or opens it again."""

from __future__ import annotations

import random
import socket

FIRST, LAST = 10_000, 32_000  # below what Linux gives to sockets that ask for no port [net.ipv4.ip_local_port_range]


def free_port(kind: socket.SocketKind = socket.SOCK_STREAM) -> int:
    """A port of 127.0.0.1 that no socket has, and that the system gives to no other program meanwhile."""
    draw = random.SystemRandom()
    while True:
        port = draw.randrange(FIRST, LAST)
        with socket.socket(socket.AF_INET, kind) as probe:
            try:
                probe.bind(("127.0.0.1", port))
            except OSError:
                continue
            return port
