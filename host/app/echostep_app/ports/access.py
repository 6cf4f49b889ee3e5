# SPDX-License-Identifier: MIT
"""Whether this user may open a serial port, and which program has it already.

In: a port's path, /proc. Out: `Refusal`s, holders as text. Opens no port.
"""

from __future__ import annotations

import contextlib
import os
from dataclasses import dataclass
from pathlib import Path

LONGEST_COMMAND = 60  # characters that are shown of a command


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


def refusal(port: str) -> Refusal | None:
    """Why this user cannot open the port; None when it can be tried. Raises nothing."""
    path = Path(port)
    if is_url(port) or port == "-" or os.name != "posix":
        return None
    if not path.exists():
        remedy = "plug it in and look again; see which ports there are: ls /dev/serial/by-id"
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


def _command(process: Path) -> str:
    """The command of a process, shortened; its name if it shows none."""
    with contextlib.suppress(OSError):
        words = (process / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace").strip()
        if words:
            return words if len(words) <= LONGEST_COMMAND else f"{words[:LONGEST_COMMAND]}..."
    return (process / "comm").read_text().strip()
