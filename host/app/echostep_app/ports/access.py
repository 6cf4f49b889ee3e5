# SPDX-License-Identifier: MIT
"""Whether this user may open a serial port, which program has it already, and the USB serial number by which its device is found again.

In: a port's path, /proc, the system's list of ports. Out: `Refusal`s, holders as text, numbers. Opens no port.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import serial
from serial.tools import list_ports

try:
    from termios import error as _terminal_error  # not an OSError; pyserial passes it on when a port goes away
except ImportError:  # Windows has no termios
    _terminal_error = OSError  # type: ignore[misc, assignment]

PORT_FAULTS = (serial.SerialException, OSError, ValueError, NotImplementedError, _terminal_error)
"""ValueError: a setting or a URL that pyserial refuses. NotImplementedError: a setting that a kind of URL lacks."""
LONGEST_COMMAND = 60  # characters that are shown of a command
# Services of Linux that open ports of others, by the name of their process, and how to end that.
TAKERS = {
    "brltty": "brltty takes USB serial adapters for braille displays: sudo apt remove brltty, then plug it in again",
    "ModemManager": "ModemManager asks each new port whether it is a modem: sudo systemctl stop ModemManager, or echostep doctor --udev",
}


@dataclass(frozen=True, slots=True)
class Refusal:
    """Why a port cannot be opened, and the remedy."""

    what: str
    remedy: str

    def __str__(self) -> str:
        return f"{self.what}; {self.remedy}"


def is_url(port: str) -> bool:
    """Whether it is a pyserial URL, not a device file."""
    return "://" in port


def refusal(port: str, processes: Path = Path("/proc")) -> Refusal | None:
    """Why this user cannot open the port; None when it can be tried. Raises nothing."""
    path = Path(port)
    if is_url(port) or port == "-" or os.name != "posix":
        return None
    if not path.exists():
        remedy = "plug it in and look again; see which ports there are: ls /dev/serial/by-id"
        if (taker := taker_of(["brltty"], processes)) and path.is_relative_to("/dev"):
            remedy += f"; {taker}"
        return Refusal(f"{port}: there is no such port", remedy)
    if not path.is_char_device():
        return Refusal(f"{port} is no serial port", "name one such as /dev/ttyACM0")
    if os.access(path, os.R_OK | os.W_OK):
        return None
    group = path.group()
    what = f"{port}: this user may not open it (it belongs to {path.owner()}:{group})"
    remedy = f"sudo usermod -aG {group} $USER, then log out and in; or install the udev rules (echostep doctor --udev)"
    return Refusal(what, remedy)


def holders(port: str, processes: Path = Path("/proc")) -> list[str]:
    """Other processes of this computer that have the port open, as `command (process 77)`; other users' processes cannot be seen."""
    held = []
    target = os.path.realpath(port)
    for folder in sorted(processes.glob("[0-9]*")):
        if folder.name == str(os.getpid()):
            continue
        with contextlib.suppress(OSError):
            if any(os.path.realpath(link) == target for link in (folder / "fd").iterdir()):
                held.append(f"{_command(folder)} (process {folder.name})")
    return held


def taker_of(names: Iterable[str] = TAKERS, processes: Path = Path("/proc")) -> str:
    """How to end a service of these names that runs, and takes ports; empty when none does. Processes of other users show their names, too."""
    running = set()
    for comm in processes.glob("[0-9]*/comm"):
        with contextlib.suppress(OSError):
            running.add(comm.read_text().strip())
    return next((TAKERS[name] for name in names if name in TAKERS and name in running), "")


def _command(process: Path) -> str:
    """The command of a process, shortened; its name if it shows none."""
    with contextlib.suppress(OSError):
        words = (process / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace").strip()
        if words:
            return words if len(words) <= LONGEST_COMMAND else f"{words[:LONGEST_COMMAND]}..."
    return (process / "comm").read_text().strip()


def usb_number(port: str) -> str:
    """The serial number of the device on a port; empty where it has none, or shares it with another one."""
    device, seen = os.path.realpath(port), list_ports.comports()
    number = next((each.serial_number or "" for each in seen if each.device == device), "")
    return number if sum(each.serial_number == number for each in seen) == 1 else ""


def port_of_number(number: str) -> str | None:
    """The port of the device with this serial number; None while it is not plugged in."""
    return next((each.device for each in list_ports.comports() if each.serial_number == number), None)
