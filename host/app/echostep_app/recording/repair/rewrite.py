# SPDX-License-Identifier: MIT
"""Writes a new recording from the messages of another one.

In: metadata, messages, damage of the other one. Out: an MCAP file with an index of chunks, which other programs need; the messages are numbered
again. Owns the new file.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path

from mcap.records import Channel, Schema

from echostep.errors import EchostepError
from echostep.recording.mcap_records import DAMAGE_NAME, METADATA_NAME
from echostep_app.printing.lines import as_error
from echostep_app.recording.names import create
from echostep_app.recording.recorder import begin_file, numbered
from echostep_app.recording.repair.recovery import RecordedMessage


class RewrittenRecording:
    """The new file; it is removed when it cannot be finished. Raises EchostepError when it cannot be written."""

    def __init__(self, path: Path, source: Path, schemas: Mapping[int, Schema]) -> None:
        """`schemas`: the source's schemas by number; they may be added while messages are written."""
        if path.exists() and path.resolve() == source.resolve():
            raise EchostepError(f"{path}: that is the recording itself: give another name with -o")
        self.path = path
        self._schemas = schemas
        self._schema_ids: dict[int, int] = {0: 0}  # by number in the source; 0: no schema
        self._channels: dict[tuple[str, str, int], int] = {}  # by topic, encoding and schema number in the source
        self._file = os.fdopen(create(path), "wb")
        self._writer = begin_file(self._file)
        self._sequence = 0

    def write_metadata(self, metadata: Mapping[str, str]) -> None:
        """Write the recorder's metadata; call it before the first `write`."""
        self._writer.add_metadata(METADATA_NAME, dict(metadata))

    def write_damage(self, lines: Iterable[str]) -> None:
        """Write the damage of the other recording, after its last message; nothing when it was whole."""
        with as_error(f"{self.path}: cannot write"):
            if noted := numbered(lines):
                self._writer.add_metadata(DAMAGE_NAME, noted)

    def write(self, message: RecordedMessage) -> None:
        """Write one message."""
        channel = message.channel
        key = (channel.topic, channel.message_encoding, channel.schema_id)
        with as_error(f"{self.path}: cannot write"):
            number = self._channels.get(key) or self._register(channel, key)
            self._writer.add_message(number, message.t_ns, message.body, message.publish_ns, self._sequence)
        self._sequence += 1

    def keep_private(self, opcode: int, body: bytes) -> None:
        """Write another program's own record, before the chunk of the next message."""
        records = self._writer._Writer__record_builder  # type: ignore[attr-defined]  # its checksum must cover the record
        records.start_record(opcode)
        records.write(body)
        records.finish_record()

    def _register(self, channel: Channel, key: tuple[str, str, int]) -> int:
        if channel.schema_id not in self._schema_ids and (schema := self._schemas.get(channel.schema_id)):
            self._schema_ids[schema.id] = self._writer.register_schema(schema.name, schema.encoding, schema.data)
        schema_id = self._schema_ids.get(channel.schema_id, 0)
        self._channels[key] = self._writer.register_channel(
            channel.topic, channel.message_encoding, schema_id, channel.metadata
        )
        return self._channels[key]

    def close(self) -> None:
        """Write summary and footer, and close the file."""
        with as_error(f"{self.path}: cannot write"):
            self._writer.finish()  # type: ignore[no-untyped-call]
            self._file.close()

    def __enter__(self) -> RewrittenRecording:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        try:
            if kind is None:
                self.close()
                return
        except EchostepError:
            self._remove()
            raise
        self._remove()

    def _remove(self) -> None:
        with suppress(OSError):
            self._file.close()
        if self.path.is_file():
            self.path.unlink()
