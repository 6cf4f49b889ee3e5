"""Board frames, sans-I/O: bytes in any split -> messages, and messages -> bytes.

In: bytes from the board's USB port. Out: messages (`echostep.messages`). Owns the unfinished frame and the counters.
The frame is described in protocol/README.md.
"""

from __future__ import annotations

import binascii
import struct
from dataclasses import dataclass, field

from cobs import cobs

from echostep.errors import EchostepError
from echostep.messages import BY_ID, FIXED_SEED, SCHEMA_HASH, SCHEMA_SEED, Identify, Identity, Message

MAX_ENCODED = 65  # payloads are at most 64 bytes; COBS adds one
_HEAD = struct.Struct("<BH")
_FIXED_SEED_IDS = (0x01, 0x81)


class StaleFirmwareError(EchostepError):
    """The board speaks another schema than this host."""


@dataclass(slots=True)
class FrameCounts:
    """What a `BoardReader` has seen; `lost` counts sequence numbers that never came."""

    good: int = 0
    bad_cobs: int = 0
    bad_length: int = 0
    bad_crc: int = 0
    bad_message: int = 0
    lost: int = 0

    @property
    def rejected(self) -> int:
        return self.bad_cobs + self.bad_length + self.bad_crc + self.bad_message


def crc(identifier: int, plain: bytes) -> int:
    """CRC-16 of id, sequence and body, seeded by the schema [protocol/README.md]."""
    return binascii.crc_hqx(plain, FIXED_SEED if identifier in _FIXED_SEED_IDS else SCHEMA_SEED)


def encode(message: Message, sequence: int) -> bytes:
    """One frame with its closing zero; the sequence wraps at 65536."""
    plain = _HEAD.pack(message.id, sequence & 0xFFFF) + message.pack()
    payload = plain + crc(message.id, plain).to_bytes(2, "little")
    return bytes(cobs.encode(payload)) + b"\0"


@dataclass(slots=True)
class BoardReader:
    """Messages out of a byte stream; every malformed frame is counted, none raises."""

    counts: FrameCounts = field(default_factory=FrameCounts)
    _rest: bytes = b""
    _sequence: int | None = None

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
            self._refuse(message)
            return None
        self._count_sequence(plain[1] | plain[2] << 8, message)
        return message

    def _refuse(self, identity: Identity) -> None:
        """Another schema: fatal, unless frames of our own schema prove this one to be noise."""
        if self.counts.good:
            self.counts.bad_message += 1
            return
        raise StaleFirmwareError(
            f"the board's firmware speaks schema 0x{identity.schema_hash:08X}, this host 0x{SCHEMA_HASH:08X}: "
            "flash the firmware that belongs to this host (make flash)"
        )

    def _count_sequence(self, sequence: int, message: Message) -> None:
        self.counts.good += 1
        if self._sequence is not None and not isinstance(message, Identify):
            gap = (sequence - self._sequence - 1) & 0xFFFF
            self.counts.lost += gap if gap < 0x8000 else 0  # a step back is a board that restarted
        self._sequence = sequence
