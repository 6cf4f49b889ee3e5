# SPDX-License-Identifier: MIT
"""The diagnosis of a board and an MTx from a few seconds of their bytes: lines of facts, and findings.

In: `ProbeResult`. Out: a `Diagnosis`. Owns nothing; `board.health` interprets the board's own reports.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from echostep.board.messages import GYROS_INVALID, SCHEMA_HASH, Gyro, Healthy, Identity, Outcome, Part, Ranger, SelfTest
from echostep.board.reports import BoardReports
from echostep.ports.chunks import BOARD, MTX
from echostep.timing.timeline import TICK_S, MtxTiming
from echostep_app.board.faults.electrical import electrical_findings, level_line
from echostep_app.board.faults.findings import part_in, part_text_of
from echostep_app.board.faults.health import (
    NAMES,
    SELECTS,
    Finding,
    Severity,
    board_findings,
    crash_text,
    expected_rates,
    gyro_celsius,
    rate_findings,
)
from echostep_app.board.subscription import knows_subscriptions
from echostep_app.commissioning.probe import Drift, ProbeResult, drift_of
from echostep_app.xsens.setup import force_range_g

DRIFT_MAX_PPM = 200.0  # a crystal is within 50, a ceramic resonator within 5000
ANSWER_MAX_S = 0.02
MTX_RATE_ERROR = 0.02  # relative
CONSTANT_SAMPLES = 400  # this many equal samples in a row are a fault: a gyro has two counts of noise
FULL_SCALE = 2047  # counts of an ADIS16100
SIX_AXES_FULL_SCALE = 4697  # counts of `gyros` at the 1000 deg/s of an LSM6DSO, less its last 0.1 %
HURRIED_G = 18.0  # range of the MTx that is beyond a hurried foot's force [echostep evaluate kits]
FIRST_LEVELS = (1, 6)  # version of the firmware that reports levels
TURN_MAX_MS = 5.0  # a sample of the gyros
LATENCY_MAX_US = 100.0  # of an interrupt: a SyncOut pulse lasts 1 ms; assumed
LEAST_PINGS = 20  # for a statement on echoes


@dataclass(slots=True)
class Diagnosis:
    """Facts, line by line, and findings."""

    lines: list[str] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)
    electrical: bool = False  # also the levels of the boards' inputs
    probed: dict[str, ProbeResult] = field(default_factory=dict)  # what was received, by the board's subject

    @property
    def fine(self) -> bool:
        """Whether all findings are notes."""
        return all(finding.severity is Severity.NOTE for finding in self.findings)

    def add(self, severity: Severity, subject: str, what: str, remedy: str) -> None:
        """Add a finding."""
        self.findings.append(Finding(severity, subject, what, remedy))


def judge_board(report: Diagnosis, probed: ProbeResult, port: str) -> None:
    """Add facts and findings on the board at this port."""
    identity = identify(report, probed, port, "board")
    if identity is None:
        return
    report.lines += _device_lines(probed) + _rate_lines(probed)
    electrical_diagnosis(report, probed, "board")
    loop_diagnosis(report, probed, "board")
    report.findings += board_findings(probed.reports)
    _judge_streams(report, probed)
    if not knows_subscriptions(identity):
        what = "its firmware is older than 1.2: it reports neither its supply voltage nor its crashes"
        report.add(Severity.NOTE, "board", what, f"flash it: echostep flash --port {port}")
    if probed.rates_hz:
        report.findings += rate_findings(probed.reports, probed.rates_hz)
    else:
        report.add(Severity.NOTE, "board", "has just started: its rates are not known yet", "run echostep doctor again")
    clock_diagnosis(report, probed, "board")


def identify(report: Diagnosis, probed: ProbeResult, port: str, subject: str) -> Identity | None:
    """Add firmware and supply of a board; None, with a finding, when its firmware does not fit or it has not answered."""
    report.probed[subject] = probed
    i = probed.reports.identity
    if probed.stale_firmware:
        what, _, _ = probed.stale_firmware.partition(";")
        report.add(Severity.FAULT, subject, what, f"flash it: echostep flash --port {port}")
        return None
    if i is None:
        _judge_silence(report, probed, port, subject)
        return None
    version = f"firmware {i.version_major}.{i.version_minor}.{i.version_patch}, schema 0x{SCHEMA_HASH:08X} as this host"
    report.lines += [f"{subject:10}{' ' * (len(subject) > 9)}{port}: {version}", *_supply_lines(probed.reports)]
    return i


def clock_diagnosis(report: Diagnosis, probed: ProbeResult, subject: str) -> None:
    """Add facts and findings on a board's clock."""
    drift = drift_of(probed)
    if drift is None and probed.replies:
        report.lines.append("clock     too few answers for its rate")
    elif drift is None:
        remedy = "it receives nothing: unplug it and plug it in again"
        report.add(Severity.FAULT, subject, "answers no clock queries", remedy)
    else:
        off = f"the board's is {drift.low_ppm:+.0f} to {drift.high_ppm:+.0f} ppm off this computer's"
        report.lines.append(f"clock     {off}; it answers in {1e3 * drift.answer_s:.1f} ms")
        _judge_clock(report, drift, subject)


def electrical_diagnosis(report: Diagnosis, probed: ProbeResult, subject: str) -> None:
    """Add the levels of a board's inputs, and findings by them, if they are wanted."""
    if not report.electrical:
        return
    if line := level_line(probed.reports):
        report.lines.append(line)
        report.findings += electrical_findings(probed.reports)
        return
    what = f"reports no levels: its firmware is older than {'.'.join(map(str, FIRST_LEVELS))}"
    report.add(Severity.WARNING, subject, what, "flash it: echostep flash")


def loop_diagnosis(report: Diagnosis, probed: ProbeResult, subject: str) -> None:
    """Add the timing of a board's main loop, and a finding where it is too slow."""
    loop = probed.reports.loop
    if loop is None:
        return
    turn_ms, latency_us = 1e3 * TICK_S * loop.longest_turn, 1e6 * TICK_S * loop.longest_latency
    cycle = f"; rangers measure for {4e-3 * loop.ranging_cycle:.1f} ms" if loop.ranging_cycle else ""
    report.lines.append(f"loop      longest turn {turn_ms:.1f} ms, interrupts within {latency_us:.0f} us{cycle}")
    if turn_ms > TURN_MAX_MS or latency_us > LATENCY_MAX_US:
        what = (
            f"is too slow: a turn of its main loop takes {turn_ms:.1f} ms, an interrupt waits for {latency_us:.0f} us"
        )
        report.add(Severity.WARNING, subject, what, "send this line in, with the parts plugged in")


def _supply_lines(reports: BoardReports) -> list[str]:
    health = reports.board_health
    if health is None:
        return []
    starts = f"{health.starts} start{'s' if health.starts != 1 else ''} since it got power"
    crashes = f", crashes: {crash_text(health)}" if health.crashes else ""
    voltage = f"{1e-3 * health.supply_mv:.2f} V (within 9 %), least {1e-3 * health.supply_least_mv:.2f} V"
    return [f"supply    {voltage}; {starts}{crashes}"]


def _judge_silence(report: Diagnosis, probed: ProbeResult, port: str, subject: str) -> None:
    """Add a finding on a board that has not answered the request for its identity."""
    what = f"{port} is silent"
    remedy = "check that this is the board's port; unplug it and plug it in again, or flash it: echostep flash"
    if probed.bytes_of[BOARD]:
        what = f"{probed.bytes_of[BOARD]} bytes came from {port}, but no valid frame of the board"
        remedy = "name the board's port with --board, or flash it: echostep flash"
    report.add(Severity.FAULT, subject, what, remedy)


def _device_lines(probed: ProbeResult) -> list[str]:
    status, sensors = probed.reports.status, probed.reports.sensors
    if status is None:
        return ["devices   no status was received"]
    lines: list[str] = []
    for device in Healthy:
        state = "off" if not sensors & device else "answers" if status.healthy & device else "FAILS"
        gyro_health = probed.reports.gyros.get(Gyro[device.name or ""]) if device in SELECTS else None
        if gyro_health is not None and state == "answers":
            state += f", {gyro_celsius(gyro_health):.0f} degC, self-test {SelfTest(gyro_health.self_test).name.lower().replace('_', ' ')}"
        part = part_text_of(probed.reports, device)
        lines.append(f"{'devices' if not lines else '':10}{NAMES[device]}: {state}{f', {part}' if part else ''}")
    return lines


def _rate_lines(probed: ProbeResult) -> list[str]:
    rates = probed.rates_hz
    wanted = expected_rates(probed.reports) | ({"Sync": 100.0} if rates.get("Sync") else {})
    parts = [f"{name.lower()} {rates.get(name, 0.0):.1f}/s" for name in wanted]
    return [f"rates     {', '.join(parts)}", f"frames    {probed.lost} lost, {probed.rejected} damaged"]


def _judge_streams(report: Diagnosis, probed: ProbeResult) -> None:
    if probed.lost or probed.rejected > 1:  # opening the port may cut one frame
        what = f"{probed.lost} frames were lost and {probed.rejected} damaged on the way"
        report.add(Severity.WARNING, "board", what, "a bad cable or hub, or another program reads the port")
    _judge_gyros(report, probed)
    report.findings += _echo_findings(probed)


def _judge_gyros(report: Diagnosis, probed: ProbeResult) -> None:
    for device in SELECTS:
        rates = [v for g in probed.gyros if (v := getattr(g, (device.name or "").lower())) != GYROS_INVALID]
        last = rates[-CONSTANT_SAMPLES:]
        six_axes = part_in(probed.reports, device) is Part.LSM6DSO
        full_scale, scale = (SIX_AXES_FULL_SCALE, "1000") if six_axes else (FULL_SCALE, "300")
        is_constant = len(last) == CONSTANT_SAMPLES and len(set(last)) == 1
        if is_constant and not six_axes:  # at rest the noise of an LSM6DSO is a fifth of a count of `gyros`
            what = f"gives a constant {last[0]} counts, without noise"
            report.add(Severity.WARNING, NAMES[device], what, "it may be stuck: power-cycle the board")
        elif last and sum(abs(v) >= full_scale for v in last) > len(last) // 2:
            what = f"is at full scale, {scale} degrees/s"
            report.add(Severity.FAULT, NAMES[device], what, "if nothing turns: replace it")


def _echo_findings(probed: ProbeResult) -> list[Finding]:
    findings = []
    for ranger, device in ((Ranger.LEFT, Healthy.RANGER_LEFT), (Ranger.RIGHT, Healthy.RANGER_RIGHT)):
        outcomes = [p.outcome for p in probed.pings if p.ranger == ranger]
        if len(outcomes) > LEAST_PINGS and all(outcome == Outcome.NO_ECHO for outcome in outcomes):
            what = f"receives no echo in {len(outcomes)} pings"
            remedy = "normal without walls within 6 m; else check whether something covers it"
            findings.append(Finding(Severity.NOTE, NAMES[device], what, remedy))
    return findings


def _judge_clock(report: Diagnosis, drift: Drift, subject: str) -> None:
    if drift.least_ppm > DRIFT_MAX_PPM:
        what = f"its clock is off by at least {drift.least_ppm:.0f} ppm"
        remedy = "times stay consistent, speeds are wrong by the same factor; use a board with a 16 MHz crystal"
        report.add(Severity.WARNING, subject, what, remedy)
    if drift.answer_s > ANSWER_MAX_S:
        what = f"it answers only after {1e3 * drift.answer_s:.0f} ms"
        report.add(Severity.WARNING, subject, what, "this computer is busy, or a USB hub is in between")


def _mtx_fault(probed: ProbeResult) -> str:
    """Why there is no rate of samples. Messages of its setup are a fault only if no byte came."""
    if probed.mtx_fault or not probed.bytes_of[MTX]:
        return probed.mtx_fault or (probed.mtx_messages or ["nothing was received"])[-1]
    count = len(probed.mtx_times_s)
    few = f"only {count} sample{'s were' if count > 1 else ' was'}" if count else "no sample was"
    return f"{few} received, though it answers: is it in measurement mode? unplug it and plug it in again"


def judge_mtx(report: Diagnosis, probed: ProbeResult, *, with_board: bool) -> None:
    """Add facts and findings on the MTx; `with_board`: a board that times its SyncOut was probed too."""
    for message in probed.mtx_messages:
        report.lines.append(f"MTx       {message.removeprefix('MTx: ')}")
    rate_hz, wanted_hz = probed.mtx_hz, MtxTiming().rate_hz
    if probed.mtx_fault or not probed.bytes_of[MTX] or math.isnan(rate_hz):
        what, _, remedy = _mtx_fault(probed).removeprefix("MTx: ").partition(": ")
        report.add(Severity.FAULT, "MTx", what, remedy or "check its supply, its cable and the port")
        return
    report.lines.append(f"MTx       {rate_hz:.1f} samples/s")
    if abs(rate_hz / wanted_hz - 1.0) > MTX_RATE_ERROR:
        what = f"{rate_hz:.1f} samples/s, expected are {wanted_hz:g}"
        report.add(Severity.WARNING, "MTx", what, "samples are lost: check its cable")
    force_g = force_range_g(probed.mtx_product)
    if force_g is not None and force_g < HURRIED_G:
        what = f"{probed.mtx_product} measures up to {force_g:g} g; hurried feet exceed that"
        report.add(Severity.NOTE, "MTx", what, "walk calmly, or wear an MTx of 18 g or a foot board")
    if with_board and not probed.ticks.get("Sync"):
        what = "no SyncOut pulse reaches the board: its samples are timed by their arrival, to a millisecond"
        report.add(Severity.NOTE, "MTx", what, "wire its SyncOut to D4 through the buffer (firmware/README.md)")
