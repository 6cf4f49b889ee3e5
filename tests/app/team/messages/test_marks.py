# SPDX-License-Identifier: MIT
"""What commanders share: marks, acknowledgements and errands, in any order and from hostile senders too."""

from __future__ import annotations

import random
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import structs

from echostep_app.operation.command import RETAINED_S, Restorer
from echostep_app.operation.requests import Send, parse_request
from echostep_app.team.messages.marks import (
    MOST_MARKS,
    MOST_REMOVED,
    ROOT,
    Errand,
    Mark,
    MarkBoard,
    ack_message,
    errand_message,
)
from echostep_app.team.messages.report import BadReportError, ReportedAlarm
from operation.teams import TOWER, Team, place

HAZARD = Mark(1, "0123abcd", "hazard", 3.0, 2.0, 1, "Ann", 1.8e9, "7" * 64)
TOPIC, PAYLOAD = HAZARD.message


def test_a_mark_comes_back_and_an_empty_message_removes_it() -> None:
    board = MarkBoard()
    board.receive(TOPIC, PAYLOAD)
    assert board.marks == {HAZARD.id: HAZARD}
    board.receive(TOPIC, b"")
    board.receive(TOPIC, b"")
    assert not board.marks


def test_what_a_board_knows_makes_the_same_board() -> None:
    board, other = MarkBoard(), MarkBoard()
    board.receive(*HAZARD.message)
    board.receive(*structs.replace(HAZARD, id="89abcdef", removed=True).message)
    for by, unix_s in (("Ben", 1.8e9 + 1.0), ("Ann", 1.8e9)):  # the broker keeps the last one: it needs no answer
        board.receive(*ack_message(("red", "kim", "0123abcd-2"), by, unix_s))
    assert not board.answers
    for message in board.messages:
        other.receive(*message)
    assert (other.marks, other.removed, other.acks) == (board.marks, board.removed, board.acks)


def test_removed_marks_are_bounded() -> None:
    board = MarkBoard()
    for k in range(MOST_REMOVED + 5):
        board.receive(*structs.replace(HAZARD, id=f"{k:08x}", removed=True).message)
    assert len(board.removed) == MOST_REMOVED
    assert "00000000" not in board.removed


def test_after_a_new_connection_only_what_the_broker_has_lost_is_sent_again() -> None:
    restorer, known = Restorer(), [(f"{ROOT}/mark/{k:08x}", b"%d" % k) for k in range(20)]
    assert restorer.look(True, [], lambda: [], 0.0) == []  # the first connection: nothing is known
    assert restorer.look(True, [], lambda: [], RETAINED_S) == []
    assert restorer.look(False, [], lambda: known, 10.0) == []
    assert restorer.look(True, [known[1][0]], lambda: known, 11.0) == []
    assert restorer.look(True, [known[0][0]], lambda: known, 11.0 + RETAINED_S) == known[2:18]
    assert restorer.look(True, [], lambda: known, 14.0) == known[18:]
    assert restorer.look(True, [], lambda: known, 15.0) == []


def test_boards_that_answer_each_other_come_to_one_state_whatever_the_order() -> None:
    key, rng = ("red", "kim", "0123abcd-2"), random.Random(1)
    sent = [HAZARD.message, structs.replace(HAZARD, removed=True).message]
    sent += [ack_message(key, by, 1.8e9 + k) for k, by in enumerate(("Ann", "Ben"))]
    for _ in range(50):
        boards, kept = [MarkBoard() for _ in range(3)], dict[str, bytes]()
        waiting = rng.sample(sent * 2, 8)
        while waiting:
            topic, payload = waiting.pop(rng.randrange(len(waiting)))
            kept[topic] = payload
            for board in boards:
                board.receive(topic, payload)
                waiting += board.answers
                board.answers.clear()
        late = MarkBoard()
        for message in kept.items():
            late.receive(*message)
        assert all((board.marks, board.acks) == (late.marks, late.acks) for board in boards)
        assert (late.marks, late.acks[key].by) == ({}, "Ann")


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


KEY = ("red", "anna", "0123abcd")
ERRAND = Errand(1, "finn", "2nd floor, in corridor", 3.0, 2.0, 2, "Ben", 1.8e9, "7" * 64)


@pytest.mark.parametrize(
    ("topic", "errand", "reason"),
    [
        (f"{ROOT}/errand/red/anna/{33 * '0'}", ERRAND, "unknown topic"),
        (f"{ROOT}/errand/red/anna", ERRAND, "unknown topic"),
        (f"{ROOT}/errand/red/an\x07na/1", ERRAND, "a name has"),
        (f"{ROOT}/errand/red/anna/1", structs.replace(ERRAND, by="B\u202een"), "unprintable text"),
        (f"{ROOT}/errand/red/anna/1", structs.replace(ERRAND, to="f\nn"), "unprintable text"),
        (f"{ROOT}/errand/red/anna/1", structs.replace(ERRAND, x_m=1e12), "not a valid errand"),
        (f"{ROOT}/errand/red/anna/1", structs.replace(ERRAND, plan_sha256="7"), "not a valid errand"),
    ],
)  # fmt: skip
def test_what_is_no_errand_is_rejected_with_the_reason(topic: str, errand: Errand, reason: str) -> None:
    with pytest.raises(BadReportError, match=reason):
        MarkBoard().receive(topic, errand_message(KEY, errand)[1])


def test_a_commander_sends_only_to_a_place_that_is_known() -> None:
    team = Team()
    team.hear("Finn", place(TOWER, 7.0, 2.0, 2), alarm=ReportedAlarm("mayday", "fall", 1, 3.0))
    team.hear("Kim", None, alarm=ReportedAlarm("mayday", "help", 1, 3.0))
    team.hear("Anna", place(TOWER, 5.0, 2.0, 0))
    ids = {row.name: row.id for row in team.scene().rows}
    request = parse_request(f'{{"kind":"send","id":{ids["Anna"]},"to":{ids["Finn"]},"by":"Ben"}}')
    assert request == Send(ids["Anna"], ids["Finn"], "Ben")
    assert not team.ask(request)
    (errand,) = team.operation._board.errands.values()
    assert (errand.to, errand.x_m, errand.y_m, errand.level, errand.by) == ("Finn", 7.0, 2.0, 2, "Ben")
    rescuers = team.operation.distress(ids["Finn"], team.now_s)
    assert rescuers is not None
    assert [(r.name, r.sent) for r in rescuers.rescuers] == [("Anna", "sent by Ben")]
    team.pass_time(1.0)
    assert "sent to Finn by Ben" in next(row for row in team.scene().rows if row.name == "Anna").notes
    for number, to in ((ids["Anna"], ids["Kim"]), (99, ids["Finn"]), (ids["Anna"], 99)):
        refusal = "Not sent: the place of the one in distress is not known on this plan."
        assert team.ask(Send(number, to, "Ben")) == refusal
