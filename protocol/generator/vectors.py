# SPDX-License-Identifier: MIT
"""protocol/vectors.jsonl: golden frames of every message, and COBS cases around its block length.

In: the messages. Out: JSON lines; encoding is done here without the host's or the firmware's code. Owns the choice of cases.
"""

from __future__ import annotations

import binascii
import json
import struct
from typing import Any

from cobs import cobs

from generator.schema import FIXED_SEED, Field, Message, crc_seed, schema_hash

SEQUENCES = (0, 1, 255, 256, 65535)
COBS_LENGTHS = (0, 1, 2, 253, 254, 255, 256, 508, 509)  # a block holds 254 bytes


def vectors(messages: list[Message]) -> str:
    """The whole file."""
    seed = crc_seed(schema_hash(messages))
    rows = [row for message in messages for row in _frames(message, seed)]
    rows += [row for length in COBS_LENGTHS for row in _cobs_cases(length)]
    return "".join(json.dumps(row) + "\n" for row in rows)


def _frames(message: Message, schema_seed: int) -> list[dict[str, Any]]:
    seed = FIXED_SEED if message.has_fixed_seed else schema_seed
    rows: list[dict[str, Any]] = []
    for sequence, fields in zip(SEQUENCES, _sample_values(message), strict=False):
        covered = struct.pack("<BH", message.id, sequence) + message.pack(fields.values())
        payload = covered + struct.pack("<H", binascii.crc_hqx(covered, seed))
        frame = cobs.encode(payload) + b"\0"
        rows.append({"message": message.name, "sequence": sequence, "fields": fields, "frame": frame.hex()})
    return rows


def _sample_values(message: Message) -> list[dict[str, int]]:
    """Field values: all least, all greatest, two bodies of one repeated byte, and greatest alternating with zero."""
    if not message.fields:
        return [{}]
    rows = [{f.name: _least(f) for f in message.fields}, {f.name: _greatest(f) for f in message.fields}]
    rows += [{f.name: _repeated(f, byte) for f in message.fields} for byte in (0x01, 0x5A)]
    rows.append({f.name: 0 if k % 2 else _greatest(f) for k, f in enumerate(message.fields)})
    return rows


def _least(field: Field) -> int:
    return -(1 << 8 * field.size - 1) if field.wire.signed else 0


def _greatest(field: Field) -> int:
    if field.enum:
        return len(field.enum) - 1
    return (1 << 8 * field.size - field.wire.signed) - 1


def _repeated(field: Field, byte: int) -> int:
    """The value of a field whose bytes are all the same, limited to what the field may hold."""
    return min(_greatest(field), int.from_bytes(bytes([byte]) * field.size, "little"))


def _cobs_cases(length: int) -> list[dict[str, Any]]:
    plain_bytes = {
        "ones": b"\1" * length,
        "zeros": b"\0" * length,
        "mixed": bytes(k * 7 % 5 for k in range(length)),
    }
    return [
        {"cobs": name, "plain": plain.hex(), "encoded": cobs.encode(plain).hex()} for name, plain in plain_bytes.items()
    ]
