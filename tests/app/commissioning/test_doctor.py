# SPDX-License-Identifier: MIT
"""`echostep doctor` and `bench-report`: against boards on pseudo terminals, ports that are none, what the system says of ports."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from board_runs import Bench, needs_twin, quiet_rows
from command_line import echostep
from echostep.board import messages as m
from echostep.board.frames import encode
from echostep.ports.chunks import BOARD, Chunk
from echostep_app.board.faults.health import Severity
from echostep_app.commissioning import serial_ports as ports
from echostep_app.commissioning.bench_report import text
from echostep_app.commissioning.diagnosis import Diagnosis, judge_board, judge_mtx, loop_diagnosis
from echostep_app.commissioning.doctor import examine
from echostep_app.commissioning.probe import ProbeResult, _Probe, drift_of, probe
from echostep_app.commissioning.serial_ports import PortSeen, Role
from echostep_app.ports.access import TAKERS, refusal, taker_of
from players import babbling_port, pseudo_terminal, python_board, some_noise, twin_board
from snapshots import expect


@pytest.mark.long
def test_a_board_that_is_well_gets_status_0() -> None:
    with python_board() as port:
        done = echostep("doctor", "--board", port, "--seconds", 4)
    assert "Traceback" not in done.stderr
    assert done.returncode == 0, done.stdout
    assert "Everything is fine." in done.stdout
    assert "firmware 0.0.0, schema" in done.stdout
    assert "barometer: answers" in done.stdout
    rates = dict(re.findall(r"(\w+) ([\d.]+)/s", done.stdout))
    assert float(rates["gyros"]) == pytest.approx(200.0, rel=0.02)
    assert "ppm" in done.stdout


@needs_twin
def test_the_real_firmware_is_well() -> None:
    with twin_board() as port:
        report = examine(port, None, 3.0)
    said = [str(finding) for finding in report.findings if finding.severity > Severity.NOTE]
    assert not [text for text in said if "clock" not in text and "gives" not in text], said  # quiet rows have no noise
    assert any("self-test passed" in line for line in report.lines)
    assert any(line.startswith("supply    5.") and "1 start since it got power" in line for line in report.lines)


@needs_twin
@pytest.mark.parametrize("heard_ms", [300, 600, 1000, 1700, 2500])
def test_a_board_that_has_just_started_is_not_called_faulty(heard_ms: int) -> None:
    """From its power-up on, however little of it was heard."""
    bench = Bench()
    ports = SimpleNamespace(notices=[], send=lambda _, sent: bench.board.send(sent))
    running = _Probe(ports, {BOARD: "x"}, check_gyros=True)  # type: ignore[arg-type]
    try:
        for begin_ms in range(0, heard_ms, 50):
            running._query_board(begin_ms * 1e-3)
            rows = quiet_rows(50)
            some_noise(rows, begin_ms)
            for t_ns, part in bench.board.advance(rows):
                running._receive(Chunk(BOARD, t_ns, part))
    finally:
        bench.board.close()
    report = Diagnosis()
    judge_board(report, running.result, "x")
    # Compares the simulated with this computer's
    clock = [finding for finding in report.findings if "clock" in finding.what]
    assert [str(f) for f in report.findings if f.severity > Severity.NOTE and f not in clock] == []


def test_a_board_that_starts_late_is_heard_for_three_seconds(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its first message comes in the last moment of the listening."""
    now_s = 0.0
    first = encode(m.Identity(0, m.SCHEMA_HASH, 1, 1, 0, 0), 0)

    def chunks() -> Iterator[Chunk | None]:
        nonlocal now_s
        while now_s < 60.0:
            now_s += 0.1
            yield Chunk(BOARD, int(now_s * 1e9), first) if now_s > 3.9 else None

    monkeypatch.setattr("echostep_app.commissioning.probe.clock_s", lambda: now_s)
    ports = SimpleNamespace(notices=[], send=lambda *_: None, chunks=chunks)
    running = _Probe(ports, {BOARD: "x"}, check_gyros=True)  # type: ignore[arg-type]
    running.run(4.0)
    assert 6.8 < now_s < 7.2


def faults_of(report: Diagnosis) -> list[str]:
    """What is more than a note about this computer, by its severity."""
    return [f"{f.severity.name} {f}" for f in report.findings if f.severity > Severity.NOTE and f.subject != "udev"]


def test_a_port_that_is_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").touch()
    places = {"no such port": "/dev/no-such-port", "a file": tmp_path / "file", "no such kind of port": "nonsense://x"}
    said = {case: faults_of(examine(str(port), None, 0.1)) for case, port in places.items()}
    seen = {
        "nothing is plugged in": [],
        "a board in its bootloader": [PortSeen("/dev/ttyACM9", Role.BOOTLOADER, "Arduino Leonardo")],
        "two boards": [PortSeen(f"/dev/none{k}", Role.BOARD, "sensor board", f"00{k}D") for k in range(2)],
    }
    for case, ports_seen in seen.items():
        monkeypatch.setattr("echostep_app.commissioning.doctor.list_seen", lambda seen=ports_seen: seen)
        report = examine(None, None, 0.1)
        said[case] = [*report.lines, *(str(finding) for finding in report.findings if finding.subject == "board")]
        assert not report.fine
    expect("doctor", said, FOLDER=tmp_path)
    monkeypatch.setattr(os, "access", lambda *_: False)
    with pseudo_terminal() as (_, port):
        (finding,) = ports.access_findings("board", port)
        owner = f"{Path(port).owner()}:{Path(port).group()}"
        refused = {"no right to open it": re.sub(r"-aG \w+", "-aG GROUP", str(finding))}
        expect("doctor", refused, PORT=port, OWNER=owner)


@pytest.mark.slow
def test_a_port_of_something_else() -> None:
    sent = {
        "silent": b"",
        "other words": b"hello world\r\n" * 20,
        "other firmware": encode(m.Identity(0, 0x12345678, 1, 0, 0, 0), 0),
    }
    for case, words in sent.items():
        with babbling_port(b"\0" + words if words else b"") as port:
            said = faults_of(examine(port, None, 0.5))
        expect(
            "doctor",
            {case: [re.sub(r"\d+ bytes", "N bytes", line) for line in said]},
            PORT=port,
            HASH=f"0x{m.SCHEMA_HASH:08X}",
        )
    with pseudo_terminal() as (_, port):
        said = [text for text in faults_of(examine(None, port, 2.5)) if "MTx" in text]
        expect("doctor", {"silent MTx": said}, PORT=port)


def test_an_mtx_that_answers_but_measures_nothing() -> None:
    """What was said while it was set up is no fault."""
    for arrived_s in ([], [1.0, 1.01]):
        probed = ProbeResult(seconds=6.0, mtx_messages=["MTx: configured: 100 Hz"], mtx_times_s=arrived_s)
        probed.bytes_of["mtx"] = 400
        report = Diagnosis()
        judge_mtx(report, probed, with_board=False)
        expect("doctor", {f"MTx with {len(arrived_s)} samples": faults_of(report)})


def test_a_main_loop_that_is_too_slow_is_named() -> None:
    for turn, latency in ((5_600, 20), (10_400, 20), (5_600, 300)):
        report, probed = Diagnosis(), ProbeResult()
        probed.reports.add(m.Loop(0, turn, latency, 15_700))
        loop_diagnosis(report, probed, "board")
        expect("doctor", {f"loop of {turn} ticks, {latency} of latency": [*report.lines, *faults_of(report)]})


def test_the_latency_of_the_adapter(tmp_path: Path) -> None:
    timer = tmp_path / "bus/usb-serial/devices/ttyUSB7/latency_timer"
    timer.parent.mkdir(parents=True)
    timer.write_text("16\n")
    (finding,) = ports.latency_findings("MTx", "/dev/ttyUSB7", tmp_path)
    assert "16 ms" in finding.what
    timer.write_text("1\n")
    assert ports.latency_findings("MTx", "/dev/ttyUSB7", tmp_path) == []
    timer.write_text("x")
    assert ports.latency_findings("MTx", "/dev/ttyUSB7", tmp_path) == []


def test_the_udev_rules_are_printed_and_recognised(tmp_path: Path) -> None:
    done = echostep("doctor", "--udev")
    assert done.returncode == 0
    for part in (
        'SYMLINK+="echostep-$attr{serial}"',
        'ENV{ECHOSTEP}="echostep-foot"',
        'SYMLINK+="$env{ECHOSTEP}"',
        'SYMLINK+="echostep-mtx"',
        'ATTR{latency_timer}="1"',
    ):
        assert part in done.stdout
    assert len(ports.rules_findings((tmp_path,))) == 1
    (tmp_path / ports.RULES).write_text(done.stdout)
    assert ports.rules_findings((tmp_path,)) == []
    (tmp_path / ports.RULES).write_text("# old")
    assert "is of another version" in str(ports.rules_findings((tmp_path,))[0])


def test_roles_by_usb_identifiers() -> None:
    assert ports._role(0x1209, 1, "echostep", "sensor board") is ports._role(0x1209, 1, None, None) is Role.BOARD
    assert ports._role(0x1209, 0xEC05, "echostep", "sensor board") is Role.BOARD  # with an identifier of its own
    assert ports._role(0x1209, 1, "other", "a camera") is Role.OTHER
    assert ports._role(0x2341, 0x0036, None, None) is Role.BOOTLOADER
    assert ports._role(0x0403, 0xD388, None, None) is Role.MTX
    assert ports._role(0x1A86, 0x7523, None, None) is Role.OTHER


def answers_of(ppm: float, late_s: Callable[[int], float]) -> ProbeResult:
    """Sixty answers in 12 s of a board whose clock is fast by `ppm`, read half a millisecond after the query."""
    heard = ProbeResult()
    for k in range(60):
        sent_s = 0.2 * k
        heard.replies.append((sent_s, sent_s + late_s(k), round((sent_s + 0.0005) * (1 + 1e-6 * ppm) * 2e6)))
    return heard


@pytest.mark.parametrize("ppm", [-300.0, 0.0, 40.0, 5000.0])
def test_the_limits_of_the_drift_hold_through_slow_answers(ppm: float) -> None:
    """Of a busy computer, later and later, they are no evidence against the clock."""
    drift = drift_of(answers_of(ppm, lambda k: 0.001 + (0.03 if k % 5 == 0 else 0.0001 * (k % 3))))
    busy = drift_of(answers_of(ppm, lambda k: 0.001 + 0.0001 * k))
    assert drift
    assert busy
    assert drift.low_ppm <= ppm <= drift.high_ppm
    assert drift.high_ppm - drift.low_ppm < 200.0
    assert busy.low_ppm <= ppm <= busy.high_ppm
    assert ppm or busy.least_ppm == 0.0


def test_a_clock_that_was_set_has_no_drift() -> None:
    heard = answers_of(0.0, lambda _: 0.001)
    heard.replies[30:] = [(sent_s, arrived_s, ticks + 2_000_000) for sent_s, arrived_s, ticks in heard.replies[30:]]
    assert drift_of(heard) is None


@pytest.mark.long
@needs_twin
def test_the_parts_of_2026_are_named_and_so_is_the_one_that_fails() -> None:
    with twin_board("kit=2026", "imu_calf=no_self_test") as port:
        done = echostep("doctor", "--board", port, "--seconds", 8)
    assert done.returncode == 1, done.stdout
    for words in (
        "left ranger: answers, pulse ranger",
        "compass: answers, LIS3MDL, identity 0x3D",
        "thigh gyro: answers, 20 degC, self-test passed, LSM6DSO, identity 0x6C",
        "barometer: answers, BMP390, identity 0x60",
        "calf gyro (LSM6DSO): failed its self-test",
        "magnetic ",
    ):
        assert words in done.stdout, (words, done.stdout)
    assert "without noise" not in done.stdout  # at rest its noise is less than a count


@pytest.mark.parametrize("taker", ["minicom", *TAKERS])
def test_a_program_that_holds_the_port_is_named_with_the_next_step(tmp_path: Path, taker: str) -> None:
    (tmp_path / "77/fd").mkdir(parents=True)
    (tmp_path / "77/comm").write_text(f"{taker}\n")
    (tmp_path / "port").touch()
    (tmp_path / "77/fd/3").symlink_to(tmp_path / "port")
    found = [*ports.holder_findings("board", str(tmp_path / "port"), tmp_path), refusal("/dev/ttyUSB9", tmp_path)]
    expect("doctor", {f"{taker} has the port": found}, FOLDER=tmp_path)
    assert taker_of(processes=tmp_path) == TAKERS.get(taker, "")


def test_a_gyro_that_varies_at_rest_is_named() -> None:
    """One wrong byte in a thousand gave an sd of 89 counts, and no finding."""
    rng = np.random.default_rng(7)
    counts = rng.normal(0.0, 0.5, (400, 3)).round().astype(int)
    counts[::50, 2] += 700
    probed = ProbeResult(gyros=[m.Gyros(0, *map(int, row)) for row in counts])
    said = [line for line in text(Diagnosis(probed={"board": probed})) if "WARNING" in line]
    assert len(said) == 1
    assert "board: belt: the rates vary by more than 4 counts at rest" in said[0]


@pytest.mark.long
@needs_twin
@pytest.mark.process
def test_the_report_of_a_board(tmp_path: Path) -> None:
    out = tmp_path / "report.txt"
    with twin_board("kit=2026") as port:
        done = echostep("bench-report", "--board", port, "--seconds", 4, "--out", out, "--schedule", "simultaneous")
        after = probe({"board": port}, 3.0).reports.configuration
    assert done.returncode == 0, done.stderr
    assert after is not None
    assert after.schedule == m.Schedule.CONCURRENT  # as it was
    found = out.read_text()
    for words in (
        "schedule 2, ",
        "levels    MISO low, D4 high ",
        "Identity: ticks ",
        "Parts: ticks ",
        "Electrical: ticks ",
        "left: ",
        "median 1.001 m (5831 us)",
        "thigh: ",
        "15. Temperature of an ADIS16100: ",
    ):
        assert words in found, (words, found)
    assert str(out) in done.stdout
