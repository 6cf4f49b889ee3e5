"""What is wrong with the board, in words: what it is and what to do about it.

In: the board's words about itself, and what was counted while listening. Out: `Finding`s, the worst first. Owns nothing; the texts for single
devices are `device_findings`'.
"""

from __future__ import annotations

from collections.abc import Mapping

from echostep.board.device_faults import device_findings, gyro_celsius, gyro_findings
from echostep.board.findings import NAMES, SELECTS, BoardReports, Finding, Severity, grown, of, span_s, suffix
from echostep.board.messages import Fault, Healthy, PressureMode, ResetCause, Schedule, Sensors, Status

__all__ = [
    "NAMES", "SELECTS", "BoardReports", "Finding", "Severity", "board_findings", "expected_rates", "gyro_celsius", "rate_findings",
]  # fmt: skip

MEMORY_MAX_BYTES = 2200  # of 2560 [firmware/README.md, budgets]
RATE_LEAST = 0.9  # of what is expected; below half of it the stream is as good as gone
PINGS_HZ = {Schedule.CONCURRENT: 28.0, Schedule.SEQUENTIAL: 13.5}  # both rangers [firmware/README.md]
PRESSURE_HZ = {PressureMode.HIGH_SPEED: 9.0, PressureMode.HIGH_RESOLUTION: 1.8}


def board_findings(words: BoardReports) -> list[Finding]:
    """What the board says is wrong, the worst first; empty when all is well or it has not spoken yet."""
    found = _start(words) + gyro_findings(words)
    if words.status is not None:
        found += device_findings(words, words.status) + _sometimes(words) + _losses(words.status, words.earlier)
    return sorted(found, key=lambda finding: -finding.severity)


def _start(words: BoardReports) -> list[Finding]:
    cause = ResetCause(0 if words.identity is None else words.identity.reset_cause)
    if cause & ResetCause.WATCHDOG:
        what, remedy = "its watchdog has restarted it", "if it happens again, write down what was done and report it"
    elif cause & ResetCause.BROWN_OUT:
        what, remedy = "its supply was too low and it restarted", "use a shorter USB cable or a powered hub"
    else:
        return []
    return [Finding(Severity.WARNING, "board", what, remedy)]


def _sometimes(words: BoardReports) -> list[Finding]:
    """Devices that answer now and failed since the status before."""
    status, earlier = words.status, words.earlier
    if status is None or earlier is None:
        return []
    answering = words.sensors & status.healthy & 0x7F
    found = []
    for device in (d for d in Healthy if d & answering):
        if count := grown(status, earlier, f"errors_{suffix(device)}"):
            fault = Fault(of(status, "fault", device)).name.lower().replace("_", " ")
            what = f"failed {count} times in the last {span_s(status, earlier):.0f} s ({fault}), and answers again"
            found.append(Finding(Severity.WARNING, NAMES[device], what, "a loose plug? move the cable and watch"))
    return found


def _losses(status: Status, earlier: Status | None) -> list[Finding]:
    if earlier is None:
        return []
    found = []
    span = f"in the last {span_s(status, earlier):.0f} s"
    if dropped := sum(grown(status, earlier, n) for n in Status._fields if n.startswith("dropped_")):
        what, remedy = (
            f"left out {dropped} messages {span}",
            "the host reads too slowly: close other programs, avoid a USB hub",
        )
        found.append(Finding(Severity.WARNING, "board", what, remedy))
    if recovered := grown(status, earlier, "bus_recoveries"):
        what = f"was stuck and clocked free {recovered} times {span}"
        found.append(
            Finding(Severity.WARNING, "I2C bus", what, "check the pull-ups (2.2 kohm) and keep the cables short")
        )
    if bad := grown(status, earlier, "bad_frames"):
        what = f"got {bad} damaged commands {span}"
        found.append(Finding(Severity.WARNING, "board", what, "does another program write to its port?"))
    if status.memory_used > MEMORY_MAX_BYTES:
        what = f"has used {status.memory_used} of 2560 bytes of memory"
        found.append(Finding(Severity.WARNING, "board", what, "report it, with the recording"))
    return found


def expected_rates(words: BoardReports) -> dict[str, float]:
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


def rate_findings(words: BoardReports, rates_hz: Mapping[str, float]) -> list[Finding]:
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
