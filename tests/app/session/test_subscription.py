# SPDX-License-Identifier: MIT
"""A live run asks the board for its optional messages, and again after a restart."""

from __future__ import annotations

from types import SimpleNamespace

from echostep.board import messages as m
from echostep.board.frames import encode
from echostep.board.reports import SUBSCRIBE
from echostep.ports.chunks import BOARD, MTX, Chunk
from echostep_app.session.runs.live import _with_subscription


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
