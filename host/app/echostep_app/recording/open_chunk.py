# SPDX-License-Identifier: MIT
"""The stream of an MCAP writer of chunks, whose records are in the file before their chunk is closed.

In: records as they come, and the bytes that the writer makes of them. Out: the bytes of the file. Owns the offset of the open chunk.

    open     private record PRIVATE of CHUNK_HEAD bytes | records ...
    closed   head of the chunk, as long                 | the same records ... | their index

So a run that ends without notice leaves whole records, and nothing that was written moves.
"""

from __future__ import annotations

import struct

from mcap.data_stream import RecordBuilder
from mcap.records import Channel, Schema

from echostep.recording.damage.scan import CHUNK_HEAD, PRIVATE
from echostep.recording.mcap_records import HEAD_SIZE, MESSAGE, MESSAGE_SIZE
from echostep_app.recording.background_writer import BackgroundWriter

CHUNK_BYTES = 1 << 18  # of a closed chunk: some seconds of a walk; assumed
_PLACE = struct.pack(f"<BQ{CHUNK_HEAD - HEAD_SIZE}x", PRIVATE, CHUNK_HEAD - HEAD_SIZE)
_MESSAGE_HEAD = struct.Struct("<BQHIQQ")


class OpenChunk:
    """The methods of a file that the writer calls: `write`, `tell` and `flush`. It closes a chunk by one `write` of the whole record."""

    def __init__(self, file: BackgroundWriter) -> None:
        self._file = file
        self._begin: int | None = None  # offset of the open chunk

    @property
    def is_full(self) -> bool:
        """Whether the open chunk should be closed."""
        return self._begin is not None and self._file.tell() - self._begin > CHUNK_BYTES

    def lay_message(self, channel: int, sequence: int, t_ns: int, data: bytes) -> None:
        """Append the record of a message, which the writer has in its chunk, too."""
        self._lay(_MESSAGE_HEAD.pack(MESSAGE, MESSAGE_SIZE + len(data), channel, sequence, t_ns, t_ns) + data)

    def lay(self, record: Schema | Channel) -> None:
        """Append another record."""
        builder = RecordBuilder()
        record.write(builder)
        self._lay(builder.end())  # type: ignore[no-untyped-call]

    def _lay(self, record: bytes) -> None:
        if self._begin is None:
            self._begin = self._file.tell()
            self._file.write(_PLACE)
        self._file.write(record)

    def write(self, data: bytes) -> int:
        """Append bytes, or the head of the open chunk in its place."""
        if self._begin is None or not data:
            return self._file.write(data)
        self._file.overwrite(self._begin, data[:CHUNK_HEAD])
        self._begin = None
        return len(data)

    def tell(self) -> int:
        """Where the writer's next bytes come."""
        return self._file.tell() if self._begin is None else self._begin

    def flush(self) -> None:
        """Nothing waits here."""
