# SPDX-License-Identifier: MIT
"""The diagnosis of a foot board from a few seconds of its bytes: lines of facts, and findings.

In: `ProbeResult`. Out: lines and findings in a `Diagnosis`. Owns nothing.
"""

from __future__ import annotations

import numpy as np

from echostep.board.calibration import ICM20649_M_S2, ICM20649_RAD_S
from echostep.board.messages import FOOT_HEALTH_TEMPERATURE_INVALID, FootState, Part
from echostep_app.board.faults.device_faults import foot_celsius
from echostep_app.board.faults.findings import PART_NAMES, Severity
from echostep_app.board.faults.health import board_findings
from echostep_app.commissioning.diagnosis import (
    Diagnosis,
    clock_diagnosis,
    electrical_diagnosis,
    identify,
    loop_diagnosis,
)
from echostep_app.commissioning.probe import ProbeResult

RATE_HZ, RATE_ERROR = 225.0, 0.03  # 1125 Hz / 5 [firmware/icm20649.c]; its own clock is within 1 % [DS-000192, table 4]
# Zero-g level within 65 mg on each axis, and a scale within 1.5 %; assumed
GRAVITY_M_S2, GRAVITY_ERROR_M_S2 = 9.81, 1.2
BIAS_MAX_DEG_S = 10.0  # twice the greatest zero rate [DS-000192, table 1]
LEAST_SAMPLES = 100


def judge_foot_board(report: Diagnosis, probed: ProbeResult, port: str) -> None:
    """Add facts and findings on the foot board at this port."""
    subject, reports = "foot board", probed.reports
    if identify(report, probed, port, subject) is None:
        return
    electrical_diagnosis(report, probed, subject)
    loop_diagnosis(report, probed, subject)
    if reports.foot is None:
        what = "has found no ICM-20649"
        if reports.parts is not None and reports.parts.identity_foot:
            what += f": its identity register reads 0x{reports.parts.identity_foot:02X} instead of 0xE1"
        remedy = "check its 5 V and ground, the SPI wires and its chip select (D8)"
        report.add(Severity.FAULT, subject, what, remedy)
        return
    c, state = reports.foot.temperature, FootState(reports.foot.foot_state).name.lower()
    warm = "" if c == FOOT_HEALTH_TEMPERATURE_INVALID else f", {foot_celsius(c):.0f} degC"
    rest = _rest(probed)
    at_rest = "" if rest is None else f"; at rest {rest[0]:.2f} m/s2, {rest[1]:.1f} deg/s"
    report.lines.append(f"{'foot':10}{PART_NAMES[Part.ICM20649]}, identity 0xE1, {state}{warm}{at_rest}")
    rate_hz = probed.rates_hz.get("Foot", 0.0)
    report.lines.append(
        f"{'rates':10}foot {rate_hz:.1f}/s; {probed.lost} frames lost, {reports.foot.missed} samples missed"
    )
    report.findings += board_findings(reports)
    _judge_samples(report, probed, rate_hz)
    clock_diagnosis(report, probed, subject)


def _rest(probed: ProbeResult) -> tuple[float, float] | None:
    """Medians of the magnitudes of force (m/s2) and rate (deg/s); None with too few samples."""
    if len(probed.foot) < LEAST_SAMPLES:
        return None
    values = np.array(probed.foot, float)
    rates, forces = (np.linalg.norm(values[:, k : k + 3], axis=1) for k in (2, 5))
    return float(ICM20649_M_S2 * np.median(forces)), float(np.degrees(ICM20649_RAD_S * np.median(rates)))


def _judge_samples(report: Diagnosis, probed: ProbeResult, rate_hz: float) -> None:
    """Add findings on rate, force and zero rate of a part that runs."""
    foot, rest = probed.reports.foot, _rest(probed)
    if foot is None or foot.foot_state != FootState.RUNNING or not probed.rates_hz:
        return
    if abs(rate_hz / RATE_HZ - 1.0) > RATE_ERROR:
        what = f"{rate_hz:.1f} samples/s, expected are {RATE_HZ:g}"
        report.add(Severity.WARNING, "foot board", what, "unplug it and plug it in again; avoid a USB hub")
    if rest and abs(rest[0] - GRAVITY_M_S2) > GRAVITY_ERROR_M_S2:
        what = f"measures {rest[0]:.2f} m/s2 at rest instead of {GRAVITY_M_S2}"
        report.add(Severity.WARNING, "foot board", what, "stand still and run echostep doctor again")
    if rest and rest[1] > BIAS_MAX_DEG_S:
        what = f"measures {rest[1]:.1f} deg/s at rest"
        report.add(Severity.WARNING, "foot board", what, "stand still and run echostep doctor again")
