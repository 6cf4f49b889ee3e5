# SPDX-License-Identifier: MIT
"""The types and names of findings on the board's health.

In: the board's reports. Out: their contents about a device. Owns the names.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from echostep.board.messages import (
    Healthy,
    Part,
    Status,
)
from echostep.board.reports import BoardReports
from echostep.timing.timeline import TICK_S


class Severity(IntEnum):
    """Severity: a note needs no action, a warning costs accuracy, a fault costs a sensor."""

    NOTE = 0
    WARNING = 1
    FAULT = 2


@dataclass(frozen=True, slots=True)
class Finding:
    """One problem: the part, its fault, and the remedy."""

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
PART_NAMES = {
    Part.NONE: "no part",
    Part.SRF02: "SRF02",
    Part.PULSE: "pulse ranger",
    Part.MAXSONAR: "MaxSonar",
    Part.CMPS10: "CMPS10",
    Part.LIS3MDL: "LIS3MDL",
    Part.ADIS16100: "ADIS16100",
    Part.LSM6DSO: "LSM6DSO",
    Part.ICM20649: "ICM-20649",
    Part.SCP1000: "SCP1000",
    Part.BMP390: "BMP390",
}
OF_THE_PAPERS = (Part.NONE, Part.SRF02, Part.CMPS10, Part.ADIS16100, Part.SCP1000)
DEVICES = 0x7F  # mask of all devices in `Healthy` and `Sensors`
ON_I2C = Healthy.RANGER_LEFT | Healthy.RANGER_RIGHT | Healthy.COMPASS
GYROS = Healthy.THIGH | Healthy.CALF | Healthy.BELT
ADDRESSES = {  # on I2C, 7 bits
    Healthy.RANGER_LEFT: 0x70,
    Healthy.RANGER_RIGHT: 0x71,
    Healthy.COMPASS: 0x60,
}
# Pins of the chip selects [firmware/README.md]
SELECTS = {Healthy.THIGH: "D8", Healthy.CALF: "D9", Healthy.BELT: "D10"}


def part_in(reports: BoardReports, device: Healthy) -> Part:
    """The part that the board has found in a place; `Part.NONE` before its report, and for a part that this host does not know."""
    number = 0 if reports.parts is None else getattr(reports.parts, f"part_{field_suffix(device)}")
    return Part(number) if number in tuple(Part) else Part.NONE


def identity_in(reports: BoardReports, device: Healthy) -> int:
    """Content of the identity register in a place; 0 without one."""
    return 0 if reports.parts is None else int(getattr(reports.parts, f"identity_{field_suffix(device)}"))


def part_text_of(reports: BoardReports, device: Healthy) -> str:
    """The part in a place with its identity: `BMP390, identity 0x60`; "" before the board's report."""
    if reports.parts is None:
        return ""
    identity = identity_in(reports, device)
    register = f", identity 0x{identity:02X}" if identity else ""
    return PART_NAMES[part_in(reports, device)] + register


def name_of(reports: BoardReports, device: Healthy) -> str:
    """A device with the part that was found in its place, if it is not the papers' part: `barometer (BMP390)`."""
    part = part_in(reports, device)
    return NAMES[device] if part in OF_THE_PAPERS else f"{NAMES[device]} ({PART_NAMES[part]})"


def field_suffix(device: Healthy) -> str:
    """A device's name in the fields of `Status`."""
    return (device.name or "").lower()


def status_field(status: Status, prefix: str, device: Healthy) -> int:
    """The field `errors_...` or `fault_...` of a device."""
    return int(getattr(status, f"{prefix}_{field_suffix(device)}"))


def has_failed(status: Status, device: Healthy) -> bool:
    """Whether an access to the device ever failed; false before the first access."""
    return bool(status_field(status, "errors", device) or status_field(status, "fault", device))


def increase(status: Status, previous: Status, name: str) -> int:
    """Increase of a u16 counter, which may wrap."""
    return int((getattr(status, name) - getattr(previous, name)) & 0xFFFF)


def span_s(status: Status, previous: Status) -> float:
    """Time between two statuses, in seconds."""
    return ((status.ticks - previous.ticks) & 0xFFFFFFFF) * TICK_S
