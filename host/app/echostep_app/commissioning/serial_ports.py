# SPDX-License-Identifier: MIT
"""The serial ports of this computer: which is the board, which the MTx, and whether this user may open them.

In: the system's list of ports, /sys and /proc; where these are not enough, bytes from the ports. Out: `PortSeen`s, paths, and `Finding`s about
them. Owns the ports while it listens; it writes nothing to them.
"""

from __future__ import annotations

import contextlib
import os
import time
from dataclasses import dataclass
from enum import Enum
from importlib.resources import files
from pathlib import Path

from serial.tools import list_ports

from echostep.errors import EchostepError
from echostep.ports.chunks import BOARD, FOOT, MTX
from echostep_app.board.faults.health import Finding, Severity
from echostep_app.commissioning.probe import BAUD
from echostep_app.ports.access import TAKERS, holders, is_url, refusal, taker_of
from echostep_app.ports.serial_ports import SerialPorts
from echostep_app.recording.device import LISTENED_BYTES, sender

BOARD_NAME, MTX_NAME = Path("/dev/echostep"), Path("/dev/echostep-mtx")  # links made by the udev rules
RULES = "99-echostep.rules"
RULE_FOLDERS = tuple(
    map(Path, ("/etc/udev/rules.d", "/run/udev/rules.d", "/usr/lib/udev/rules.d", "/lib/udev/rules.d"))
)
# Maker and product: they count, whatever the identifier is [firmware/avr/usb_descriptors.c]
BOARD_NAMES = ("echostep", "sensor board")
# Where the system gives no names; pid.codes reserves it for tests, and others use it too
BOARD_IDS = {(0x1209, 0x0001)}
BOOTLOADER_IDS = {
    (0x2341, 0x0036),
    (0x2341, 0x0037),
    (0x2341, 0x0237),
    (0x2A03, 0x0036),
    (0x2A03, 0x0037),
    (0x1B4F, 0x9205),
}
SKETCH_IDS = {
    (0x2341, 0x8036),
    (0x2341, 0x8037),
    (0x2341, 0x8237),
    (0x2A03, 0x8036),
    (0x2A03, 0x8037),
    (0x1B4F, 0x9206),
}
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
    """The stable name if it exists, else the first port in this role, or None."""
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
    remedy = (
        taker_of([name for name in TAKERS if name in what], processes)
        or "close that program: it takes bytes of the port"
    )
    return [Finding(Severity.WARNING, subject, what, remedy)]


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


SEARCH_S = 2.0  # longest time to listen: an MTx that has just been plugged in wakes up in 0.5 s
ROLES = {Role.BOARD: BOARD, Role.MTX: MTX}


@dataclass(frozen=True, slots=True)
class FoundPorts:
    """Paths; `mtx`, `foot` None if missing. At most one of these is not None."""

    board: str
    mtx: str | None
    foot: str | None


def find_ports(mtx: str | None = None, foot: str | None = None) -> FoundPorts:
    """The board's port and, unless it is given, the foot sensor's port; raises EchostepError without a board, or with two of a kind."""
    seen = [port for port in list_seen() if port.path not in (mtx, foot)]
    roles, notes = listen([port.path for port in seen])
    for port in seen:
        if port.path not in roles and port.path not in notes and port.role in ROLES:
            roles[port.path] = ROLES[port.role]
    boards, mtxs, feet = ([path for path, device in roles.items() if device == kind] for kind in (BOARD, MTX, FOOT))
    if len(boards) != 1:
        what = "several boards are plugged in" if boards else "no sensor board was found"
        raise EchostepError(f"{what}{_listed(seen, roles, notes)}: name its port with --board; see echostep doctor")
    if mtx is not None or foot is not None:
        return FoundPorts(boards[0], mtx, foot)
    if len(mtxs) + len(feet) > 1:
        what = "several MTx" if not feet else "several foot boards" if not mtxs else "an MTx and a foot board"
        raise EchostepError(
            f"{what}{_listed(seen, roles, notes)}: name the port of the one on the foot with --mtx or --foot"
        )
    return FoundPorts(boards[0], mtxs[0] if mtxs else None, feet[0] if feet else None)


def find_boards(seen: list[PortSeen], board: str | None, foot: str | None) -> tuple[str | None, str | None]:
    """The ports of belt board and foot board among those seen; several boards are distinguished by the messages that they send."""
    paths = [port.path for port in seen if port.role is Role.BOARD and port.path not in (board, foot)]
    if len(paths) + (board is not None) + (foot is not None) < 2 or not paths:
        return board or find([port for port in seen if port.path != foot], Role.BOARD, BOARD_NAME), foot
    devices, _ = listen(paths)
    belts, ankles = ([path for path in paths if devices.get(path) == device] for device in (BOARD, FOOT))
    return board or (belts[0] if belts else None), foot or (ankles[0] if ankles else None)


def listen(paths: list[str]) -> tuple[dict[str, str], dict[str, str]]:
    """Which device each port has, by its bytes; and why a port could not be opened."""
    opened: list[SerialPorts] = []
    roles: dict[str, str] = {}
    notes: dict[str, str] = {}
    try:
        for path in paths:
            try:
                opened.append(SerialPorts({path: path}, {path: BAUD[BOARD]}))
            except EchostepError as error:
                notes[path] = str(error)
        received = {path: b"" for path in paths if path not in notes}
        end_s = time.monotonic() + SEARCH_S
        while time.monotonic() < end_s and len(roles) < len(received):
            for ports in opened:
                chunk = next(ports.chunks())
                if chunk is None or chunk.port in roles or len(received[chunk.port]) > LISTENED_BYTES:
                    continue
                received[chunk.port] += chunk.data
                if device := sender(received[chunk.port]):
                    roles[chunk.port] = device
    finally:
        for ports in opened:
            ports.close()
    return roles, notes


def _listed(seen: list[PortSeen], roles: dict[str, str], notes: dict[str, str]) -> str:
    """The device on each port, in brackets."""
    if not seen:
        return " (no USB serial port is plugged in)"
    words = {BOARD: "a board", MTX: "an MTx", FOOT: "a foot board"}
    listed = [
        f"{port.name}: {notes.get(port.path) or words.get(roles.get(port.path, ''), 'something else')}" for port in seen
    ]
    return f" ({'; '.join(listed)})"
