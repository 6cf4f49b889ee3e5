# SPDX-License-Identifier: MIT
"""A beacon gateway by UDP: floods, malformed datagrams, addresses that cannot be."""

from __future__ import annotations

import socket
from contextlib import closing

import pytest

from echostep.board.frames import encode
from echostep.board.gateway import Gateway
from echostep.errors import EchostepError
from echostep.ports.chunks import GATEWAY
from echostep_app.ports.serial_ports import SerialPorts
from echostep_app.ports.udp import UdpPort
from echostep_simulation.devices.beacon_gateway import message
from free_ports import free_port

GOOD = message(7, 3.25, 0.5, 10.0)


def test_udp_flood_and_malformed_datagrams_reach_the_reader_and_stop_nothing() -> None:
    url = f"udp://127.0.0.1:{free_port(socket.SOCK_DGRAM)}"
    gateway, words, address = Gateway(), 0, ("127.0.0.1", int(url.rsplit(":", 1)[1]))
    with (
        closing(SerialPorts({GATEWAY: url}, {GATEWAY: 115200})) as ports,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as plug,
    ):
        for k, chunk in zip(range(100_000), ports.chunks(), strict=False):
            words += len(gateway.read(chunk.data, 10.0)) if chunk else 0
            if gateway.counts.flood <= 100 or gateway.counts.broken <= 100:
                for n in range(20):
                    plug.sendto(encode(GOOD, 20 * k + n), address)
                    plug.sendto(b"\x07garbage" * (n % 9), address)
            elif words < 2:
                plug.sendto(encode(message(9, 1.0, 0.0, 10.0), 0), address)
            else:
                break
    assert words == 2
    assert gateway.counts.flood > 100
    assert gateway.counts.broken > 100


@pytest.mark.parametrize(
    "url", ["udp://127.0.0.1", "udp://:9000", "udp://127.0.0.1:99999", "udp://127.0.0.1:0x1", "udp://203.0.113.9:9"]
)
def test_udp_addresses_that_cannot_be_are_named(url: str) -> None:
    with pytest.raises(EchostepError, match="udp://"):
        UdpPort(url)
