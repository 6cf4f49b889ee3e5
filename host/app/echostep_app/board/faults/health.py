# SPDX-License-Identifier: MIT
"""Findings on the board's health, each with a remedy.

In: the board's reports about itself, and the measured rates of its streams. Out: `Finding`s, the most severe first. Owns nothing; the texts for
single devices are in `device_faults`, the texts for restarts, crashes and supply are here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from echostep.board.messages import (
    BOARD_HEALTH_INVALID,
    BoardHealth,
    CrashPlace,
    Fault,
    Healthy,
    Part,
    PressureMode,
    ResetCause,
    Schedule,
    Sensors,
    Status,
)
from echostep.board.reports import BoardReports
from echostep_app.board.faults.device_faults import (
    device_findings,
    foot_findings,
    gyro_celsius,
    gyro_findings,
)
from echostep_app.board.faults.findings import (
    DEVICES,
    GYROS,
    NAMES,
    SELECTS,
    Finding,
    Severity,
    field_suffix,
    increase,
    name_of,
    part_in,
    span_s,
    status_field,
)
from echostep_app.board.faults.part_faults import I2C_BITS_REMEDY, WRONG_BITS_REMEDY, part_text

LEAST_MV = 4100  # a measurement below it is below the 4.5 V that 16 MHz need, although the reference is off by up to 9 % [data sheet]
SAG = 0.08  # of the usual voltage: 0.4 V, more than the drop on a good cable
_POWER_REMEDY = (
    "use a shorter, thicker USB cable or a powered hub; set the brown-out fuse to 4.3 V (firmware/README.md)"
)
__all__ = [
    "NAMES", "SELECTS", "BoardReports", "Finding", "Severity", "board_findings", "expected_rates", "gyro_celsius", "rate_findings",
]  # fmt: skip

MEMORY_BYTES = 2560  # of the processor
MEMORY_MAX_BYTES = 2200  # [firmware/README.md, budgets]
RATE_LEAST = 0.9  # of the expected rate; assumed
RATE_FAULT = 0.5  # of the expected rate, below it the finding is a fault; assumed
# Both rangers [firmware/README.md]
PINGS_HZ = {Schedule.CONCURRENT: 28.0, Schedule.SEQUENTIAL: 13.5, Schedule.SIMULTANEOUS: 28.0}
# Both rangers [firmware/ranger.h]
MAXSONAR_PINGS_HZ = {Schedule.CONCURRENT: 19.0, Schedule.SEQUENTIAL: 9.5, Schedule.SIMULTANEOUS: 19.0}
PRESSURE_HZ = {PressureMode.HIGH_SPEED: 9.0, PressureMode.HIGH_RESOLUTION: 1.8}
DEFAULT_GYROS_HZ, DEFAULT_COMPASS_HZ = 200.0, 10.0  # [protocol/README.md]
_STREAMS = {  # by message: subject and unit of a finding, devices
    "Ping": ("rangers", "pings", Healthy.RANGER_LEFT | Healthy.RANGER_RIGHT),
    "Gyros": ("gyros", "samples", Healthy(0)),
    "Compass": ("compass", "bearings", Healthy.COMPASS),
    "Magnetic": ("compass", "fields", Healthy.COMPASS),
    "Pressure": ("barometer", "samples", Healthy.PRESSURE),
}


def restart_findings(reports: BoardReports) -> list[Finding]:
    """Finding on an unwanted cause of the last restart, or on earlier crashes."""
    cause = ResetCause(0 if reports.identity is None else reports.identity.reset_cause)
    health = reports.board_health
    if cause & ResetCause.WATCHDOG or (health is not None and health.crashes):
        what = "was restarted by its watchdog"
        what += "" if health is None or not health.crashes else f" ({crash_text(health)})"
        return [Finding(Severity.WARNING, "board", what, "if it happens again, report this line and what was done")]
    if cause & ResetCause.BROWN_OUT:
        return [Finding(Severity.WARNING, "board", "restarted because its supply was too low", _POWER_REMEDY)]
    return []


def crash_text(health: BoardHealth) -> str:
    """The crashes of a board as text: how many since power was applied, and where the last one was."""
    times = f"{health.crashes} times" if health.crashes != 1 else "once"
    where = CrashPlace(health.crash_place).name.lower()
    address = f", address 0x{2 * health.crash_address:04x}" if health.crash_address else ""
    return f"{times} since it got power, last in {where}{address}"


def supply_findings(reports: BoardReports) -> list[Finding]:
    """Finding on a supply voltage that is too low or has sagged in the last second."""
    health = reports.board_health
    if health is None or BOARD_HEALTH_INVALID in (health.supply_mv, health.supply_least_mv):
        return []
    least_v, usual_v = 1e-3 * health.supply_least_mv, 1e-3 * reports.usual_supply_mv
    if health.supply_least_mv < LEAST_MV:
        what = f"its supply is {least_v:.2f} V, it needs 4.5 V: it may stop at any time"
        return [Finding(Severity.FAULT, "board", what, _POWER_REMEDY)]
    if least_v < (1.0 - SAG) * usual_v:
        what = f"its supply sagged to {least_v:.2f} V, usual is {usual_v:.2f} V"
        return [Finding(Severity.WARNING, "board", what, _POWER_REMEDY)]
    return []


def board_findings(reports: BoardReports) -> list[Finding]:
    """Findings by the board's reports, the most severe first; empty without problems or before the first report."""
    findings = restart_findings(reports) + supply_findings(reports) + gyro_findings(reports) + foot_findings(reports)
    if reports.status is not None:
        findings += device_findings(reports, reports.status) + _intermittent_findings(reports)
        findings += _loss_findings(reports.status, reports.previous_status)
    if reports.foot is not None:
        findings = [replace(f, subject="foot board") if f.subject == "board" else f for f in findings]
    return sorted(findings, key=lambda finding: -finding.severity)


def all_findings(board: BoardReports, foot: BoardReports | None) -> list[Finding]:
    """Findings on a sensor board and on a foot board, where one is worn, the most severe first."""
    of_foot = board_findings(foot) if foot else []
    return sorted([*board_findings(board), *of_foot], key=lambda finding: -finding.severity)


def _intermittent_findings(reports: BoardReports) -> list[Finding]:
    """Findings on devices that answer now and failed since the previous status."""
    status, previous = reports.status, reports.previous_status
    if status is None or previous is None:
        return []
    answering = reports.sensors & status.healthy & DEVICES
    findings = []
    for device in (d for d in Healthy if d & answering):
        if count := increase(status, previous, f"errors_{field_suffix(device)}"):
            fault, span = Fault(status_field(status, "fault", device)), f"in the last {span_s(status, previous):.0f} s"
            what = f"failed {count} times {span} ({fault.name.lower().replace('_', ' ')}), and answers again"
            remedy = "a loose plug is likely: move the cable and watch"
            if fault is Fault.BAD_VALUE and (device & GYROS or part_in(reports, device) in (Part.BMP390, Part.LIS3MDL)):
                what = f"sent wrong bits {count} time{'s' if count > 1 else ''} {span}"
                remedy = I2C_BITS_REMEDY if device is Healthy.COMPASS else WRONG_BITS_REMEDY
            if fault is Fault.TOO_LATE and part_in(reports, device) is Part.PULSE:
                what, remedy = part_text(Part.PULSE, 0, device, fault) or (what, remedy)
            findings.append(Finding(Severity.WARNING, name_of(reports, device), what, remedy))
    return findings


def _loss_findings(status: Status, previous: Status | None) -> list[Finding]:
    """Findings on counters of lost data that have increased, and on memory."""
    if previous is None:
        return []
    findings = []
    span = f"in the last {span_s(status, previous):.0f} s"
    if dropped := sum(increase(status, previous, n) for n in Status._fields if n.startswith("dropped_")):
        what = f"dropped {dropped} messages {span}"
        remedy = "the host reads too slowly: close other programs, avoid a USB hub"
        findings.append(Finding(Severity.WARNING, "board", what, remedy))
    if recovered := increase(status, previous, "bus_recoveries"):
        what = f"was stuck and recovered {recovered} times {span}"
        remedy = "check the pull-ups (2.2 kohm) and keep the cables short"
        findings.append(Finding(Severity.WARNING, "I2C bus", what, remedy))
    if bad := increase(status, previous, "bad_frames"):
        what = f"got {bad} damaged commands {span}"
        findings.append(Finding(Severity.WARNING, "board", what, "close other programs that write to its port"))
    if status.memory_used > MEMORY_MAX_BYTES:
        what = f"used {status.memory_used} of {MEMORY_BYTES} bytes of memory"
        findings.append(Finding(Severity.WARNING, "board", what, "report it, with the recording"))
    return findings


def expected_rates(reports: BoardReports) -> dict[str, float]:
    """Messages per second of each stream that is switched on, by the message's name; the board's defaults before its `Configuration`."""
    c, on = reports.configuration, reports.sensors
    schedule = Schedule.CONCURRENT if c is None else Schedule(c.schedule)
    mode = PressureMode.HIGH_SPEED if c is None else PressureMode(c.pressure_mode)
    compass = "Magnetic" if part_in(reports, Healthy.COMPASS) is Part.LIS3MDL else "Compass"
    rangers = (on & (Sensors.RANGER_LEFT | Sensors.RANGER_RIGHT)).bit_count()
    gyros = on & (Sensors.THIGH | Sensors.CALF | Sensors.BELT)
    kinds = [part_in(reports, d) for d in (Healthy.RANGER_LEFT, Healthy.RANGER_RIGHT)]
    pings_hz = MAXSONAR_PINGS_HZ if Part.MAXSONAR in kinds else PINGS_HZ
    return {
        name: rate
        for name, rate, there in (
            ("Ping", pings_hz[schedule] * rangers / 2, rangers),
            ("Gyros", DEFAULT_GYROS_HZ if c is None else float(c.gyro_rate_hz), gyros),
            (compass, DEFAULT_COMPASS_HZ if c is None else float(c.compass_rate_hz), on & Sensors.COMPASS),
            ("Pressure", PRESSURE_HZ[mode], on & Sensors.PRESSURE),
        )
        if there
    }


def rate_findings(reports: BoardReports, rates_hz: Mapping[str, float]) -> list[Finding]:
    """Findings on streams that are slower than configured, unless the status explains it."""
    findings = []
    healthy = DEVICES if reports.status is None else reports.status.healthy
    for name, expected in expected_rates(reports).items():
        subject, unit, devices = _STREAMS[name]
        measured = rates_hz.get(name, 0.0)
        if measured >= RATE_LEAST * expected or (devices and not healthy & devices):
            continue
        severity = Severity.FAULT if measured < RATE_FAULT * expected else Severity.WARNING
        what = f"{measured:.1f} {unit}/s, expected are {expected:.1f}"
        findings.append(Finding(severity, subject, what, "unplug the board and plug it in again; avoid a USB hub"))
    return findings
