# SPDX-License-Identifier: MIT
"""The board's reports in plain words: what a host that listens may conclude, restarts, crashes, the supply; older and newer firmware."""

from __future__ import annotations

from contextlib import closing

import pytest
from hypothesis import given
from hypothesis import strategies as st

from board_runs import Bench, needs_twin
from echostep.board import messages as m
from echostep.board.frames import encode
from echostep.board.reports import SUBSCRIBE, BoardReports
from echostep.ports.chunks import BOARD, Chunk
from echostep.tracker import Tracker
from echostep_app.board.faults.health import Severity, board_findings, expected_rates, rate_findings
from echostep_app.board.subscription import BoardSubscription
from echostep_app.commissioning.diagnosis import Diagnosis, judge_board
from echostep_app.commissioning.probe import ProbeResult
from echostep_app.output.terminal import findings
from walks import PLAN

CONFIGURATION = m.Configuration(0, 0xFF, m.Schedule.CONCURRENT, 200, 10, m.PressureMode.HIGH_SPEED)


def status(**changed: int) -> m.Status:
    return m.Status(**dict.fromkeys(m.Status._fields, 0) | {"healthy": 0x7F} | changed)


def words(*said: m.Message) -> BoardReports:
    heard = BoardReports()
    for message in (CONFIGURATION, *said):
        heard.add(message)
    return heard


def texts(heard: BoardReports) -> list[str]:
    return [str(finding) for finding in board_findings(heard)]


def test_a_healthy_board_is_no_finding() -> None:
    fine = [m.GyroHealth(0, gyro, -34, m.SelfTest.PASSED, -221, 221) for gyro in m.Gyro]
    assert texts(words(m.Identity(0, 0, 1, 1, 0, m.ResetCause.POWER_ON), status(), *fine)) == []
    assert texts(BoardReports()) == []


def test_a_device_that_is_switched_off_is_no_finding() -> None:
    heard = words(status(healthy=0x3F, errors_pressure=4, fault_pressure=m.Fault.EEPROM))
    heard.add(CONFIGURATION._replace(sensors=0x3F))
    assert texts(heard) == []


def test_one_cause_for_many_is_said_once() -> None:
    nobody = {"errors_ranger_left": 1, "errors_ranger_right": 1, "errors_compass": 1}
    nobody |= {"fault_ranger_left": 1, "fault_ranger_right": 1, "fault_compass": 1}
    (text,) = texts(words(status(healthy=0x78, **nobody)))
    assert text.startswith("I2C bus: no device answers")
    (text,) = texts(words(status(healthy=0x7F & ~0x38, errors_thigh=1, errors_calf=1, errors_belt=1,
                                 fault_thigh=1, fault_calf=1, fault_belt=1)))  # fmt: skip
    assert text.startswith("SPI bus: no device answers")


def test_a_bare_board_is_one_finding_without_parts_of_a_kit() -> None:
    """It was three faults, with the pull-ups and the level shifter of the papers."""
    mute = {f"{what}_{d.name.lower()}": 1 for d in m.Healthy if d.name for what in ("errors", "fault")}
    parts = m.Parts(**dict.fromkeys(m.Parts._fields, 0) | {"ticks": 9})
    (text,) = texts(words(status(healthy=0, **mute), parts))
    assert text.startswith("board: has found no part; normal before anything is wired")
    found = texts(words(status(healthy=0, **mute), parts._replace(part_pressure=m.Part.BMP390)))
    assert not [text for text in found if "level shifter" in text or "both pull-ups" in text]


def test_old_failures_are_forgotten_and_new_ones_are_not() -> None:
    old = {"errors_compass": 9, "fault_compass": m.Fault.NO_ANSWER, "bus_recoveries": 3, "dropped_ping": 65_530}
    heard = words(status(**old), status(**old | {"ticks": 2_000_000}))
    assert texts(heard) == []
    heard.add(status(**old | {"ticks": 4_000_000, "errors_compass": 12, "dropped_ping": 4}))
    assert [text.split(";")[0] for text in texts(heard)] == [
        "compass: failed 3 times in the last 1 s (no answer), and answers again",
        "board: dropped 10 messages in the last 1 s",
    ]
    heard.add(status(ticks=5))  # it has restarted
    assert texts(heard) == []


@pytest.mark.parametrize(
    ("said", "part", "severity"),
    [
        (m.GyroHealth(0, 1, 0, m.SelfTest.FAILED, -20, 20), "calf gyro: failed its self-test (responses -20 and 20", 2),
        (m.GyroHealth(0, 1, 0, m.SelfTest.MOVED, -221, 0), "calf gyro: turned", 0),
        (m.GyroHealth(0, 1, 0, m.SelfTest.NOT_RUN, -32768, -32768), "calf gyro: was not tested", 0),
        (m.GyroHealth(0, 1, -32768, m.SelfTest.PASSED, -221, 221), "calf gyro: answers, but not with its temp", 2),
        (m.GyroHealth(0, 1, 600, m.SelfTest.PASSED, -221, 221), "calf gyro: reports 112 degrees", 1),
    ],
)
def test_what_a_gyro_says_of_itself(said: m.GyroHealth, part: str, severity: int) -> None:
    (finding,) = board_findings(words(status(), said))
    assert part in str(finding)
    assert finding.severity == severity
    absent = status(healthy=0x7F & ~0x10, errors_calf=7, fault_calf=m.Fault.NO_ANSWER)
    assert [f.what for f in board_findings(words(absent, said))] == ["does not answer"]  # nothing is said twice


def test_self_test_inputs_that_are_not_wired_are_said_once() -> None:
    tests = [m.GyroHealth(0, gyro, 0, m.SelfTest.FAILED, 1, -2) for gyro in m.Gyro]
    (finding,) = board_findings(words(status(), *tests))
    assert "none of them responds" in finding.what
    assert "A0 to ST1" in finding.remedy
    assert finding.severity is Severity.WARNING
    passed = m.GyroHealth(0, m.Gyro.BELT, 0, m.SelfTest.PASSED, -200, 200)
    assert [f.subject for f in board_findings(words(status(), *tests, passed))] == ["thigh gyro", "calf gyro"]


def test_rates_below_what_is_configured_are_said() -> None:
    heard = words(status())
    rates = expected_rates(heard)
    assert rates == {"Ping": 28.0, "Gyros": 200.0, "Compass": 10.0, "Pressure": 9.0}
    assert rate_findings(heard, rates) == []
    slow, silent = rate_findings(heard, rates | {"Gyros": 150.0, "Compass": 0.0})
    assert (slow.severity, silent.severity) == (Severity.WARNING, Severity.FAULT)
    assert "150.0 samples/s, expected are 200.0" in str(slow)
    heard.add(status(healthy=0x7B, errors_compass=1, fault_compass=1))
    assert rate_findings(heard, rates | {"Compass": 0.0}) == []  # the status says why


def test_maxsonars_are_expected_to_ping_less_often() -> None:
    heard = words(status(), m.Parts(**dict.fromkeys(m.Parts._fields, 0) | {"part_ranger_right": m.Part.MAXSONAR}))
    assert expected_rates(heard)["Ping"] == 19.0
    assert rate_findings(heard, expected_rates(heard) | {"Ping": 20.0}) == []
    assert [f.severity for f in rate_findings(heard, expected_rates(heard) | {"Ping": 9.0})] == [Severity.FAULT]


def test_the_live_view_says_it_too() -> None:
    tracker = Tracker(PLAN)
    said: list[m.Message] = [CONFIGURATION, status(healthy=0x3F, errors_pressure=4, fault_pressure=m.Fault.EEPROM)]
    for k, message in enumerate(said):
        tracker.feed(Chunk(BOARD, k, encode(message, k)))
    shown = [str(finding) for finding in findings(tracker)]
    assert len(shown) == 1
    assert shown[0].startswith("barometer: EEPROM check failed")


u16 = st.integers(0, 65_535)


@given(st.lists(st.builds(m.Status, st.integers(0, 2**32 - 1), *[u16] * 15, *[st.integers(0, 9)] * 7, st.integers(0, 255), u16), max_size=3),
       st.integers(0, 255), st.integers(0, 255))  # fmt: skip
def test_any_words_have_a_meaning(said: list[m.Status], sensors: int, cause: int) -> None:
    heard = words(CONFIGURATION._replace(sensors=sensors), m.Identity(0, 0, 0, 0, 0, cause), *said)
    for finding in [*board_findings(heard), *rate_findings(heard, {})]:
        assert finding.what
        assert finding.remedy
        assert "\n" not in str(finding)


IDENTITY = m.Identity(0, m.SCHEMA_HASH, 1, 2, 0, m.ResetCause.POWER_ON)
HEALTH = m.BoardHealth(0, 5_000, 4_980, 1, 0, m.CrashPlace.NONE, 0, 0)


def test_a_board_that_is_well_is_no_finding() -> None:
    assert texts(words(IDENTITY, HEALTH)) == []
    assert texts(words(IDENTITY, HEALTH._replace(supply_mv=0, supply_least_mv=0))) == []  # not measured yet


def test_a_crash_says_where_it_was() -> None:
    crashed = HEALTH._replace(starts=3, crashes=2, crash_place=m.CrashPlace.GYROS, crash_address=0x1380)
    for cause in (m.ResetCause.WATCHDOG, m.ResetCause.EXTERNAL):  # the button does not hide it
        (text,) = texts(words(IDENTITY._replace(reset_cause=cause), crashed))
        assert "2 times since it got power, last in gyros, address 0x2700" in text
    (text,) = texts(words(IDENTITY._replace(reset_cause=m.ResetCause.WATCHDOG)))  # older firmware
    assert text.startswith("board: was restarted by its watchdog; ")


@pytest.mark.parametrize(("least_mv", "said"), [(4_700, ""), (4_500, "sagged to 4.50 V"), (4_000, "needs 4.5 V")])
def test_a_supply_that_sags(least_mv: int, said: str) -> None:
    found = texts(words(IDENTITY, HEALTH, HEALTH._replace(supply_least_mv=least_mv)))
    assert [said in text for text in found] == ([True] if said else [])


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
    with closing(bench.board):
        for ms in range(0, 5_000, 50):
            if ms == 2_000:
                bench.fault("reset=watchdog")
            for message in bench.run(50):
                if subscription.is_due(message):
                    bench.board.send(encode(SUBSCRIBE, 0))
    health = [x for x in bench.messages if isinstance(x, m.BoardHealth)]
    assert [x.crashes for x in health][:1] == [0]
    assert health[-1].crashes == 1
    assert bench.status.bad_frames == 0
