# SPDX-License-Identifier: MIT
"""Runs of the real firmware in the twin, for the tests: a board, what the host decodes, and the truth about the buses."""

from __future__ import annotations

import shutil
import sys
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from echostep.board import messages as m
from echostep.board.frames import BoardReader, encode
from echostep.board.reports import SUBSCRIBE, BoardReports
from echostep_simulation.devices.board import BoardProcess
from echostep_simulation.stimulus import NO_SYNC, ROW
from layers import needs

ROOT = Path(__file__).resolve().parent.parent
TWIN = ROOT / "tools/twin/build/echostep-twin"
ELF = ROOT / "firmware/build/echostep.elf"

needs_twin = needs(
    "twin",
    missing=not (TWIN.exists() and ELF.exists()),
    reason="the twin is not built: gcc-avr or libsimavr-dev is missing (make test installs them when it may)"
    if not shutil.which("avr-gcc")
    else "the twin is not built: make -C firmware; make -C tools/twin",
)


def tool(name: str) -> list[str]:
    """The command that starts a tool of tools/, as the Makefile does; it becomes the tool's own process."""
    return ["env", f"PYTHONPATH={ROOT / 'tools'}:{ROOT / 'tests'}:{ROOT / 'tests/app'}", sys.executable, "-m", name]


def quiet_rows(milliseconds: int) -> NDArray[Any]:
    """Rows of somebody who stands between two walls, SyncOut at 100 Hz."""
    rows = np.zeros(milliseconds, ROW)
    rows["own_us"] = [5831, 7000]
    rows["thigh"], rows["calf"], rows["belt"] = 41, -82, 5
    rows["bearing"], rows["pressure"], rows["temperature"] = 900, 405_296, 400
    rows["sync_us"] = NO_SYNC
    rows["sync_us"][::10] = 333
    return rows


@dataclass
class Bench:
    """A twin that runs, and everything that the host has understood so far."""

    board: BoardProcess = field(default_factory=lambda: BoardProcess([str(TWIN), "--elf", str(ELF)]))
    reader: BoardReader = field(default_factory=BoardReader)
    messages: list[m.Message] = field(default_factory=list)
    sent: list[tuple[int, bytes]] = field(default_factory=list)
    asked: int = 0

    def run(self, milliseconds: int, rows: NDArray[Any] | None = None) -> list[m.Message]:
        """Let time pass; the messages of that time."""
        new: list[m.Message] = []
        for t_ns, part in self.board.advance(quiet_rows(milliseconds) if rows is None else rows):
            self.sent.append((t_ns, part))
            new += self.reader.feed(part)
        self.messages += new
        return new

    def ask(self, message: m.Message) -> None:
        """Send a message to the board."""
        self.board.send(encode(message, self.asked))
        self.asked += 1

    def subscribe(self, rows: Callable[[int], NDArray[Any]] = quiet_rows) -> None:
        """Ask the board for its optional messages, once it has started."""
        self.run(300, rows(300))
        self.ask(SUBSCRIBE)

    def fault(self, *switches: str) -> None:
        """Throw fault switches."""
        for switch in switches:
            self.board.fault(switch)

    @property
    def reports(self) -> BoardReports:
        """What the host keeps of all messages so far."""
        kept = BoardReports()
        for message in self.messages:
            kept.add(message)
        return kept

    @property
    def status(self) -> m.Status:
        """The newest status."""
        return next(x for x in reversed(self.messages) if isinstance(x, m.Status))

    @property
    def parts(self) -> m.Parts:
        """The newest report of the parts, which must have been subscribed to."""
        return next(x for x in reversed(self.messages) if isinstance(x, m.Parts))


def kinds(found: list[m.Message]) -> Counter[str]:
    """How many of each message."""
    return Counter(type(x).__name__ for x in found)


def pings(found: list[m.Message], ranger: m.Ranger) -> list[m.Ping]:
    """The pings of one ranger."""
    return [x for x in found if isinstance(x, m.Ping) and x.ranger == ranger]
