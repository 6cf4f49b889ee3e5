# SPDX-License-Identifier: MIT
"""Which device sent these bytes: the sensor board, a foot board or an MTx.

In: the first bytes of a port. Out: the name of the port that such a device belongs to; words about a device at the wrong one. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Mapping

from echostep.board.frames import BoardReader, Frames, StaleFirmwareError
from echostep.board.messages import (
    BY_ID,
    BoardHealth,
    ClockReply,
    Configuration,
    Electrical,
    Foot,
    FootHealth,
    Identity,
    Parts,
    Status,
)
from echostep.ports.chunks import BOARD, FOOT, MTX
from echostep.xsens import FrameReader

DEVICES = {BOARD: "the sensor board", MTX: "the MTx", FOOT: "the foot board"}
LEAST_FRAMES = 3  # one of 256 wrong frames of an MTx passes its checksum
LISTENED_BYTES = 1 << 14  # within which a device has sent that many frames: half a second of a board, two of an MTx

_REPORTS = (BoardHealth, ClockReply, Configuration, Electrical, Identity, Parts, Status)
_OF_EVERY_BOARD = {number for number, kind in BY_ID.items() if kind in _REPORTS}


def sender(received: bytes) -> str | None:
    """`BOARD`, `FOOT` or `MTX`; None while none is certain. A board whose firmware does not fit is a board."""
    reader = BoardReader()
    try:
        frames = reader.frames(received)
    except StaleFirmwareError:
        return BOARD
    if reader.counts.good >= LEAST_FRAMES:
        if _is_of_foot(frames):
            return FOOT
        return None if set(frames.id.tolist()) <= _OF_EVERY_BOARD else BOARD  # a foot board seeks its part for 0.1 s
    return MTX if not reader.counts.good and len(FrameReader().feed(received)) >= LEAST_FRAMES else None


def _is_of_foot(frames: Frames) -> bool:
    """Whether a board has a foot's sensor; such a board reads no other one [protocol/README.md, foot_health]."""
    if any(len(frames.rows(kind)[0]) for kind in (Foot, FootHealth)):
        return True
    configurations = frames.rows(Configuration)[1]
    return len(configurations) > 0 and configurations[-1]["sensors"] == 0


def wrong_device(name: str, other: str, urls: Mapping[str, str]) -> str:
    """The remedy when the port `name` has the device `other`."""
    what = f"{urls[name]} is {DEVICES[other]}, not {DEVICES[name]}"
    if other not in urls:
        return f"{what}: name its port with --{other} {urls[name]}, and the other device's with --{name}"
    right = {name: urls[other], other: urls[name]}
    swapped = " ".join(f"--{device} {right[device]}" for device in DEVICES if device in right)
    return f"{what}: the ports are swapped: give {swapped}"
