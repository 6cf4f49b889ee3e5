# SPDX-License-Identifier: MIT
"""What is said of damage: ports that a recording seems to lack, and what is noted in one that is made of a damaged one.

In: the ports with readable bytes, the topics of channels that are not named as they should. Out: sentences. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from pathlib import Path

from echostep.ports.chunks import BOARD, FOOT, MTX

MISPLACED = "{} messages stand twice in the file, or not where they were written: they were not used"


def missing_ports(ports: Collection[str], misnamed: Collection[str]) -> list[str]:
    """A sentence for each channel whose name is damaged, and for the board and the foot's sensor where nothing of them can be read."""
    lines = [f"the channel {topic} is damaged: the bytes of its port were not used" for topic in sorted(misnamed)]
    for names in ((BOARD,), (MTX, FOOT)) if set(ports) & {BOARD, MTX, FOOT} else ():  # not of an operation
        if not set(names) & set(ports):
            lines.append(
                f"no bytes of {' or '.join(names)} can be read: nothing came, or the port's channel is damaged"
            )
    return lines


def made_of(path: Path, damage: Iterable[str]) -> list[str]:
    """The damage of a recording as it is noted in another one that is made of it."""
    return [f"of {path.name}, of which it was made: {line}" for line in damage]
