# SPDX-License-Identifier: GPL-3.0-or-later
"""The firmware with a clock that starts near one of its wraps.

In: the clock's first value, ticks. Out: an ELF in the given folder. Owns where the wraps are.
"""

from __future__ import annotations

import subprocess
from pathlib import Path

from places import ROOT

# Of Timer1; where comparisons of two times turn round; of the clock
TIMER_WRAP, HALF_WRAP, WRAP = 1 << 16, 1 << 31, 1 << 32
BUILD_MAX_S = 120.0


def late_firmware(ticks: int, folder: Path) -> Path:
    """The firmware of this checkout whose clock starts at `ticks`; needs avr-gcc."""
    elf = folder / "echostep.elf"
    command = ["make", "-s", "-C", str(ROOT / "firmware"), f"BUILD={folder}", f"CLOCK_START={ticks}ul", str(elf)]
    subprocess.run(command, check=True, timeout=BUILD_MAX_S)
    return elf
