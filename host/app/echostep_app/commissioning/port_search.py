# SPDX-License-Identifier: MIT
"""The ports of the boards and the MTx, found by what comes from them.

In: the USB serial ports of this computer. Out: the ports' paths; EchostepError that lists what each port is. Owns the ports while it listens;
it writes nothing to them. A port that is silent counts by its USB identifiers.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

from echostep.errors import EchostepError
from echostep.ports.chunks import BOARD, FOOT, MTX
from echostep_app.commissioning.probe import BAUD
from echostep_app.commissioning.serial_ports import BOARD_NAME, PortSeen, Role, find, list_seen
from echostep_app.ports.serial_ports import SerialPorts
from echostep_app.recording.device import LISTENED_BYTES, sender

SEARCH_S = 2.0  # longest time to listen: an MTx that has just been plugged in wakes up in 0.5 s
ROLES = {Role.BOARD: BOARD, Role.MTX: MTX}


@dataclass(frozen=True, slots=True)
class FoundPorts:
    """Paths; `mtx`, `foot` None: there is none. At most one of these is not None."""

    board: str
    mtx: str | None
    foot: str | None


def find_ports(mtx: str | None = None, foot: str | None = None) -> FoundPorts:
    """The board's port and, unless it is given, that of what is on the foot; raises EchostepError without a board, or with two of a kind."""
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
    """What each port is, in brackets."""
    if not seen:
        return " (no USB serial port is plugged in)"
    words = {BOARD: "a board", MTX: "an MTx", FOOT: "a foot board"}
    listed = [
        f"{port.name}: {notes.get(port.path) or words.get(roles.get(port.path, ''), 'something else')}" for port in seen
    ]
    return f" ({'; '.join(listed)})"
