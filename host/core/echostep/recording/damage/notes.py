# SPDX-License-Identifier: MIT
"""Sentences about damage: of the file, of ports that a recording seems to lack, and as noted in a recording made from a damaged one.

In: ranges without valid records, other counts of a reader, the ports with readable bytes, the topics of wrongly named channels.
Out: sentences, the same for every command. Owns the counts of damage.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import astuple, dataclass
from pathlib import Path

from echostep.ports.chunks import BOARD, FOOT, MTX


@dataclass
class FileDamage:
    """Damage of one file, as far as it was read."""

    altered: bool = False  # bytes do not match the checksum written with them
    skipped: int = 0  # bytes in no valid record, before a valid one
    places: int = 0  # number of places with such bytes
    first: int = 0  # offset of the first place
    tail: int = 0  # bytes after the last valid record
    unreadable_chunks: int = 0  # chunk records that cannot be decompressed, or hold anything but records
    misplaced: int = 0  # duplicated or displaced messages
    truncated: bool = False  # no end record: a walk's recorder was stopped in the middle

    def __bool__(self) -> bool:
        return any(astuple(self))

    def skip(self, begin: int, end: int, size: int) -> None:
        """Count a range without valid records, of a file of `size` bytes."""
        if end == size:
            self.tail = end - begin
            return
        self.first = self.first if self.places else begin
        self.places += 1
        self.skipped += end - begin

    def sentences(self, ports: Collection[str], misnamed: Collection[str]) -> list[str]:
        """A sentence for each kind of damage, with its possible consequences; none for an undamaged file."""
        in_places = f"in {self.places} places" if self.places > 1 else "in one place"
        tail = f", or its last {self.tail} bytes are damaged" if self.tail else ""
        facts = [
            (self.altered, "its checksum is wrong: bytes have changed since it was written"),
            (self.places, f"{self.skipped} damaged bytes {in_places} were not used, the first at byte {self.first}"),
            (
                self.unreadable_chunks,
                f"{self.unreadable_chunks} compressed chunks cannot be opened, or not be read to their end",
            ),
            (
                self.misplaced,
                f"{self.misplaced} messages stand twice in the file, or not where they were written: they were not used",
            ),
            (self.truncated, f"it has no end record: it was not closed{tail}; all before was used"),
        ]
        lines = [text for applies, text in facts if applies]
        return [*lines, *(missing_ports(ports, misnamed) if self else ())]


def missing_ports(ports: Collection[str], misnamed: Collection[str]) -> list[str]:
    """A sentence for each channel whose name is damaged, and for the board and the foot's sensor if none of their bytes can be read."""
    lines = [f"the channel {topic} is damaged: the bytes of its port were not used" for topic in sorted(misnamed)]
    for names in ((BOARD,), (MTX, FOOT)) if set(ports) & {BOARD, MTX, FOOT} else ():  # not for an operation
        if not set(names) & set(ports):
            lines.append(
                f"no bytes of {' or '.join(names)} can be read: nothing came, or the port's channel is damaged"
            )
    return lines


def made_of(path: Path, damage: Iterable[str]) -> list[str]:
    """The damage of a recording as it is noted in another recording made from it."""
    return [f"of {path.name}, of which it was made: {line}" for line in damage]
