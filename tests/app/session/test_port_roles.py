# SPDX-License-Identifier: MIT
"""Ports of a live run: devices keep their names when they come back; the board is asked for its optional messages."""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Iterable
from types import SimpleNamespace

import pytest

from board_runs import ROOT
from echostep.board import messages as m
from echostep.board.frames import encode
from echostep.board.reports import SUBSCRIBE
from echostep.errors import EchostepError
from echostep.ports.chunks import BOARD, MTX, Chunk
from echostep_app.session.options import PortOptions
from echostep_app.session.runs.live import _open_ports, _with_subscription
from echostep_app.session.runs.port_roles import SURE_BYTES, with_right_names

CAPTURES = ROOT / "tests/captures"
BYTES = {name: (CAPTURES / f"{name}.bin").read_bytes()[: 2 * SURE_BYTES] for name in (BOARD, MTX)}


class Ports:
    """What the stage sees of open ports."""

    def __init__(self) -> None:
        self.names, self.urls = (BOARD, MTX), {BOARD: "/dev/ttyACM0", MTX: "/dev/ttyUSB0"}
        self.lost: set[str] = set()
        self.notices: deque[str] = deque()
        self.exchanged: list[tuple[str, str]] = []

    def exchange(self, one: str, other: str) -> None:
        self.exchanged.append((one, other))
        self.urls[one], self.urls[other] = self.urls[other], self.urls[one]


def opened_again(port: str) -> Chunk:
    return Chunk(port, 1, b"")


def stream(port: str, device: str) -> list[Chunk]:
    """Bytes of a device, 100 at a time, a chunk a millisecond."""
    received = BYTES[device]
    return [Chunk(port, k * 1_000_000, received[100 * k : 100 * k + 100]) for k in range(len(received) // 100)]


def by_name(chunks: Iterable[Chunk | None], ports: Ports) -> dict[str, bytes]:
    """All bytes that come out, by name."""
    joined = {BOARD: b"", MTX: b""}
    for chunk in with_right_names(chunks, ports):  # type: ignore[arg-type]
        if chunk is not None:
            joined[chunk.port] += chunk.data
    return joined


def test_two_devices_that_exchanged_their_ports_are_exchanged_back() -> None:
    ports = Ports()
    before = stream(BOARD, BOARD)[:3] + stream(MTX, MTX)[:3]
    after = [
        opened_again(BOARD),
        opened_again(MTX),
        *stream(BOARD, MTX),
        *stream(MTX, BOARD),
        None,
        *stream(BOARD, MTX),
    ]
    joined = by_name([*before, *after], ports)
    assert joined[BOARD] == b"".join(c.data for c in stream(BOARD, BOARD)[:3] + stream(MTX, BOARD))
    assert joined[MTX] == b"".join(c.data for c in stream(MTX, MTX)[:3] + 2 * stream(BOARD, MTX))
    assert ports.exchanged == [(BOARD, MTX)]
    assert list(ports.notices) == ["board and mtx have exchanged their ports: /dev/ttyUSB0 is the sensor board now"]


def test_the_second_port_may_come_back_later() -> None:
    ports = Ports()
    ports.lost = {MTX}
    joined = by_name([opened_again(BOARD), *stream(BOARD, MTX), opened_again(MTX), *stream(MTX, BOARD)], ports)
    assert joined == {
        BOARD: b"".join(c.data for c in stream(MTX, BOARD)),
        MTX: b"".join(c.data for c in stream(BOARD, MTX)),
    }


def test_the_same_device_loses_no_byte() -> None:
    ports = Ports()
    joined = by_name([opened_again(BOARD), *stream(BOARD, BOARD)], ports)
    assert joined[BOARD] == b"".join(c.data for c in stream(BOARD, BOARD))
    assert not ports.notices


def test_a_device_that_is_there_already_is_refused_at_a_second_port() -> None:
    ports = Ports()
    joined = by_name([*stream(MTX, MTX)[:1], opened_again(BOARD), *stream(BOARD, MTX)], ports)
    assert joined[BOARD] == b""
    assert ports.notices[0].startswith("board: /dev/ttyACM0 is the MTx, not the sensor board")
    assert ports.notices[0].endswith("its bytes are not used")
    assert len(ports.notices) == 1


def test_bytes_of_no_known_device_wait_two_seconds_and_are_recorded_as_they_are() -> None:
    ports = Ports()
    noise = [Chunk(BOARD, k * 1_000_000_000, b"\x55" * 10) for k in range(4)]
    assert by_name([opened_again(BOARD), *noise], ports)[BOARD] == b"\x55" * 40


@pytest.mark.parametrize(
    ("options", "named"),
    [
        ({"mtx": "/dev/null"}, "for board and mtx"),
        ({"beacons": "/dev/null"}, "for board and gateway"),
        ({"foot": "/dev/null"}, "for board and foot"),
    ],
)
def test_two_uses_of_one_port_are_refused_at_once(options: dict[str, str], named: str) -> None:
    with pytest.raises(EchostepError, match=f"is given twice, {re.escape(named)}"):
        _open_ports(
            PortOptions("/dev/null", options.get("mtx"), options.get("beacons"), None, None, options.get("foot"))
        )


def test_the_board_is_asked_and_no_chunk_is_lost() -> None:
    identity = m.Identity(0, m.SCHEMA_HASH, 1, 2, 0, m.ResetCause.POWER_ON)
    health = m.BoardHealth(0, 5_000, 5_000, 1, 0, 0, 0, 0)
    # At the fifth it has restarted
    messages: list[m.Message] = [identity, health, identity, health, identity, identity]
    chunks = [Chunk(BOARD, k, encode(message, k)) for k, message in enumerate(messages)]
    stream = [None, Chunk(MTX, 0, b"\xfa"), *chunks]
    sent: list[tuple[str, bytes]] = []
    ports = SimpleNamespace(send=lambda port, data: sent.append((port, data)))
    assert list(_with_subscription(stream, ports)) == stream  # type: ignore[arg-type]
    assert sent == [(BOARD, encode(SUBSCRIBE, 0))] * 2


def test_a_stale_board_is_not_asked() -> None:
    stale = Chunk(BOARD, 0, encode(m.Identity(0, 0x12345678, 9, 0, 0, 0), 0))
    ports = SimpleNamespace(send=lambda *_: 1 / 0)
    assert list(_with_subscription([stale], ports)) == [stale]  # type: ignore[arg-type]
