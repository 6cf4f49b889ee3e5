# SPDX-License-Identifier: MIT
"""Restarts, crashes and the supply voltage in words; boards of older and newer firmware with this host."""

from __future__ import annotations

import pytest

from board_runs import Bench, needs_twin
from echostep.board import messages as m
from echostep.board.frames import encode
from echostep.board.reports import SUBSCRIBE, BoardReports
from echostep_app.board.faults.health import board_findings
from echostep_app.board.subscription import BoardSubscription
from echostep_app.commissioning.diagnosis import Diagnosis, judge_board
from echostep_app.commissioning.probe import ProbeResult

IDENTITY = m.Identity(0, m.SCHEMA_HASH, 1, 2, 0, m.ResetCause.POWER_ON)
HEALTH = m.BoardHealth(0, 5_000, 4_980, 1, 0, m.CrashPlace.NONE, 0, 0)


def texts(*heard: m.Message) -> list[str]:
    reports = BoardReports()
    for message in heard:
        reports.add(message)
    return [str(finding) for finding in board_findings(reports)]


def test_a_board_that_is_well_is_no_finding() -> None:
    assert texts(IDENTITY, HEALTH) == []
    assert texts(IDENTITY, HEALTH._replace(supply_mv=0, supply_least_mv=0)) == []  # not measured yet


def test_a_crash_says_where_it_was() -> None:
    crashed = HEALTH._replace(starts=3, crashes=2, crash_place=m.CrashPlace.GYROS, crash_address=0x1380)
    for cause in (m.ResetCause.WATCHDOG, m.ResetCause.EXTERNAL):  # the button does not hide it
        (text,) = texts(IDENTITY._replace(reset_cause=cause), crashed)
        assert "2 times since it got power, last in gyros, address 0x2700" in text
    (text,) = texts(IDENTITY._replace(reset_cause=m.ResetCause.WATCHDOG))  # older firmware
    assert text.startswith("board: was restarted by its watchdog; ")


@pytest.mark.parametrize(("least_mv", "words"), [(4_700, ""), (4_500, "sagged to 4.50 V"), (4_000, "needs 4.5 V")])
def test_a_supply_that_sags(least_mv: int, words: str) -> None:
    found = texts(IDENTITY, HEALTH, HEALTH._replace(supply_least_mv=least_mv))
    assert [words in text for text in found] == ([True] if words else [])


def test_a_board_is_asked_once_and_again_after_a_restart() -> None:
    subscription = BoardSubscription()
    streamed: list[m.Message] = [
        IDENTITY,
        HEALTH,
        m.Gyros(0, 0, 0, 0),
        IDENTITY,
        HEALTH,
        IDENTITY,
        IDENTITY,
        HEALTH,
        IDENTITY,
    ]
    assert [subscription.is_due(x) for x in streamed] == [k in {0, 6} for k in range(len(streamed))]


def test_older_firmware_is_not_asked_and_the_doctor_says_what_to_do() -> None:
    old = IDENTITY._replace(version_minor=1)
    assert not BoardSubscription().is_due(old)
    reports = BoardReports()
    reports.add(old)
    report = Diagnosis()
    judge_board(report, ProbeResult(reports=reports), "/dev/x")
    assert any("older than 1.2" in f.what and "flash --port /dev/x" in f.remedy for f in report.findings)


@needs_twin
def test_a_host_that_follows_the_rule_keeps_its_subscription_over_a_crash() -> None:
    bench, subscription = Bench(), BoardSubscription()
    try:
        for ms in range(0, 5_000, 50):
            if ms == 2_000:
                bench.fault("reset=watchdog")
            for message in bench.run(50):
                if subscription.is_due(message):
                    bench.board.send(encode(SUBSCRIBE, 0))
    finally:
        bench.board.close()
    health = [x for x in bench.messages if isinstance(x, m.BoardHealth)]
    assert [x.crashes for x in health][:1] == [0]
    assert health[-1].crashes == 1
    assert bench.status.bad_frames == 0
