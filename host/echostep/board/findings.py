"""The words of a finding, and what the board has said about itself.

In: the board's messages. Out: `BoardReports`, `Finding`s that others fill. Owns the newest words and the status before.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum

from echostep.board.messages import Configuration, GyroHealth, Healthy, Identity, Message, Sensors, Status


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


@dataclass(slots=True)
class BoardReports:
    """The board's newest words about itself, and the status before: what has grown since is news."""

    identity: Identity | None = None
    configuration: Configuration | None = None
    status: Status | None = None
    earlier: Status | None = None
    gyros: dict[int, GyroHealth] = field(default_factory=dict)

    def add(self, message: Message) -> None:
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


def suffix(device: Healthy) -> str:
    """A device's name in the fields of `Status`."""
    return (device.name or "").lower()


def of(status: Status, what: str, device: Healthy) -> int:
    """`errors_...` or `fault_...` of a device."""
    return int(getattr(status, f"{what}_{suffix(device)}"))


def has_failed(status: Status, device: Healthy) -> bool:
    """Whether a device ever failed; one that was not asked yet did not."""
    return bool(of(status, "errors", device) or of(status, "fault", device))


def grown(status: Status, earlier: Status, name: str) -> int:
    """What a counter has grown by; it wraps."""
    return int((getattr(status, name) - getattr(earlier, name)) & 0xFFFF)


def span_s(status: Status, earlier: Status) -> float:
    """Time between two statuses."""
    return ((status.ticks - earlier.ticks) & 0xFFFFFFFF) * 0.5e-6
