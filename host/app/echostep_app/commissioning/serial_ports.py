# SPDX-License-Identifier: MIT
"""The serial ports of this computer: which is the board, which the MTx, and whether this user may open them.

In: the system's list of ports, /sys and /proc. Out: `PortSeen`s, and `Finding`s about them. Opens nothing.
"""

from __future__ import annotations

import contextlib
import os
from dataclasses import dataclass
from enum import Enum
from importlib.resources import files
from pathlib import Path

from serial.tools import list_ports

from echostep_app.board.faults.health import Finding, Severity
from echostep_app.ports.access import holders, is_url, refusal

BOARD_NAME, MTX_NAME = Path("/dev/echostep"), Path("/dev/echostep-mtx")  # links made by the udev rules
RULES = "99-echostep.rules"
RULE_FOLDERS = tuple(
    map(Path, ("/etc/udev/rules.d", "/run/udev/rules.d", "/usr/lib/udev/rules.d", "/lib/udev/rules.d"))
)
# Maker and product: they count, whatever the identifier is [firmware/avr/usb_descriptors.c]
BOARD_NAMES = ("echostep", "sensor board")
# Where the system tells no names; pid.codes reserves it for tests, and others use it too
BOARD_IDS = {(0x1209, 0x0001)}
BOOTLOADER_IDS = {(0x2341, 0x0036), (0x2341, 0x0037), (0x2A03, 0x0036), (0x2A03, 0x0037), (0x1B4F, 0x9205)}
SKETCH_IDS = {(0x2341, 0x8036), (0x2341, 0x8037), (0x2A03, 0x8036), (0x2A03, 0x8037), (0x1B4F, 0x9206)}
FTDI, XSENS = 0x0403, 0x2639
FTDI_IDS = {0x6001, *range(0xD388, 0xD390)}  # FT232R; Xsens' converters [Linux, ftdi_sio_ids.h]
LATENCY_MAX_MS = 1


class Role(Enum):
    """The device on a port, by its USB identifiers."""

    BOARD = "sensor board"
    BOOTLOADER = "sensor board in its bootloader"
    SKETCH = "ATmega32U4 board with another program"
    MTX = "MTx, or another FTDI adapter"
    OTHER = "something else"


@dataclass(frozen=True, slots=True)
class PortSeen:
    """A serial port, and the device on it."""

    path: str
    role: Role
    text: str
    serial_number: str = ""

    @property
    def name(self) -> str:
        """The path, with the serial number of a sensor board: two boards differ by it."""
        return (
            f"{self.path}, number {self.serial_number}" if self.role is Role.BOARD and self.serial_number else self.path
        )


def list_seen() -> list[PortSeen]:
    """The USB serial ports of this computer."""
    return [
        PortSeen(
            port.device,
            _role(port.vid, port.pid, port.manufacturer, port.product),
            port.description or "",
            port.serial_number or "",
        )
        for port in sorted(list_ports.comports())
        if port.vid is not None
    ]


def _role(vendor: int, product: int, maker: str | None, name: str | None) -> Role:
    if (maker, name) == BOARD_NAMES or ((vendor, product) in BOARD_IDS and name is None):
        return Role.BOARD
    for role, identifiers in ((Role.BOOTLOADER, BOOTLOADER_IDS), (Role.SKETCH, SKETCH_IDS)):
        if (vendor, product) in identifiers:
            return role
    return Role.MTX if vendor == XSENS or (vendor == FTDI and product in FTDI_IDS) else Role.OTHER


def find(seen: list[PortSeen], role: Role, name: Path) -> str | None:
    """The stable name if it exists, else the first port in this role; None when there is none."""
    if name.exists():
        return str(name)
    return next((port.path for port in seen if port.role is role), None)


def access_findings(subject: str, port: str) -> list[Finding]:
    """Why this user cannot open the port; empty when it can be opened. Raises nothing."""
    refused = refusal(port)
    return [Finding(Severity.FAULT, subject, refused.what, refused.remedy)] if refused else []


def holder_findings(subject: str, port: str, processes: Path = Path("/proc")) -> list[Finding]:
    """Other programs that have the port open: each byte reaches only one of them. A pseudo terminal is always open in its simulator."""
    if is_url(port) or os.path.realpath(port).startswith("/dev/pts/"):
        return []
    held = holders(port, processes)
    if not held:
        return []
    what = f"{port} is also open in {', '.join(held)}"
    return [Finding(Severity.WARNING, subject, what, "close that program: it takes bytes of the port")]


def latency_findings(subject: str, port: str, system: Path = Path("/sys")) -> list[Finding]:
    """Whether the latency timer of an FTDI adapter is above LATENCY_MAX_MS; its default is 16 ms."""
    name = Path(os.path.realpath(port)).name
    try:
        latency_ms = int((system / "bus/usb-serial/devices" / name / "latency_timer").read_text())
    except (OSError, ValueError):
        return []
    if latency_ms <= LATENCY_MAX_MS:
        return []
    what = f"its adapter delays bytes by up to {latency_ms} ms"
    remedy = f"install the udev rules (echostep doctor --udev), or now: echo 1 | sudo tee /sys/bus/usb-serial/devices/{name}/latency_timer"
    return [Finding(Severity.WARNING, subject, what, remedy)]


def rules_text() -> str:
    """The udev rules that come with this package."""
    return (files("echostep_app") / "firmware" / RULES).read_text(encoding="utf-8")


def rules_findings(folders: tuple[Path, ...] = RULE_FOLDERS) -> list[Finding]:
    """Whether the udev rules of this version are installed."""
    rules = next((folder / RULES for folder in folders if (folder / RULES).exists()), None)
    remedy = f"echostep doctor --udev | sudo tee /etc/udev/rules.d/{RULES} && sudo udevadm control --reload && sudo udevadm trigger"
    if rules is None:
        what = "are not installed: no stable names (/dev/echostep, /dev/echostep-mtx), no low latency for the MTx"
        return [Finding(Severity.NOTE, "udev rules", what, remedy)]
    with contextlib.suppress(OSError, UnicodeDecodeError):
        if rules.read_text(encoding="utf-8", errors="replace").strip() == rules_text().strip():
            return []
    return [Finding(Severity.NOTE, "udev rules", f"{rules} is of another version", remedy)]
