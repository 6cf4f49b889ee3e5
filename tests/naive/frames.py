# SPDX-License-Identifier: MIT
"""Slow, obviously right twin of the board's frame reader: one frame at a time, by the cobs library and Python's CRC.

The same of an MT's frames.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from cobs import cobs

from echostep.board.frames import GAP_TICKS, MAX_ENCODED, OLDEST_TICKS, FrameCounts, StaleFirmwareError, crc
from echostep.board.messages import BY_ID, SCHEMA_HASH, Identify, Identity, Message


@dataclass(slots=True)
class BoardReader:
    """Messages out of a byte stream; every malformed frame is counted, none raises."""

    counts: FrameCounts = field(default_factory=FrameCounts)
    _rest: bytes = b""
    _sequence: int | None = None
    _ticks: int | None = None

    def feed(self, received: bytes) -> list[Message]:
        """Messages completed by these bytes; raises StaleFirmwareError when the board has another schema."""
        pieces = (self._rest + received).split(b"\0")
        self._rest = pieces.pop()[: MAX_ENCODED + 1]
        return [m for piece in pieces if piece and (m := self._decode(piece)) is not None]

    def _decode(self, piece: bytes) -> Message | None:
        if not 6 <= len(piece) <= MAX_ENCODED:
            self.counts.bad_length += 1
            return None
        try:
            payload = cobs.decode(piece)
        except cobs.DecodeError:
            self.counts.bad_cobs += 1
            return None
        identifier, plain = payload[0], payload[:-2]
        if crc(identifier, plain) != payload[-2] | payload[-1] << 8:
            self.counts.bad_crc += 1
            return None
        return self._accept(identifier, plain)

    def _accept(self, identifier: int, plain: bytes) -> Message | None:
        kind = BY_ID.get(identifier)
        try:
            message = kind.unpack(plain[3:]) if kind else None
        except ValueError:
            message = None
        if message is None:
            self.counts.bad_message += 1
            return None
        if isinstance(message, Identity) and message.schema_hash != SCHEMA_HASH:
            self._refuse()
            return None
        self._count_sequence(plain[1] | plain[2] << 8, message)
        return message

    def _refuse(self) -> None:
        """Another schema: fatal, unless frames of our own schema prove this one to be noise."""
        if self.counts.good:
            self.counts.bad_message += 1
            return
        raise StaleFirmwareError

    def _count_sequence(self, sequence: int, message: Message) -> None:
        self.counts.good += 1
        ticks, passed = getattr(message, "ticks", None), 0
        if ticks is not None:
            if self._ticks is not None:
                passed = (ticks - self._ticks + OLDEST_TICKS) % (1 << 32) - OLDEST_TICKS
            if self._ticks is None or passed > 0:
                self._ticks = ticks
        if self._sequence is not None and not isinstance(message, Identify) and passed <= GAP_TICKS:
            gap = (sequence - self._sequence - 1) & 0xFFFF
            self.counts.lost += gap if gap < 0x8000 else 0
        self._sequence = sequence


BUSES = (*range(1, 33), 0xFF)


def valid_frames(capture: bytes) -> list[tuple[int, int, bytes]]:
    """Bus, message identifier and payload of each valid frame; the search goes on behind a valid frame, else one byte later."""
    found, begin = [], 0
    while begin < len(capture):
        size = frame_size(capture[begin : begin + 6])
        frame = capture[begin : begin + size]
        if size and len(frame) == size and sum(frame[1:]) % 256 == 0:
            head = 6 if frame[3] == 0xFF else 4
            found.append((frame[1], frame[2], frame[head:-1]))
            begin += size
        else:
            begin += 1
    return found


def frame_size(head: bytes) -> int:
    """Bytes of the frame that begins so; 0 when no frame does."""
    if len(head) < 4 or head[0] != 0xFA or head[1] not in BUSES:
        return 0
    if head[3] != 0xFF:
        return 5 + head[3]
    length = int.from_bytes(head[4:6], "big")
    return 7 + length if len(head) == 6 and 255 <= length <= 65535 else 0
