# SPDX-License-Identifier: MIT
"""Beacons over UDP among strangers: floods, forgeries, datagrams sent again, invented beacons."""

from __future__ import annotations

import re
import socket
from collections.abc import Iterator
from contextlib import closing, contextmanager
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import pytest

from board_runs import ROOT
from echostep.board.frames import encode
from echostep.board.gateway import FEW_S, MOST_BEACONS, Gateway
from echostep.ports.chunks import GATEWAY, MTX, Chunk
from echostep_app.commands.actions.beacon_player import _open_sender
from echostep_app.ports import serial_ports, udp
from echostep_app.ports.datagram_key import Opener, read_key, seal
from echostep_app.ports.serial_ports import ChunkQueue
from echostep_app.ports.udp import UdpPort
from echostep_simulation.devices.beacon_gateway import message
from free_ports import free_port
from snapshots import refusal
from waiting import until

KEY = bytes(range(32))
FRAME = encode(message(7, 3.25, 0.5, 10.0), 0)


def free_url() -> str:
    return f"udp://127.0.0.1:{free_port(socket.SOCK_DGRAM)}"


@contextmanager
def connected(query: str = "") -> Iterator[tuple[UdpPort, socket.socket]]:
    url = free_url()
    with closing(UdpPort(url + query)) as port, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.connect(("127.0.0.1", int(url.rsplit(":", 1)[1])))
        yield port, sender


@pytest.fixture
def key_file(tmp_path: Path) -> Path:
    (tmp_path / "key").write_text(KEY.hex() + "\n")
    return tmp_path / "key"


def test_a_flood_costs_a_budget_and_is_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(udp, "BYTES_A_SECOND", 1000.0)
    monkeypatch.setattr(udp, "DATAGRAMS_A_SECOND", 100.0)
    now_s = 0.0
    monkeypatch.setattr(udp, "time", SimpleNamespace(monotonic=lambda: now_s, sleep=lambda _: None))
    with connected() as (port, sender):
        received = looked = 0
        for _ in range(40):
            for _ in range(20):
                sender.send(bytes(100))
                sender.send(bytes(udp.LARGEST + 1))
            now_s += 0.1
            received += len(port.read(port.in_waiting))
        looked = port.dropped + received // 102
        assert port.dropped > 50
        assert received <= 1000 + 1000 * 4  # a burst, and four seconds
        assert looked <= 100 + 100 * 4
        assert "datagrams were dropped" in port.news()
        assert port.news() == ""


def test_with_a_key_only_its_datagrams_count_and_each_once(key_file: Path) -> None:
    with connected(f"?key={key_file}") as (port, sender):
        good = seal(KEY, FRAME, 5)
        for sent in (FRAME, good, good, seal(KEY, FRAME, 4), seal(bytes(32), FRAME, 9), good[:-1], b""):
            sender.send(sent)
        sender.send(seal(KEY, b"last", 6))
        received = b""
        for _ in range(50):
            received += port.read(1000)
            if b"last" in received:
                break
        assert received == b"\0" + FRAME + b"\0\0last\0"
        assert port.refused == 6


def test_the_simulated_gateway_seals_what_it_sends(key_file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its counter grows although the clock is set back."""
    clock_ns = iter((10**18, 10**17))
    monkeypatch.setattr("echostep_app.commands.actions.beacon_player.time.time_ns", lambda: next(clock_ns))
    url = f"{free_url()}?key={key_file}"
    with closing(UdpPort(url)) as port:
        send, close = _open_sender(url)
        try:
            for _ in range(2):
                send(FRAME)
                assert until(lambda: port.read(1000) == b"\0" + FRAME + b"\0")
        finally:
            close()


def test_the_vector_of_the_protocol() -> None:
    text = (ROOT / "protocol/README.md").read_text()
    datagram = seal(KEY, b"", 1)
    assert datagram[:8].hex() in text
    assert datagram[8:].hex() in text
    assert Opener(KEY).open(datagram) == b""


def test_what_is_no_key_is_named(tmp_path: Path) -> None:
    for content in (None, "", "xyz", "00", "ü", "00" * 65):
        if content is not None:
            (tmp_path / "key").write_text(content)
        assert "key" in refusal(lambda: read_key(tmp_path / "key"))
    for query in ("?kye=a", "?key", "?key=", "#key=a", "?key=a&key=b"):
        assert re.search("udp://|key", refusal(partial(UdpPort, free_url() + query))), query


def test_a_queue_drops_and_counts_what_finds_no_room(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(serial_ports, "MOST_BYTES", 10_000)
    queue = ChunkQueue()
    for k in range(100):
        queue.put(Chunk(GATEWAY, k, bytes(900)))
    queue.put(Chunk(MTX, 100, b"mtx"))
    assert queue.dropped == {GATEWAY: 90}
    taken = [queue.get(0.0) for _ in range(11)]
    assert taken[-1] == Chunk(MTX, 100, b"mtx")
    assert queue.get(0.0) is None


def test_slots_of_invented_beacons_are_given_up() -> None:
    gateway = Gateway()
    for number in range(MOST_BEACONS):
        assert len(gateway.read(encode(message(number, 2.0, 0.0, 10.0), number), 10.0)) == 1
    later_s = 10.0 + FEW_S + 1.0
    true = [message(1000, 2.0, 0.0, t_s) for t_s in (10.5, later_s)]
    assert gateway.read(encode(true[0], 0), 10.5) == []
    assert gateway.counts.too_many == 1
    assert [r.slot for r in gateway.read(encode(true[1], 1), later_s)] == [0]
    assert gateway.numbers[0] == 1000
    assert len(gateway.numbers) == MOST_BEACONS
