"""Captured bytes -> messages.

In: a file: bytes of the board's port, bytes of the MTx's port (Xbus), or a recording (.mcap). Out: messages in order. Owns nothing.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from echostep.board.frames import BoardReader
from echostep.board.messages import BY_ID, Message
from echostep.errors import EchostepError
from echostep.ports.chunks import BOARD, MTX
from echostep.recording.mcap_records import MCAP_MAGIC
from echostep.recording.recorder import open_recording
from echostep.xsens import MtSample, MtxReader

READ_BYTES = 1 << 16  # of one read of the file; by reason: many frames, little memory
MESSAGE_NAMES: dict[type, str] = {kind: kind.__name__ for kind in BY_ID.values()}


@dataclass
class Decoder:
    """Bytes of named ports -> messages; the readers count good and damaged frames."""

    board: BoardReader = field(default_factory=BoardReader)
    mtx: MtxReader = field(default_factory=MtxReader)

    def feed(self, port: str, received: bytes) -> list[Message | MtSample]:
        """Messages completed by these bytes; none for a port that is neither the board's nor the MTx's."""
        if port == BOARD:
            return list(self.board.feed(received))
        return list(self.mtx.feed(received)) if port == MTX else []


def read_capture(path: Path | str, decoder: Decoder | None = None) -> Iterator[Message | MtSample]:
    """Messages of a captured file, in order. A `Decoder` given by the caller holds the counts afterwards.

    Raises EchostepError when the file cannot be read or holds neither board frames, nor Xbus frames, nor a recording.
    """
    path, decoder = Path(path), decoder or Decoder()
    try:
        with path.open("rb") as file:
            head = file.read(READ_BYTES)
    except OSError as error:
        raise EchostepError(f"{path}: cannot read the capture: {error.strerror}") from error
    if head.startswith(MCAP_MAGIC):
        for chunk in open_recording(path).chunks():
            yield from decoder.feed(chunk.port, chunk.data)
        return
    port = _guess_port(head)
    if port is None:
        raise EchostepError(f"{path}: neither board frames nor Xbus frames nor an MCAP recording")
    with path.open("rb") as file:
        while received := file.read(READ_BYTES):
            yield from decoder.feed(port, received)


def _guess_port(head: bytes) -> str | None:
    """The port whose reader decodes more messages from the first bytes of the file; None when there are no messages."""
    trial = Decoder()
    message_counts = {port: len(trial.feed(port, head)) for port in (BOARD, MTX)}
    best = max(message_counts, key=lambda port: message_counts[port])
    return best if message_counts[best] else None


def as_json(message: Message | MtSample) -> dict[str, Any]:
    """A message as a JSON object: its kind, then its fields."""
    if isinstance(message, tuple) and type(message) in MESSAGE_NAMES:
        return {"message": MESSAGE_NAMES[type(message)], **message._asdict()}
    return {"message": type(message).__name__, **_fields(message)}


def _fields(sample: Any) -> dict[str, Any]:
    """Fields of an MTx sample by name, without those that the device did not send."""
    names = sample._fields if hasattr(sample, "_fields") else sample.__dataclass_fields__
    return {name: value for name in names if (value := getattr(sample, name)) is not None and not _is_absent(value)}


def _is_absent(value: Any) -> bool:
    """A vector of NaN: the device did not send this quantity."""
    return isinstance(value, tuple) and all(map(math.isnan, value))
