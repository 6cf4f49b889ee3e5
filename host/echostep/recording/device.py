# SPDX-License-Identifier: MIT
"""Which device sent these bytes: the sensor board or an MTx.

In: the first bytes of a port. Out: the name of the port that such a device belongs to; words about a device at the wrong one. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Mapping

from echostep.board.frames import BoardReader, StaleFirmwareError
from echostep.ports.chunks import BOARD, MTX
from echostep.xsens import FrameReader

DEVICES = {BOARD: "the sensor board", MTX: "the MTx"}
LEAST_FRAMES = 3  # by reason: one of 256 wrong frames of an MTx passes its checksum
LISTENED_BYTES = 1 << 14  # by which a device has sent so many frames: half a second of a board, two of an MTx


def sender(received: bytes) -> str | None:
    """`BOARD` or `MTX`; None while neither is certain. A board whose firmware does not fit is a board."""
    reader = BoardReader()
    try:
        reader.frames(received)
    except StaleFirmwareError:
        return BOARD
    if reader.counts.good >= LEAST_FRAMES:
        return BOARD
    return MTX if not reader.counts.good and len(FrameReader().feed(received)) >= LEAST_FRAMES else None


def wrong_device(name: str, urls: Mapping[str, str]) -> str:
    """What to do when the port `name` has the other device."""
    other = MTX if name == BOARD else BOARD
    what = f"{urls[name]} is {DEVICES[other]}, not {DEVICES[name]}"
    if other not in urls:
        return f"{what}: name its port with --{other} {urls[name]}, and the other device's with --{name}"
    right = {name: urls[other], other: urls[name]}
    return f"{what}: the ports are swapped: give --{BOARD} {right[BOARD]} --{MTX} {right[MTX]}"
