# SPDX-License-Identifier: MIT
"""Datagrams that can be made only with a key.

In: bytes and a key; datagrams. Out: sealed datagrams; the bytes in authentic ones. Owns the greatest counter so far.

    datagram = bytes | counter u64 | first 16 bytes of HMAC-SHA256(key, bytes | counter)      little-endian [protocol/README.md, RFC 2104]

The counter of each datagram is greater than all before it, so that none can be sent again.
"""

from __future__ import annotations

import hmac
import struct
from pathlib import Path

from echostep.errors import EchostepError
from echostep_app.printing.lines import as_error

COUNTER = struct.Struct("<Q")
TAG_SIZE = 16  # bytes: 128 bits cannot be guessed
TRAILER_SIZE = COUNTER.size + TAG_SIZE
KEY_SIZES = range(16, 65)  # bytes; HMAC hashes longer keys [RFC 2104]
LARGEST_FILE = 1024  # bytes, of a key's file


def read_key(path: Path) -> bytes:
    """The key in a file, as hexadecimal digits; raises EchostepError when there is none."""
    with as_error(f"{path}: cannot read the key"), path.open("rb") as file:
        text = file.read(LARGEST_FILE)
    try:
        key = bytes.fromhex(text.decode("ascii").strip())
    except ValueError as error:
        raise EchostepError(
            f"{path}: not a key: expected hexadecimal digits; make one: openssl rand -hex 32"
        ) from error
    if len(key) not in KEY_SIZES:
        raise EchostepError(f"{path}: the key has {len(key)} bytes, expected 16 to 64; make one: openssl rand -hex 32")
    return key


def seal(key: bytes, sent: bytes, counter: int) -> bytes:
    """A datagram of these bytes."""
    body = sent + COUNTER.pack(counter)
    return body + hmac.digest(key, body, "sha256")[:TAG_SIZE]


class Opener:
    """Opens the datagrams of one sender."""

    def __init__(self, key: bytes) -> None:
        self._key = key
        self._newest = -1  # greatest counter of an authentic datagram

    def open(self, datagram: bytes) -> bytes | None:
        """The bytes of an authentic datagram that is newer than all before it, else None."""
        body, tag = datagram[:-TAG_SIZE], datagram[-TAG_SIZE:]
        if len(datagram) < TRAILER_SIZE or not hmac.compare_digest(
            hmac.digest(self._key, body, "sha256")[:TAG_SIZE], tag
        ):
            return None
        (counter,) = COUNTER.unpack(body[-COUNTER.size :])
        if counter <= self._newest:
            return None
        self._newest = counter
        return body[: -COUNTER.size]
