# SPDX-License-Identifier: MIT
"""Captured bytes -> messages.

In: a file: bytes of the board's port, bytes of an MT's port (Xbus), or a recording (.mcap). Out: messages in order, one for each valid frame of
an MT. Owns nothing.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import repeat
from pathlib import Path
from typing import Any

from echostep.board.frames import BoardReader
from echostep.board.messages import Message
from echostep.errors import EchostepError
from echostep.ports.chunks import BOARD, FOOT, MTX
from echostep.recording.mcap_records import MCAP_MAGIC
from echostep.recording.reading import open_recording
from echostep.xsens import FrameReader, MtMessage, MtxReader
from echostep.xsens.frames import LONGEST
from echostep.xsens.message import MessageReader, as_object

# Least share of a port's bytes in valid frames: a one-byte checksum is right by chance once in 256; assumed
LEAST_SHARE = 0.1
READ_BYTES = 1 << 16  # of one read of the file: many frames, little memory
HEAD_BYTES = 1 << 20  # of a port, by which the output format of legacy data is found; assumed
BOARD_FRAME, MT_FRAME = 10, 5  # approximate bytes of a frame besides the body, to compare two readers
Chunks = Iterator[tuple[str, bytes]]  # port, bytes


@dataclass
class Decoder:
    """Bytes of named ports -> messages; the readers count good and damaged frames. `tracked` counts the MT's bytes as the tracker would read them."""

    board: BoardReader = field(default_factory=BoardReader)
    foot: BoardReader = field(default_factory=BoardReader)
    mt: MessageReader = field(default_factory=MessageReader)
    tracked: MtxReader = field(default_factory=MtxReader)

    def feed(self, port: str, received: bytes, *, ended: bool = False) -> list[Message | MtMessage]:
        """Messages completed by these bytes; none for a port that is neither a board's nor the MT's. `ended`: no byte follows."""
        if port in (BOARD, FOOT):
            return list((self.board if port == BOARD else self.foot).feed(received))
        if port != MTX:
            return []
        self.tracked.feed_batch(received)
        return list(self.mt.feed(received, ended=ended))


def read_capture(path: Path | str, decoder: Decoder | None = None) -> Iterator[Message | MtMessage]:
    """Messages of a captured file, in order. A `Decoder` given by the caller holds the counts afterwards.

    Raises EchostepError when the file cannot be read or holds neither board frames, nor Xbus frames, nor a recording.
    """
    path, decoder = Path(path), decoder or Decoder()
    try:
        with path.open("rb") as file:
            recorded = file.read(len(MCAP_MAGIC)) == MCAP_MAGIC
    except OSError as error:
        raise EchostepError(f"{path}: cannot read the capture: {error.strerror}") from error
    if (port := "" if recorded else port_of_bytes(path, 0.0)) is None:  # the caller knows the kind of the file
        raise EchostepError(f"{path}: neither board frames nor Xbus frames nor an MCAP recording")
    decoder.mt.formats.learn(FrameReader(LONGEST).feed(_head(_chunks(path, port)), ended=True))
    for name, received in _chunks(path, port):
        yield from decoder.feed(name, received)
    yield from decoder.feed(MTX, b"", ended=True)


def _chunks(path: Path, port: str) -> Chunks:
    """The bytes of a recording by port (`port`: ""), or of a file of one port's bytes."""
    if not port:
        return ((chunk.port, chunk.data) for chunk in open_recording(path).chunks())
    return zip(repeat(port), _blocks(path), strict=False)


def _blocks(path: Path) -> Iterator[bytes]:
    with path.open("rb") as file:
        while received := file.read(READ_BYTES):
            yield received


def _head(chunks: Iterable[tuple[str, bytes]]) -> bytes:
    """The first bytes of the MT's port, at most about HEAD_BYTES."""
    head = bytearray()
    for port, received in chunks:
        head += received if port == MTX else b""
        if len(head) >= HEAD_BYTES:
            break
    return bytes(head)


def port_of_bytes(path: Path, least_share: float = LEAST_SHARE) -> str | None:
    """The port whose reader understands more of the first HEAD_BYTES, and more than a share of them; None if neither does."""
    board, mt = BoardReader(), FrameReader(LONGEST)
    understood, seen = {BOARD: 0, MTX: 0}, 0
    for received in _blocks(path):
        understood[BOARD] += BOARD_FRAME * len(board.feed(received))
        understood[MTX] += _bytes_of_frames(mt, received)
        seen += len(received)
        if seen >= HEAD_BYTES and (least_share or any(understood.values())):
            break
    understood[MTX] += _bytes_of_frames(mt, b"", ended=True)
    port = max(understood, key=lambda port: understood[port])
    return port if understood[port] > least_share * seen else None


def _bytes_of_frames(reader: FrameReader, received: bytes, *, ended: bool = False) -> int:
    """Bytes of the MT's frames that these bytes complete."""
    length = reader.scan(received, ended=ended).length
    return int(length.sum()) + MT_FRAME * len(length)


def as_json(message: Message | MtMessage) -> dict[str, Any]:
    """A message as a JSON object: its kind, then its fields."""
    if isinstance(message, MtMessage):
        return dict(_finite(as_object(message)))
    return {"message": type(message).__name__, **message._asdict()}


def _finite(value: Any) -> Any:
    """The value with None in place of NaN and infinity, which JSON lacks."""
    if isinstance(value, dict):
        return {key: _finite(part) for key, part in value.items()}
    if isinstance(value, tuple | list):
        return [_finite(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
