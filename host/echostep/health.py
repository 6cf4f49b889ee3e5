"""What is wrong with the board, in words: what it is and what to do about it.

In: the board's messages about itself, and what was counted while listening. Out: `Finding`s, the worst first. Owns the texts.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import IntEnum

from echostep.messages import (
    Configuration,
    Fault,
    Gyro,
    GyroHealth,
    Healthy,
    Identity,
    Message,
    PressureMode,
    ResetCause,
    Schedule,
    SelfTest,
    Sensors,
    Status,
)

INVALID = -32768
TEMPERATURE_C = (-20.0, 60.0)  # what a gyro on a person can be
MEMORY_MAX_BYTES = 2200  # of 2560 [firmware/README.md, budgets]
RATE_LEAST = 0.9  # of what is expected; below half of it the stream is as good as gone
PINGS_HZ = {Schedule.CONCURRENT: 28.0, Schedule.SEQUENTIAL: 13.5}  # both rangers [firmware/README.md]
PRESSURE_HZ = {PressureMode.HIGH_SPEED: 9.0, PressureMode.HIGH_RESOLUTION: 1.8}


class Severity(IntEnum):
    """How bad: a note needs nothing done, a warning costs accuracy, a fault costs a sensor."""

    NOTE = 0
    WARNING = 1
    FAULT = 2


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that is not as it should be: of what, what it is, what to do."""

    severity: Severity
    subject: str
    what: str
    remedy: str

    def __str__(self) -> str:
        return f"{self.subject}: {self.what}; {self.remedy}"


NAMES = {
    Healthy.RANGER_LEFT: "left ranger",
    Healthy.RANGER_RIGHT: "right ranger",
    Healthy.COMPASS: "compass",
    Healthy.THIGH: "thigh gyro",
    Healthy.CALF: "calf gyro",
    Healthy.BELT: "belt gyro",
    Healthy.PRESSURE: "barometer",
}
ON_I2C = Healthy.RANGER_LEFT | Healthy.RANGER_RIGHT | Healthy.COMPASS
GYROS = Healthy.THIGH | Healthy.CALF | Healthy.BELT
ADDRESSES = {Healthy.RANGER_LEFT: 0x70, Healthy.RANGER_RIGHT: 0x71, Healthy.COMPASS: 0x60}
SELECTS = {Healthy.THIGH: "D8", Healthy.CALF: "D9", Healthy.BELT: "D10"}

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


@dataclass(slots=True)
class BoardWords:
    """The board's newest words about itself, and the status before: what has grown since is news."""

    identity: Identity | None = None
    configuration: Configuration | None = None
    status: Status | None = None
    earlier: Status | None = None
    gyros: dict[int, GyroHealth] = field(default_factory=dict)

    def take(self, message: Message) -> None:
        """Keep a message when it says something about the board; a restart forgets the status before."""
        if isinstance(message, Identity):
            self.identity = message
        elif isinstance(message, Configuration):
            self.configuration = message
        elif isinstance(message, GyroHealth):
            self.gyros[message.gyro] = message
        elif isinstance(message, Status):
            restarted = self.status is not None and message.ticks < self.status.ticks  # or the ticks have wrapped
            self.earlier, self.status = None if restarted else self.status, message

    @property
    def sensors(self) -> Sensors:
        """Which sensors are switched on; all of them, as long as nobody said otherwise."""
        return Sensors(0xFF if self.configuration is None else self.configuration.sensors)


def board_findings(words: BoardWords) -> list[Finding]:
    """What the board says is wrong, the worst first; empty when all is well or it has not spoken yet."""
    found = _start(words) + _gyro_tests(words)
    if words.status is not None:
        found += _devices(words, words.status) + _losses(words.status, words.earlier)
    return sorted(found, key=lambda finding: -finding.severity)


def _start(words: BoardWords) -> list[Finding]:
    cause = ResetCause(0 if words.identity is None else words.identity.reset_cause)
    if cause & ResetCause.WATCHDOG:
        what, remedy = "its watchdog has restarted it", "if it happens again, write down what was done and report it"
    elif cause & ResetCause.BROWN_OUT:
        what, remedy = "its supply was too low and it restarted", "use a shorter USB cable or a powered hub"
    else:
        return []
    return [Finding(Severity.WARNING, "board", what, remedy)]


def _devices(words: BoardWords, status: Status) -> list[Finding]:
    on = Healthy(words.sensors & 0x7F)
    failed = [d for d in Healthy if d & on and not status.healthy & d and _errors(status, d)]
    common, explained = _common_causes(status, failed, on)
    single = [_device(d, Fault(_of(status, "fault", d))) for d in failed if not explained & d]
    return common + single + _sometimes(status, words.earlier, Healthy(on & status.healthy))


def _common_causes(status: Status, failed: list[Healthy], on: Healthy) -> tuple[list[Finding], Healthy]:
    """One cause for several devices, and the devices that it explains."""
    stuck = _joined(d for d in failed if d & ON_I2C and _of(status, "fault", d) == Fault.BUS_STUCK)
    mute = _joined(d for d in failed if _of(status, "fault", d) == Fault.NO_ANSWER)
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


def _sometimes(status: Status, earlier: Status | None, answering: Healthy) -> list[Finding]:
    """Devices that answer now and failed since the status before."""
    if earlier is None:
        return []
    found = []
    for device in (d for d in Healthy if d & answering):
        if count := _grown(status, earlier, f"errors_{_suffix(device)}"):
            fault = Fault(_of(status, "fault", device)).name.lower().replace("_", " ")
            what = f"failed {count} times in the last {_span_s(status, earlier):.0f} s ({fault}), and answers again"
            found.append(Finding(Severity.WARNING, NAMES[device], what, "a loose plug? move the cable and watch"))
    return found


def _losses(status: Status, earlier: Status | None) -> list[Finding]:
    if earlier is None:
        return []
    found = []
    span = f"in the last {_span_s(status, earlier):.0f} s"
    if dropped := sum(_grown(status, earlier, n) for n in Status._fields if n.startswith("dropped_")):
        what, remedy = (
            f"left out {dropped} messages {span}",
            "the host reads too slowly: close other programs, avoid a USB hub",
        )
        found.append(Finding(Severity.WARNING, "board", what, remedy))
    if recovered := _grown(status, earlier, "bus_recoveries"):
        what = f"was stuck and clocked free {recovered} times {span}"
        found.append(
            Finding(Severity.WARNING, "I2C bus", what, "check the pull-ups (2.2 kohm) and keep the cables short")
        )
    if bad := _grown(status, earlier, "bad_frames"):
        what = f"got {bad} damaged commands {span}"
        found.append(Finding(Severity.WARNING, "board", what, "does another program write to its port?"))
    if status.memory_used > MEMORY_MAX_BYTES:
        what = f"has used {status.memory_used} of 2560 bytes of memory"
        found.append(Finding(Severity.WARNING, "board", what, "report it, with the recording"))
    return found


_TESTS = {
    SelfTest.FAILED: (Severity.FAULT, "failed its self-test", "power-cycle the board; if it stays, replace the gyro"),
    SelfTest.NO_ANSWER: (Severity.FAULT, "did not answer during its self-test", "check its SPI cable and its 5 V"),
    SelfTest.MOVED: (
        Severity.WARNING,
        "was turning during its self-test, or one of ST1 (A0) and ST2 (A1) is not connected",
        "stand still and run echostep doctor; if it stays, check both wires",
    ),
    SelfTest.NOT_RUN: (Severity.NOTE, "was not tested since the board's watchdog restarted it", "run echostep doctor"),
}


def _gyro_tests(words: BoardWords) -> list[Finding]:
    found = []
    unhealthy = 0 if words.status is None else ~words.status.healthy
    for gyro, said in sorted(words.gyros.items()):
        device = Healthy[Gyro(gyro).name]
        if unhealthy & device or not words.sensors & device:
            continue  # that is said, or meant, already
        name, outcome = NAMES[device], SelfTest(said.self_test)
        if outcome in _TESTS:
            severity, what, remedy = _TESTS[outcome]
            found.append(Finding(severity, name, what + _responses(said), remedy))
        if said.temperature == INVALID:
            what = "answers, but not with its temperature: its MISO may be held low"
            found.append(Finding(Severity.FAULT, name, what, "check its SPI cable for a short to ground"))
        elif not TEMPERATURE_C[0] <= gyro_celsius(said) <= TEMPERATURE_C[1]:
            what = f"says it has {gyro_celsius(said):.0f} degrees Celsius"
            found.append(Finding(Severity.WARNING, name, what, "its bias drifts outside -20 to 60 degrees"))
    return found


def _responses(said: GyroHealth) -> str:
    if said.self_test not in (SelfTest.FAILED, SelfTest.MOVED) or INVALID in (said.response_st1, said.response_st2):
        return ""
    return f" (responses {said.response_st1} and {said.response_st2} counts; proper are -121 to -376 and 121 to 376)"


def gyro_celsius(said: GyroHealth) -> float:
    """Temperature of a gyro in degrees Celsius; 8.4 mV per degree [ADXRS300] in counts of 5 V / 4096."""
    return 25.0 + 0.1453 * said.temperature


def expected_rates(words: BoardWords) -> dict[str, float]:
    """Messages per second of each stream that is switched on, as the board is configured, by the message's name."""
    c, on = words.configuration, words.sensors
    schedule = Schedule.CONCURRENT if c is None else Schedule(c.schedule)
    mode = PressureMode.HIGH_SPEED if c is None else PressureMode(c.pressure_mode)
    rangers = (on & (Sensors.RANGER_LEFT | Sensors.RANGER_RIGHT)).bit_count()
    return {
        name: rate
        for name, rate, there in (
            ("Ping", PINGS_HZ[schedule] * rangers / 2, rangers),
            (
                "Gyros",
                200.0 if c is None else float(c.gyro_rate_hz),
                on & (Sensors.THIGH | Sensors.CALF | Sensors.BELT),
            ),
            ("Compass", 10.0 if c is None else float(c.compass_rate_hz), on & Sensors.COMPASS),
            ("Pressure", PRESSURE_HZ[mode], on & Sensors.PRESSURE),
        )
        if there
    }


_STREAMS = {
    "Ping": ("rangers", "pings", Healthy.RANGER_LEFT | Healthy.RANGER_RIGHT),
    "Gyros": ("gyros", "samples", Healthy(0)),
    "Compass": ("compass", "bearings", Healthy.COMPASS),
    "Pressure": ("barometer", "samples", Healthy.PRESSURE),
}


def rate_findings(words: BoardWords, rates_hz: Mapping[str, float]) -> list[Finding]:
    """Streams that come more slowly than configured, unless the status already says why."""
    found = []
    healthy = 0x7F if words.status is None else words.status.healthy
    for name, expected in expected_rates(words).items():
        subject, unit, devices = _STREAMS[name]
        got = rates_hz.get(name, 0.0)
        if got >= RATE_LEAST * expected or (devices and not healthy & devices):
            continue
        severity = Severity.FAULT if got < 0.5 * expected else Severity.WARNING
        what = f"{got:.1f} {unit}/s, expected are {expected:.1f}"
        found.append(Finding(severity, subject, what, "unplug the board and plug it in again; avoid a USB hub"))
    return found


def _suffix(device: Healthy) -> str:
    return (device.name or "").lower()


def _of(status: Status, what: str, device: Healthy) -> int:
    return int(getattr(status, f"{what}_{_suffix(device)}"))


def _errors(status: Status, device: Healthy) -> bool:
    return bool(_of(status, "errors", device) or _of(status, "fault", device))


def _grown(status: Status, earlier: Status, name: str) -> int:
    return int((getattr(status, name) - getattr(earlier, name)) & 0xFFFF)


def _span_s(status: Status, earlier: Status) -> float:
    return ((status.ticks - earlier.ticks) & 0xFFFFFFFF) * 0.5e-6


def _joined(devices: Iterable[Healthy]) -> Healthy:
    joined = Healthy(0)
    for device in devices:
        joined |= device
    return joined


def _listed(devices: Healthy) -> str:
    return ", ".join(NAMES[d] for d in Healthy if d & devices)
