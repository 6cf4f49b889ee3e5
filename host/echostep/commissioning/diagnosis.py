"""What a few seconds of listening to the board and the MTx amount to: lines for people, and findings.

In: `ProbeResult`. Out: a `Diagnosis`. Owns nothing; the board's words about itself are read by `health`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from echostep.board.health import (
    NAMES,
    SELECTS,
    Finding,
    Severity,
    board_findings,
    expected_rates,
    gyro_celsius,
    rate_findings,
)
from echostep.board.messages import GYROS_INVALID, SCHEMA_HASH, Gyro, Healthy, Outcome, Ranger, SelfTest
from echostep.commissioning.probe import Drift, ProbeResult, drift_of
from echostep.ports.chunks import BOARD, MTX
from echostep.timing.timeline import MtxTiming

DRIFT_MAX_PPM = 200.0  # a crystal has 50; a ceramic resonator 5000, and then a recording's rates are off
ANSWER_MAX_S = 0.02
MTX_RATE_ERROR = 0.02
CONSTANT_SAMPLES = 400  # equal ones in a row: a real gyro has two counts of noise
FULL_SCALE = 2047


@dataclass(slots=True)
class Diagnosis:
    """What was looked at, line by line, and what is not as it should be."""

    lines: list[str] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)

    @property
    def fine(self) -> bool:
        """Whether there is nothing to do."""
        return all(finding.severity is Severity.NOTE for finding in self.findings)


def judge_board(report: Diagnosis, heard: ProbeResult, port: str) -> None:
    """Add what was heard of the board at this port."""
    words = heard.words
    if heard.stale:
        what, _, _ = heard.stale.partition(";")
        report.findings.append(Finding(Severity.FAULT, "board", what, f"flash it: echostep flash --port {port}"))
        return
    if words.identity is None:
        report.findings.append(_silent(heard, port))
        return
    i = words.identity
    report.lines.append(
        f"board     {port}: firmware {i.version_major}.{i.version_minor}.{i.version_patch}, schema 0x{SCHEMA_HASH:08X} as this host"
    )
    report.lines += _device_lines(heard) + _rate_lines(heard)
    report.findings += board_findings(words) + rate_findings(words, heard.rates_hz) + _stream_findings(heard)
    drift = drift_of(heard)
    if drift is None:
        what, remedy = "answers no clock queries", "it hears nothing: unplug it and plug it in again"
        report.findings.append(Finding(Severity.FAULT, "board", what, remedy))
    else:
        report.lines.append(f"clock     {describe(drift)}")
        report.findings += _clock_findings(drift)


def _silent(heard: ProbeResult, port: str) -> Finding:
    if not heard.bytes_of[BOARD]:
        what, remedy = (
            f"{port} is silent",
            "is this the board's port? unplug it and plug it in again, or flash it: echostep flash",
        )
    else:
        what = f"{heard.bytes_of[BOARD]} bytes came from {port}, but no frame of the board"
        remedy = "name the board's port with --board, or flash it: echostep flash"
    return Finding(Severity.FAULT, "board", what, remedy)


def _device_lines(heard: ProbeResult) -> list[str]:
    status, sensors = heard.words.status, heard.words.sensors
    if status is None:
        return ["devices   no status has come"]
    lines: list[str] = []
    for device in Healthy:
        state = "off" if not sensors & device else "answers" if status.healthy & device else "FAILS"
        said = heard.words.gyros.get(Gyro[device.name or ""]) if device in SELECTS else None
        if said is not None and state == "answers":
            state += (
                f", {gyro_celsius(said):.0f} degC, self-test {SelfTest(said.self_test).name.lower().replace('_', ' ')}"
            )
        lines.append(f"{'devices' if not lines else '':10}{NAMES[device]}: {state}")
    return lines


def _rate_lines(heard: ProbeResult) -> list[str]:
    rates = heard.rates_hz
    wanted = expected_rates(heard.words) | ({"Sync": 100.0} if rates.get("Sync") else {})
    parts = [f"{name.lower()} {rates.get(name, 0.0):.1f}/s" for name in wanted]
    return [f"rates     {', '.join(parts)}", f"frames    {heard.lost} lost, {heard.rejected} damaged"]


def _stream_findings(heard: ProbeResult) -> list[Finding]:
    found = []
    if heard.lost or heard.rejected > 1:  # one may have been cut when the port was opened
        what = f"{heard.lost} frames were lost and {heard.rejected} damaged on the way"
        found.append(Finding(Severity.WARNING, "board", what, "a bad cable or hub, or another program reads the port"))
    return found + _gyro_findings(heard) + _echo_findings(heard)


def _gyro_findings(heard: ProbeResult) -> list[Finding]:
    found = []
    for device in SELECTS:
        rates = [v for g in heard.gyros if (v := getattr(g, (device.name or "").lower())) != GYROS_INVALID]
        last = rates[-CONSTANT_SAMPLES:]
        if len(last) == CONSTANT_SAMPLES and len(set(last)) == 1:
            what = f"gives {last[0]} counts for seconds, without any noise"
            found.append(Finding(Severity.WARNING, NAMES[device], what, "it may be stuck: power-cycle the board"))
        elif last and sum(abs(v) >= FULL_SCALE for v in last) > len(last) // 2:
            what = "stands at its end, 300 degrees/s"
            found.append(Finding(Severity.FAULT, NAMES[device], what, "if nothing turns: replace it"))
    return found


def _echo_findings(heard: ProbeResult) -> list[Finding]:
    found = []
    for ranger, device in ((Ranger.LEFT, Healthy.RANGER_LEFT), (Ranger.RIGHT, Healthy.RANGER_RIGHT)):
        outcomes = [p.outcome for p in heard.pings if p.ranger == ranger]
        if len(outcomes) > 20 and all(outcome == Outcome.NO_ECHO for outcome in outcomes):
            what = f"hears no echo in {len(outcomes)} pings"
            remedy = "in the open that is right; within 6 m of a wall look whether something covers it"
            found.append(Finding(Severity.NOTE, NAMES[device], what, remedy))
    return found


def describe(drift: Drift) -> str:
    """The clock in words."""
    way = "fast" if drift.ppm >= 0.0 else "slow"
    return (
        f"the board's runs {abs(drift.ppm):.0f} ± {drift.sd_ppm:.0f} ppm {way} against this computer's; "
        f"it answers in {1e3 * drift.answer_s:.1f} ms"
    )


def _clock_findings(drift: Drift) -> list[Finding]:
    found = []
    if abs(drift.ppm) - 3.0 * drift.sd_ppm > DRIFT_MAX_PPM:
        what = f"its clock is off by {drift.ppm:.0f} ± {drift.sd_ppm:.0f} ppm"
        remedy = "times are still consistent, speeds are wrong by as much; is it a board with a crystal, and 16 MHz?"
        found.append(Finding(Severity.WARNING, "board", what, remedy))
    if drift.answer_s > ANSWER_MAX_S:
        what = f"it answers only after {1e3 * drift.answer_s:.0f} ms"
        found.append(Finding(Severity.WARNING, "board", what, "this computer is busy, or a USB hub is in between"))
    return found


def judge_mtx(report: Diagnosis, heard: ProbeResult, *, with_board: bool) -> None:
    """Add what was heard of the MTx; `with_board`: the board listened to its SyncOut."""
    for said in heard.mtx_says:
        report.lines.append(f"MTx       {said.removeprefix('MTx: ')}")
    rate_hz, wanted_hz = heard.mtx_hz, MtxTiming().rate_hz
    if heard.mtx_wrong or not heard.bytes_of[MTX] or math.isnan(rate_hz):
        said = heard.mtx_wrong or (heard.mtx_says or ["no sample came"])[-1]
        what, _, remedy = said.removeprefix("MTx: ").partition(": ")
        report.findings.append(
            Finding(Severity.FAULT, "MTx", what, remedy or "check its supply, its cable and the port")
        )
        return
    report.lines.append(f"MTx       {rate_hz:.1f} samples/s")
    if abs(rate_hz / wanted_hz - 1.0) > MTX_RATE_ERROR:
        what = f"{rate_hz:.1f} samples/s, expected are {wanted_hz:g}"
        report.findings.append(Finding(Severity.WARNING, "MTx", what, "samples are lost: check its cable"))
    if with_board and not heard.ticks.get("Sync"):
        what = "no SyncOut pulse reaches the board: its samples are timed by their arrival, to a millisecond"
        report.findings.append(
            Finding(Severity.NOTE, "MTx", what, "wire its SyncOut to D4 through the buffer (firmware/README.md)")
        )
