"""Devices that fail, in words: what the board's status and the gyros' self-tests say of each, and what to do about it.

In: `BoardReports`. Out: `Finding`s; one cause that explains several devices is said once. Owns the texts.
"""

from __future__ import annotations

from collections.abc import Iterable

from echostep.board.findings import (
    ADDRESSES,
    GYROS,
    NAMES,
    ON_I2C,
    SELECTS,
    BoardReports,
    Finding,
    Severity,
    has_failed,
    of,
)
from echostep.board.messages import GYRO_HEALTH_INVALID, Fault, Gyro, GyroHealth, Healthy, SelfTest, Status

TEMPERATURE_C = (-20.0, 60.0)  # what a gyro on a person can be
UNMOVED_COUNTS = 12

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
    "is it a CMPS10, or another with the bearing in registers 2 and 3?",
)
_RANGER_LATE = ("takes its command but never gives a result", "power-cycle the board; if it stays, replace the ranger")


def device_findings(words: BoardReports, status: Status) -> list[Finding]:
    """Devices that failed when they were last asked."""
    on = Healthy(words.sensors & 0x7F)
    failed = [d for d in Healthy if d & on and not status.healthy & d and has_failed(status, d)]
    common, explained = _common_causes(status, failed, on)
    single = [_device(d, Fault(of(status, "fault", d))) for d in failed if not explained & d]
    return common + single


def _common_causes(status: Status, failed: list[Healthy], on: Healthy) -> tuple[list[Finding], Healthy]:
    """One cause for several devices, and the devices that it explains."""
    stuck = _joined(d for d in failed if d & ON_I2C and of(status, "fault", d) == Fault.BUS_STUCK)
    mute = _joined(d for d in failed if of(status, "fault", d) == Fault.NO_ANSWER)
    found, explained = [], Healthy(0)
    if stuck:
        what = f"stuck, a line is held low ({_listed(stuck)} cannot be read)"
        remedy = "unplug the rangers and the compass one after the other to find who holds it; check the pull-ups and SDA (D2), SCL (D3)"
        found.append(Finding(Severity.FAULT, "I2C bus", what, remedy))
        explained |= stuck
    for group, bus, lines in (
        (ON_I2C & on, "I2C bus", "5 V, ground, both pull-ups, and whether SDA (D2) and SCL (D3) are swapped"),
        (GYROS & on, "SPI bus", "5 V and ground of the gyros, and SCK, MOSI, MISO on the ICSP plug"),
    ):
        if group.bit_count() > 1 and group & mute == group:
            found.append(Finding(Severity.FAULT, bus, f"nobody answers ({_listed(group)})", f"check {lines}"))
            explained |= group
    return found, explained


def _device(device: Healthy, fault: Fault) -> Finding:
    what, remedy = f"failed ({fault.name.lower().replace('_', ' ')})", "check its wires and its supply"
    if device == Healthy.PRESSURE:
        what, remedy = _PRESSURE_TEXTS.get(fault, (what, remedy))
    elif fault == Fault.NO_ANSWER and device in ADDRESSES:
        what = f"does not answer at I2C address 0x{ADDRESSES[device]:02X}"
        remedy = "check its plug and 5 V"
        remedy += ", and that it was given this address (firmware/README.md)" if device == Healthy.RANGER_RIGHT else ""
    elif fault == Fault.NO_ANSWER and device in SELECTS:
        what, remedy = "does not answer", f"check its SPI cable, 5 V and its chip select ({SELECTS[device]})"
    elif fault == Fault.WRONG_CHANNEL and device in SELECTS:
        what = "answers with another channel than asked for"
        remedy = f"shorten or shield its SPI cable, check its chip select ({SELECTS[device]}) against the other gyros'"
    elif fault == Fault.BAD_VALUE and device == Healthy.COMPASS:
        what, remedy = _COMPASS_BAD
    elif fault == Fault.TOO_LATE:
        what, remedy = _RANGER_LATE
    return Finding(Severity.FAULT, NAMES[device], what, remedy)


_TESTS = {
    SelfTest.FAILED: (
        Severity.FAULT,
        "failed its self-test",
        "check its ST1 (A0) and ST2 (A1), power-cycle the board; if it stays, replace the gyro",
    ),
    SelfTest.NO_ANSWER: (Severity.FAULT, "did not answer during its self-test", "check its SPI cable and its 5 V"),
    SelfTest.MOVED: (
        Severity.NOTE,
        "was turning during its self-test, or one of ST1 (A0) and ST2 (A1) is not connected",
        "stand still and run echostep doctor; if it stays, check both wires",
    ),
    SelfTest.NOT_RUN: (Severity.NOTE, "was not tested since the board's watchdog restarted it", "run echostep doctor"),
}


def gyro_findings(words: BoardReports) -> list[Finding]:
    """What the gyros' self-tests and temperatures say."""
    unhealthy = 0 if words.status is None else ~words.status.healthy
    answering = [
        (NAMES[device], said)
        for gyro, said in sorted(words.gyros.items())
        if (device := Healthy[Gyro(gyro).name]) & words.sensors and not device & unhealthy  # else that is said already
    ]
    unmoved = [name for name, said in answering if _unmoved(said)]
    found = []
    if len(unmoved) > 1 and len(unmoved) == len(answering):
        what = f"none of them responds to its self-test ({', '.join(unmoved)})"
        remedy = "check the wires from A0 to ST1 and from A1 to ST2; without them the gyros work, but cannot be tested"
        found.append(Finding(Severity.WARNING, "gyros", what, remedy))
    explained = set(unmoved) if found else set()
    for name, said in answering:
        if SelfTest(said.self_test) in _TESTS and name not in explained:
            severity, what, remedy = _TESTS[SelfTest(said.self_test)]
            found.append(Finding(severity, name, what + _responses(said), remedy))
        found += _temperature(name, said)
    return found


def _unmoved(said: GyroHealth) -> bool:
    """A gyro whose rate the self-test did not change at all."""
    return said.self_test == SelfTest.FAILED and max(abs(said.response_st1), abs(said.response_st2)) <= UNMOVED_COUNTS


def _temperature(name: str, said: GyroHealth) -> list[Finding]:
    if said.temperature == GYRO_HEALTH_INVALID:
        what = "answers, but not with its temperature: its MISO may be held low"
        return [Finding(Severity.FAULT, name, what, "check its SPI cable for a short to ground")]
    if TEMPERATURE_C[0] <= gyro_celsius(said) <= TEMPERATURE_C[1]:
        return []
    what = f"says it has {gyro_celsius(said):.0f} degrees Celsius"
    return [Finding(Severity.WARNING, name, what, "its bias drifts outside -20 to 60 degrees")]


def _responses(said: GyroHealth) -> str:
    unmeasured = GYRO_HEALTH_INVALID in (said.response_st1, said.response_st2)
    if said.self_test not in (SelfTest.FAILED, SelfTest.MOVED) or unmeasured:
        return ""
    return f" (responses {said.response_st1} and {said.response_st2} counts; proper are -121 to -376 and 121 to 376)"


def gyro_celsius(said: GyroHealth) -> float:
    """Temperature of a gyro in degrees Celsius; 8.4 mV per degree [ADXRS300] in counts of 5 V / 4096."""
    return 25.0 + 0.1453 * said.temperature


def _joined(devices: Iterable[Healthy]) -> Healthy:
    joined = Healthy(0)
    for device in devices:
        joined |= device
    return joined


def _listed(devices: Healthy) -> str:
    return ", ".join(NAMES[d] for d in Healthy if d & devices)
