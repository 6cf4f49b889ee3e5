# SPDX-License-Identifier: MIT
"""Where a port is: found again by serial number under another name; over TCP its bytes come in blocks."""

from __future__ import annotations

import os
import socket
from types import SimpleNamespace

import pytest
from serial.tools import list_ports

from echostep.errors import EchostepError
from echostep_app.ports.serial_ports import SerialPorts
from echostep_app.ports.usb_number import port_of_number, usb_number
from players import pseudo_terminal
from waiting import PATIENCE_S, until


def plugged(monkeypatch: pytest.MonkeyPatch, **numbers: str) -> None:
    """The system lists these ports: serial number by path, with _ for /."""
    seen = [SimpleNamespace(device=path.replace("_", "/"), serial_number=number) for path, number in numbers.items()]
    monkeypatch.setattr(list_ports, "comports", lambda: seen)


def test_a_number_that_two_devices_share_tells_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    plugged(monkeypatch, _dev_a="7", _dev_b="8", _dev_c="8")
    assert [usb_number(f"/dev/{port}") for port in "abcd"] == ["7", "", "", ""]
    assert port_of_number("7") == "/dev/a"
    assert port_of_number("9") is None


def test_a_device_under_a_new_name_is_found_by_its_number(monkeypatch: pytest.MonkeyPatch) -> None:
    with pseudo_terminal() as (board, was), pseudo_terminal() as (again, now), pseudo_terminal() as (stranger, other):
        plugged(monkeypatch, **{was.replace("/", "_"): "7"})
        ports = SerialPorts({"board": was}, {"board": 115200})
        try:
            plugged(monkeypatch, **{other.replace("/", "_"): "9"})  # another device, first
            ports._ports["board"].close()
            assert until(lambda: any("went away" in notice for notice in ports.notices))
            plugged(monkeypatch, **{other.replace("/", "_"): "9", now.replace("/", "_"): "7"})
            assert until(lambda: any(f"is back as {now}" in notice for notice in ports.notices))
            os.write(again, b"hello")
            chunks = (chunk for chunk in ports.chunks() if chunk is not None)
            assert next(chunks).data == b""  # the sign that the port was opened again
            assert next(chunks).data == b"hello"
            assert ports.urls == {"board": now}
        finally:
            ports.close()
    del board, stranger


def test_bytes_over_tcp_come_in_blocks_and_a_closed_connection_is_made_again() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(PATIENCE_S)
        ports = SerialPorts({"board": f"socket://127.0.0.1:{server.getsockname()[1]}"}, {"board": 115200})
        try:
            bridge, _ = server.accept()
            sent = bytes(range(256)) * 40
            bridge.sendall(sent)
            received, chunks = b"", (chunk for chunk in ports.chunks() if chunk is not None)
            count = 0
            while len(received) < len(sent):
                received, count = received + next(chunks).data, count + 1
            assert received == sent
            assert count < 20
            ports.send("board", b"question")
            assert bridge.recv(100) == b"question"
            bridge.close()
            with server.accept()[0] as bridge:
                bridge.sendall(b"again")
            assert until(lambda: any(chunk.data == b"again" for chunk in [next(chunks)]))
        finally:
            ports.close()


@pytest.mark.parametrize("url", ["socket://127.0.0.1:1", "socket://127.0.0.1", "socket://127.0.0.1:99999"])
def test_an_address_where_nothing_answers_is_one_sentence(url: str) -> None:
    with pytest.raises(EchostepError, match=r"socket://127\.0\.0\.1.*(ser2net|expected socket://HOST:PORT)"):
        SerialPorts({"board": url}, {"board": 115200})
