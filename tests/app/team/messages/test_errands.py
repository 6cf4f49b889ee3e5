# SPDX-License-Identifier: MIT
"""Errands: of one run the latest counts in any order of messages; hostile ones are counted; the commander sends them to a known place only."""

from __future__ import annotations

import itertools

import pytest
from msgspec import structs

from echostep_app.operation.requests import Send, parse_request
from echostep_app.team.messages.marks import MOST_ERRANDS, ROOT, Errand, MarkBoard, errand_message
from echostep_app.team.messages.report import BadReportError, ReportedAlarm
from operation.teams import TOWER, Team, place

KEY = ("red", "anna", "0123abcd")
ERRAND = Errand(1, "finn", "2nd floor, in corridor", 3.0, 2.0, 2, "Ben", 1.8e9, "7" * 64)
LATER = structs.replace(ERRAND, to="kim", where="", unix_s=1.8e9 + 60.0)


def test_of_one_run_the_latest_counts_in_any_order_and_a_board_gives_it_back() -> None:
    for messages in itertools.permutations([errand_message(KEY, ERRAND), errand_message(KEY, LATER)]):
        board = MarkBoard()
        for message in messages:
            board.receive(*message)
        assert board.errands == {KEY: LATER}
        assert list(board.messages) == [errand_message(KEY, LATER)]
        assert board.copy().errands == board.errands
        assert list(board.answers) == (
            [errand_message(KEY, LATER)] if messages[0] == errand_message(KEY, LATER) else []
        )
        board.receive(errand_message(KEY, LATER)[0], b"")
        assert not board.errands


def test_words_for_who_is_sent() -> None:
    assert ERRAND.words == "Ben sends you to finn, in distress: 2nd floor, in corridor"
    assert LATER.words == "Ben sends you to kim, in distress"


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


def test_errands_are_bounded() -> None:
    board = MarkBoard()
    for k in range(MOST_ERRANDS):
        board.receive(*errand_message(("red", "anna", f"{k:08x}"), ERRAND))
    with pytest.raises(BadReportError, match="more than"):
        board.receive(*errand_message(("red", "anna", "ffffffff"), ERRAND))


def test_a_commander_sends_only_to_a_place_that_is_known() -> None:
    team = Team()
    team.hear("Finn", place(TOWER, 7.0, 2.0, 2), alarm=ReportedAlarm("mayday", "fall", 1, 3.0))
    team.hear("Kim", None, alarm=ReportedAlarm("mayday", "help", 1, 3.0))
    team.hear("Anna", place(TOWER, 5.0, 2.0, 0))
    ids = {row.name: row.id for row in team.scene().rows}
    request = parse_request(f'{{"kind":"send","id":{ids["Anna"]},"to":{ids["Finn"]},"by":"Ben"}}')
    assert request == Send(ids["Anna"], ids["Finn"], "Ben")
    message = team.operation.act(request, team.unix_s, team.now_s)
    assert isinstance(message, tuple)
    team.put_bytes(*message)
    board = MarkBoard()
    board.receive(*message)
    (errand,) = board.errands.values()
    assert (errand.to, errand.x_m, errand.y_m, errand.level, errand.by) == ("Finn", 7.0, 2.0, 2, "Ben")
    rescuers = team.operation.distress(ids["Finn"], team.now_s)
    assert rescuers is not None
    assert [(r.name, r.sent) for r in rescuers.rescuers] == [("Anna", "sent by Ben")]
    team.pass_time(1.0)
    assert "sent to Finn by Ben" in next(row for row in team.scene().rows if row.name == "Anna").notes
    for number, to in ((ids["Anna"], ids["Kim"]), (99, ids["Finn"]), (ids["Anna"], 99)):
        refusal = team.operation.act(Send(number, to, "Ben"), team.unix_s, team.now_s)
        assert refusal == "Not sent: the place of the one in distress is not known on this plan."
