# SPDX-License-Identifier: MIT
"""A recording read again: its metadata, and its chunks as portions.

In: an MCAP file, from our recorder or rewritten by another tool, possibly damaged. Out: the chunks that are readable, in the order in which they were
recorded, and what is wrong with the file. Owns nothing.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from mcap.opcode import Opcode
from mcap.records import Metadata

from echostep.arrays import Octets
from echostep.errors import EchostepError
from echostep.ports.chunks import Chunk, Portion
from echostep.recording.mcap_records import HEAD_SIZE, MCAP_MAGIC, MESSAGE, decompress_chunk, parse_record
from echostep.recording.message_runs import PortChannels, read_messages
from echostep.recording.recorder import METADATA_NAME
from echostep.recording.scan import checksum_differs, map_file, next_valid_run, record_end, summary


@dataclass
class Recording:
    """A recording on disk. What is wrong with it is known once its portions were iterated.

    `truncated`: it ends without a footer, in the middle of a walk. `altered`: its bytes do not match the checksum written with them.
    """

    path: Path
    metadata: dict[str, str] = field(default_factory=dict)
    truncated: bool = False
    altered: bool = False
    fraction: float = 0.0  # of the file, read so far
    damaged_bytes: int = 0  # in no valid record
    damaged_places: int = 0
    unreadable_chunks: int = 0  # chunk records of the file that could not be decompressed
    grows: bool = False  # it is being written: reading ends before an unfinished record
    resume: int = -1  # offset from which `portions_from` goes on behind the last portion; -1 inside a compressed chunk

    def chunks(self) -> Iterator[Chunk]:
        """Chunks in the order in which they were recorded."""
        for portion in self.portions():
            yield from portion.chunks()

    def portions(self) -> Iterator[Portion]:
        """The same chunks as portions of many."""
        for record in self._records():
            if isinstance(record, Portion):
                yield record
        self.fraction = 1.0

    def portions_from(self, offset: int) -> Iterator[Portion]:
        """The portions behind a `resume` offset; all of them from 0 on. Channels are those known before the first message."""
        if not offset:
            yield from self.portions()
            return
        file, channels = map_file(self.path), PortChannels()
        for opcode, body in summary(file):
            if opcode == Opcode.CHANNEL:
                channels.add(body)
        for _, record in self._scan(file, len(MCAP_MAGIC), channels):
            if isinstance(record, tuple) and record[0] == Opcode.CHUNK:
                deque(self._records_in_chunk(record[1], channels), maxlen=0)
            if isinstance(record, Portion) or record[0] == Opcode.CHUNK:
                break
        for record in self._from(file, offset, channels):
            if isinstance(record, Portion):
                yield record

    def _records(self) -> Iterator[Portion | tuple[int, bytes]]:
        """Messages as portions, other records as opcode and body, in order, up to the footer; damaged bytes are skipped and counted."""
        file, channels = map_file(self.path), PortChannels()
        self.truncated, self.altered = True, False
        self.damaged_bytes = self.damaged_places = self.unreadable_chunks = 0
        for opcode, body in summary(file):
            if opcode == Opcode.CHANNEL:
                channels.add(body)
        yield from self._from(file, len(MCAP_MAGIC), channels)

    def _from(self, file: Octets, offset: int, channels: PortChannels) -> Iterator[Portion | tuple[int, bytes]]:
        """The records from an offset on."""
        for begin, record in self._scan(file, offset, channels):
            self.fraction = begin / len(file)
            self.resume = begin
            if isinstance(record, tuple):
                opcode, body = record
                if opcode == Opcode.FOOTER and begin + HEAD_SIZE + len(body) + len(MCAP_MAGIC) >= len(file):
                    self.truncated = False
                    return
                if opcode == Opcode.DATA_END:
                    self.altered = self.altered or checksum_differs(file, begin)
                if opcode == Opcode.CHUNK:
                    yield from self._marked(self._records_in_chunk(body, channels), begin + HEAD_SIZE + len(body))
            yield record

    def _marked(
        self, records: Iterator[Portion | tuple[int, bytes]], end: int
    ) -> Iterator[Portion | tuple[int, bytes]]:
        """The records of a compressed chunk that ends at `end`: only behind the last one can reading go on."""
        before = next(records, None)
        self.resume = -1
        while before is not None:
            record = next(records, None)
            if record is None:
                self.resume = end
            yield before
            before = record

    def _records_in_chunk(self, body: bytes, channels: PortChannels) -> Iterator[Portion | tuple[int, bytes]]:
        records = decompress_chunk(body)
        if records is None:
            self.unreadable_chunks += 1
            return
        for _, record in self._scan(np.frombuffer(records, np.uint8), 0, channels):
            yield record

    def _scan(
        self, file: Octets, offset: int, channels: PortChannels
    ) -> Iterator[tuple[int, Portion | tuple[int, bytes]]]:
        """Offset and content of portions and other valid records, from `offset` on."""
        while offset < len(file):
            portion, offset = read_messages(file, offset, channels)
            if portion:
                yield offset, portion
            end = record_end(file, offset, channels.known)
            if end < 0 and offset < len(file) and self.grows:
                return
            if end < 0 and offset < len(file):
                end = next_valid_run(file, offset + 1, channels.known)
                self.damaged_places += 1
                self.damaged_bytes += end - offset
            elif end >= 0 and file[offset] != MESSAGE:
                opcode, body = int(file[offset]), file[offset + HEAD_SIZE : end].tobytes()
                if opcode == Opcode.CHANNEL:
                    channels.add(body)
                yield offset, (opcode, body)
            else:
                continue
            offset = end


def open_recording(path: Path | str) -> Recording:
    """A recording and its metadata; raises EchostepError when the file is missing or holds no recorded bytes."""
    recording, has_bytes = Recording(Path(path)), False
    try:
        with recording.path.open("rb") as file:
            is_mcap = file.read(len(MCAP_MAGIC)) == MCAP_MAGIC
        for record in recording._records() if is_mcap else ():
            if isinstance(record, Portion):
                has_bytes = True
                if recording.metadata:
                    break
                continue
            opcode, body = record
            if opcode == Opcode.METADATA and (stored := parse_record(Metadata, body)) and stored.name == METADATA_NAME:
                recording.metadata = dict(stored.metadata)
    except OSError as error:
        raise EchostepError(f"{path}: cannot read the recording: {error.strerror}") from error
    if has_bytes:
        return recording
    raise EchostepError(f"{path}: no recorded bytes in it: is this an echostep recording (.mcap)?")
