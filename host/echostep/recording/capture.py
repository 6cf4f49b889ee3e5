"""Captured bytes -> messages, for anybody's tests.

In: a file: what came from the board's port, what came from the MTx's (Xbus bytes), or a recording (.mcap). Out: messages in order. Owns nothing.
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

PIECE = 1 << 16


@dataclass
class Decoder:
    """Bytes of named ports -> messages; the readers keep the counts."""

    board: BoardReader = field(default_factory=BoardReader)
    mtx: MtxReader = field(default_factory=MtxReader)

    def feed(self, port: str, received: bytes) -> list[Message | MtSample]:
        """Messages completed by these bytes."""
        if port == BOARD:
            return list(self.board.feed(received))
        return list(self.mtx.feed(received)) if port == MTX else []


def read_capture(path: Path | str, decoder: Decoder | None = None) -> Iterator[Message | MtSample]:
    """Messages of a captured file, in order; give a `Decoder` to see its counts afterwards.

    Raises EchostepError when the file cannot be read or holds neither board frames, nor Xbus frames, nor a recording.
    """
    path, decoder = Path(path), decoder or Decoder()
    try:
        with path.open("rb") as file:
            head = file.read(PIECE)
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
        while piece := file.read(PIECE):
            yield from decoder.feed(port, piece)


def _guess_port(head: bytes) -> str | None:
    """The port whose reader makes more messages of the file's beginning."""
    trial = Decoder()
    found = {port: len(trial.feed(port, head)) for port in (BOARD, MTX)}
    best = max(found, key=lambda port: found[port])
    return best if found[best] else None


NAMES: dict[type, str] = {kind: kind.__name__ for kind in BY_ID.values()}


def as_json(message: Message | MtSample) -> dict[str, Any]:
    """A message as a JSON object: its kind, then its fields."""
    if isinstance(message, tuple) and type(message) in NAMES:
        return {"message": NAMES[type(message)], **message._asdict()}
    return {"message": type(message).__name__, **_fields(message)}


def _fields(sample: Any) -> dict[str, Any]:
    names = sample._fields if hasattr(sample, "_fields") else sample.__dataclass_fields__
    return {name: value for name in names if (value := getattr(sample, name)) is not None and not _is_absent(value)}


def _is_absent(value: Any) -> bool:
    """A quantity that the device did not send."""
    return isinstance(value, tuple) and all(map(math.isnan, value))
