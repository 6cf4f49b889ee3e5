# SPDX-License-Identifier: MIT
"""Findings on single devices: faults in the board's status, and the gyros' self-tests and temperatures, each with a remedy.

In: `BoardReports`. Out: `Finding`s; a cause that explains several devices gives one. Owns the texts.
"""

from __future__ import annotations

from collections.abc import Iterable

from echostep.board.messages import (
    GYRO_HEALTH_INVALID,
    Fault,
    FootState,
    Gyro,
    GyroHealth,
    Healthy,
    Part,
    SelfTest,
    Status,
    Wiring,
)
from echostep.board.reports import BoardReports
from echostep_app.board.faults.findings import (
    ADDRESSES,
    DEVICES,
    GYROS,
    NAMES,
    ON_I2C,
    SELECTS,
    Finding,
    Severity,
    has_failed,
    identity_in,
    name_of,
    part_in,
    status_field,
)
from echostep_app.board.faults.part_faults import (
    LIKE_FOOT_PARTS,
    SIX_AXES_RESPONSES,
    SIX_AXES_TESTS,
    UNKNOWN_PART_REMEDIES,
    WRONG_BITS_REMEDY,
    foot_text,
    mixed_rangers,
    part_text,
    strange_foot_text,
)

TEMPERATURE_C = (-20.0, 60.0)  # degC, range of a gyro on a person; assumed
UNMOVED_COUNTS = 12  # largest response to a self-test that is taken for none; assumed
CELSIUS_AT_ZERO, CELSIUS_PER_COUNT = 25.0, 0.1453  # 8.4 mV per degC [ADXRS300], counts of 5 V / 4096
PROPER_RESPONSES = "-121 to -376 and 121 to 376"  # counts, to ST1 and ST2

_POWER_CYCLE = "power-cycle the board, check 3.3 V and the level shifter"
_PRESSURE_TEXTS = {
    Fault.NO_ANSWER: (
        "does not answer",
        "check its 3.3 V, the level shifter and the SPI wires; its chip select is D6",
    ),
    Fault.NEVER_STARTED: ("does not finish its start-up", _POWER_CYCLE),
    Fault.EEPROM: ("EEPROM check failed", f"{_POWER_CYCLE}; if it stays, the chip is damaged: replace it"),
    Fault.NEVER_READY: ("has had no sample for 2 s: DRDY stays low", "check the wire from DRDY to D7"),
    Fault.ALWAYS_READY: ("DRDY stays high", "check the wire from DRDY to D7 for a short to 3.3 V or 5 V"),
    Fault.BAD_VALUE: ("gives a pressure of zero", _POWER_CYCLE),
}
_COMPASS_BAD = (
    "gives bearings above 359.9 degrees",
    "check that it is a CMPS10, or a compass with the bearing in registers 2 and 3",
)
_RANGER_LATE = ("accepts its command but gives no result", "power-cycle the board; if it stays, replace the ranger")
_TESTS = {
    SelfTest.FAILED: (
        Severity.FAULT,
        "failed its self-test",
        "check its ST1 (A0) and ST2 (A1), power-cycle the board; if it stays, replace the gyro",
    ),
    SelfTest.NO_ANSWER: (Severity.FAULT, "did not answer during its self-test", "check its SPI cable and its 5 V"),
    SelfTest.MOVED: (
        Severity.NOTE,
        "turned during its self-test, or one of ST1 (A0) and ST2 (A1) is not connected",
        "stand still and run echostep doctor; if it stays, check both wires",
    ),
    SelfTest.NOT_RUN: (
        Severity.NOTE,
        "was not tested, because the board was restarted by its watchdog or by a low supply",
        "run echostep doctor",
    ),
}


def device_findings(reports: BoardReports, status: Status) -> list[Finding]:
    """Findings on devices whose last access failed."""
    on = Healthy(reports.sensors & DEVICES)
    failed = [d for d in Healthy if d & on and not status.healthy & d and has_failed(status, d)]
    mixed, refused = _mixed_rangers(reports, failed)
    failed = [d for d in failed if not refused & d]
    pulses = _union(d for d in Healthy if part_in(reports, d) is Part.PULSE)
    if (bare := _bare_board(reports, on, failed)) is not None:
        return [bare]
    common, explained = _common_causes(status, failed, on & ~pulses)
    strange = _strange_foot(reports, status) if Healthy.THIGH in failed else []
    explained |= Healthy.THIGH if strange else Healthy(0)
    single = [_device_finding(reports, d, Fault(status_field(status, "fault", d))) for d in failed if not explained & d]
    return mixed + strange + common + single


def _bare_board(reports: BoardReports, on: Healthy, failed: list[Healthy]) -> Finding | None:
    """A finding on a board that has found no part since its start, and no trace of one."""
    parts = reports.parts
    if parts is None or any(parts._replace(ticks=0)) or _union(failed) != on:
        return None
    remedy = "normal before anything is wired; else check 5V and GND at the carrier"
    return Finding(Severity.FAULT, "board", "has found no part", remedy)


def _strange_foot(reports: BoardReports, status: Status) -> list[Finding]:
    """A finding on a part at the thigh's chip select that is like a foot board's, and that the firmware has not accepted."""
    parts, mute = reports.parts, status_field(status, "fault", Healthy.THIGH) == Fault.NO_ANSWER
    if parts is None or not mute or parts.part_foot != Part.NONE or parts.identity_foot not in LIKE_FOOT_PARTS:
        return []
    return [Finding(Severity.FAULT, "thigh gyro", *strange_foot_text(parts.identity_foot))]


def _mixed_rangers(reports: BoardReports, failed: list[Healthy]) -> tuple[list[Finding], Healthy]:
    """A finding on rangers of two kinds, and the one that is refused."""
    if reports.parts is None or reports.parts.wiring != Wiring.MIXED_RANGERS:
        return [], Healthy(0)
    what, remedy = mixed_rangers(part_in(reports, Healthy.RANGER_LEFT), part_in(reports, Healthy.RANGER_RIGHT))
    refused = _union(d for d in failed if d & (Healthy.RANGER_LEFT | Healthy.RANGER_RIGHT))
    return [Finding(Severity.FAULT, "rangers", what, remedy)], refused


def _common_causes(status: Status, failed: list[Healthy], on: Healthy) -> tuple[list[Finding], Healthy]:
    """Findings on causes that several devices have in common, and the devices that they explain."""
    stuck = _union(d for d in failed if d & ON_I2C and status_field(status, "fault", d) == Fault.BUS_STUCK)
    mute = _union(d for d in failed if status_field(status, "fault", d) == Fault.NO_ANSWER)
    findings, explained = [], Healthy(0)
    if stuck:
        what = f"stuck, a line is held low ({_names(stuck)} cannot be read)"
        remedy = "unplug the rangers and the compass one after the other until the line is free; check the pull-ups and SDA (D2), SCL (D3)"
        findings.append(Finding(Severity.FAULT, "I2C bus", what, remedy))
        explained |= stuck
    for group, bus, lines in (
        (
            ON_I2C & on,
            "I2C bus",
            "5 V, ground, the pull-ups of rangers on I2C, and whether SDA (D2) and SCL (D3) are swapped",
        ),
        (GYROS & on, "SPI bus", "5 V and ground of the gyros, and SCK, MOSI, MISO on the ICSP plug"),
    ):
        if group.bit_count() > 1 and group & mute == group:
            findings.append(Finding(Severity.FAULT, bus, f"no device answers ({_names(group)})", f"check {lines}"))
            explained |= group
    return findings, explained


def _device_finding(reports: BoardReports, device: Healthy, fault: Fault) -> Finding:
    """Finding on one device with this fault; a general text for a fault that is not possible for the device."""
    what, remedy = f"failed ({fault.name.lower().replace('_', ' ')})", "check its wires and its supply"
    is_unknown = reports.parts is not None and part_in(reports, device) is Part.NONE
    unknown = UNKNOWN_PART_REMEDIES.get(device) if is_unknown else None
    if text := part_text(part_in(reports, device), identity_in(reports, device), device, fault):
        what, remedy = text
    elif fault == Fault.NO_ANSWER and unknown:
        what, remedy = "does not answer", unknown
    elif device == Healthy.PRESSURE:
        what, remedy = _PRESSURE_TEXTS.get(fault, (what, remedy))
    elif fault == Fault.NO_ANSWER and device in ADDRESSES:
        what = f"does not answer at I2C address 0x{ADDRESSES[device]:02X}"
        remedy = "check its plug and 5 V"
        remedy += ", and that it was set to this address (firmware/README.md)" if device == Healthy.RANGER_RIGHT else ""
    elif fault == Fault.NO_ANSWER and device in SELECTS:
        what, remedy = "does not answer", f"check its SPI cable, 5 V and its chip select ({SELECTS[device]})"
    elif fault == Fault.WRONG_CHANNEL and device in SELECTS:
        what = "answers with another channel than the requested one"
        remedy = f"shorten or shield its SPI cable, check its chip select ({SELECTS[device]}) against the other gyros'"
    elif fault == Fault.BAD_VALUE and device == Healthy.COMPASS:
        what, remedy = _COMPASS_BAD
    elif fault == Fault.TOO_LATE:
        what, remedy = _RANGER_LATE
    return Finding(Severity.FAULT, name_of(reports, device), what, remedy)


def gyro_findings(reports: BoardReports) -> list[Finding]:
    """Findings by the gyros' self-tests and temperatures, for gyros that answer."""
    unhealthy = 0 if reports.status is None else ~reports.status.healthy
    answering = [
        (device, health)
        for gyro, health in sorted(reports.gyros.items())
        if (device := Healthy[Gyro(gyro).name]) & reports.sensors and not device & unhealthy  # else it has a finding
    ]
    pins = [device for device, _ in answering if part_in(reports, device) is not Part.LSM6DSO]  # with self-test inputs
    unmoved = [device for device, health in answering if device in pins and _is_unmoved(health)]
    findings = []
    if len(unmoved) > 1 and len(unmoved) == len(pins):
        what = f"none of them responds to its self-test ({_names(_union(unmoved))})"
        remedy = "check the wires from A0 to ST1 and from A1 to ST2; without them the gyros work, but cannot be tested"
        findings.append(Finding(Severity.WARNING, "gyros", what, remedy))
    explained = set(unmoved) if findings else set()
    for device, health in answering:
        name, outcome = name_of(reports, device), SelfTest(health.self_test)
        if outcome in _TESTS and device not in explained:
            severity, what, remedy = _TESTS[outcome]
            if device not in pins:
                what, remedy = SIX_AXES_TESTS.get(outcome, (what, remedy))
            proper = PROPER_RESPONSES if device in pins else SIX_AXES_RESPONSES
            findings.append(Finding(severity, name, what + _response_text(health, proper), remedy))
        findings += _temperature_findings(name, health)
    return findings


def foot_findings(reports: BoardReports) -> list[Finding]:
    """A finding on the part of a foot board that does not run, or whose bits arrive wrong."""
    foot, before, subject = reports.foot, reports.previous_foot, "foot sensor (ICM-20649)"
    if foot is None or not foot.errors:
        return []
    if foot.foot_state != FootState.RUNNING:
        return [Finding(Severity.FAULT, subject, *foot_text(Fault(foot.fault)))]
    more = 0 if before is None else (foot.errors - before.errors) & 0xFFFF
    if foot.fault != Fault.BAD_VALUE or not more:
        return []
    what = f"sent wrong bits {more} time{'s' if more > 1 else ''} in the last second"
    return [Finding(Severity.WARNING, subject, what, WRONG_BITS_REMEDY)]


def foot_celsius(counts: int) -> float:
    """Temperature in degC of an ICM-20649 [DS-000192, table 1: 333.87 counts per degC, 0 at 21 degC]."""
    return 21.0 + counts / 333.87


def _is_unmoved(health: GyroHealth) -> bool:
    """Whether the self-test did not change the gyro's rate."""
    largest = max(abs(health.response_st1), abs(health.response_st2))
    return health.self_test == SelfTest.FAILED and largest <= UNMOVED_COUNTS


def _temperature_findings(name: str, health: GyroHealth) -> list[Finding]:
    """Findings on a gyro's temperature: not measured, or out of range."""
    if health.temperature == GYRO_HEALTH_INVALID:
        what = "answers, but not with its temperature: its MISO may be held low"
        return [Finding(Severity.FAULT, name, what, "check its SPI cable for a short to ground")]
    if TEMPERATURE_C[0] <= gyro_celsius(health) <= TEMPERATURE_C[1]:
        return []
    what = f"reports {gyro_celsius(health):.0f} degrees Celsius"
    return [Finding(Severity.WARNING, name, what, "its bias drifts outside -20 to 60 degrees")]


def _response_text(health: GyroHealth, proper: str) -> str:
    """The measured responses of a failed self-test, to append to the finding; "" otherwise."""
    unmeasured = GYRO_HEALTH_INVALID in (health.response_st1, health.response_st2)
    if health.self_test not in (SelfTest.FAILED, SelfTest.MOVED) or unmeasured:
        return ""
    return f" (responses {health.response_st1} and {health.response_st2} counts; proper are {proper})"


def gyro_celsius(health: GyroHealth) -> float:
    """Temperature of a gyro in degC."""
    return CELSIUS_AT_ZERO + CELSIUS_PER_COUNT * health.temperature


def _union(devices: Iterable[Healthy]) -> Healthy:
    """The set of these devices."""
    union = Healthy(0)
    for device in devices:
        union |= device
    return union


def _names(devices: Healthy) -> str:
    """Names of a set of devices, separated by commas."""
    return ", ".join(NAMES[d] for d in Healthy if d & devices)
