# SPDX-License-Identifier: MIT
"""What commanders share: marks and acknowledgements, from hostile senders too."""

from __future__ import annotations

from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from echostep.team.marks import MOST_MARKS, Mark, MarkBoard, ack_message
from echostep.team.report import BadReportError

HAZARD = Mark(1, "0123abcd", "hazard", 3.0, 2.0, 1, "Ann", 1.8e9, "7" * 64)
TOPIC, PAYLOAD = HAZARD.message


def test_a_mark_comes_back_and_an_empty_message_removes_it() -> None:
    board = MarkBoard()
    board.receive(TOPIC, PAYLOAD)
    assert board.marks == {HAZARD.id: HAZARD}
    board.receive(TOPIC, b"")
    board.receive(TOPIC, b"")
    assert not board.marks


def test_the_first_acknowledgement_counts() -> None:
    board, key = MarkBoard(), ("red", "kim", "0123abcd-2")
    for by in ("Ann", "Ben"):
        board.receive(*ack_message(key, by, 1.8e9))
    assert board.acks[key].by == "Ann"


@pytest.mark.parametrize(
    ("topic", "payload", "why"),
    [
        (TOPIC, b"{}", "not a valid mark"),
        (TOPIC, PAYLOAD.replace(b"hazard", b"party"), "not a valid mark"),
        (TOPIC, PAYLOAD.replace(b'"x_m":3.0', b'"x_m":1e99'), "not a valid mark"),
        (TOPIC, PAYLOAD.replace(b"Ann", b"\\u001b[2J"), "unprintable"),
        (TOPIC, PAYLOAD.replace(b"0123abcd", b"ffffffff"), "contradict"),
        (TOPIC + "/x", PAYLOAD, "unknown topic"),
        ("echostep-table/ack/red/kim", b"{}", "unknown topic"),
        ("echostep-table/ack/red/\u202ekim/1", b"{}", "name"),
        ("echostep-table/ack/red/kim/1", b"[" * 5000, "not a valid acknowledgement"),
    ],
)
def test_hostile_messages_are_refused_by_name(topic: str, payload: bytes, why: str) -> None:
    board = MarkBoard()
    with pytest.raises(BadReportError, match=why):
        board.receive(topic, payload)
    assert not board.marks
    assert not board.acks


@given(st.text(max_size=40), st.binary(max_size=200))
def test_no_message_does_more_than_to_be_refused(topic: str, payload: bytes) -> None:
    board = MarkBoard()
    with suppress(BadReportError):
        board.receive(f"echostep-table/{topic}", payload)
    assert len(board.marks) + len(board.acks) <= 1


def as_number(k: int) -> tuple[str, bytes]:
    return f"echostep-table/mark/{k:08x}", PAYLOAD.replace(b"0123abcd", b"%08x" % k)


def test_a_flood_of_marks_is_bounded_and_keeps_those_that_are_there() -> None:
    board = MarkBoard()
    board.receive(TOPIC, PAYLOAD)
    for k in range(1, MOST_MARKS):
        board.receive(*as_number(k))
    with pytest.raises(BadReportError, match="more than 256 marks"):
        board.receive(*as_number(MOST_MARKS))
    assert len(board.marks) == MOST_MARKS
    assert board.marks[HAZARD.id] == HAZARD
    board.receive(TOPIC, PAYLOAD)  # a known one may still change
