# SPDX-License-Identifier: MIT
"""A recording read again: its metadata, and its chunks as portions.

In: an MCAP file, from our recorder or rewritten by another tool, possibly damaged. Out: the chunks that are readable, in the order in which they were
recorded, and the damage of the file. Owns nothing.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import chain
from pathlib import Path

import numpy as np
from mcap.opcode import Opcode
from mcap.records import Header, Metadata

from echostep.arrays import Octets
from echostep.errors import EchostepError, replaced
from echostep.file_mode import is_being_written
from echostep.ports.chunks import Chunk, Portion
from echostep.recording.clock import log_offset_ns
from echostep.recording.damage.ending import Ending, begins_as_mcap, checksum_matches, read_ending
from echostep.recording.damage.notes import FileDamage, made_of
from echostep.recording.damage.placing import Placement
from echostep.recording.damage.scan import begin_in_chunk, chunk_matches, map_file, next_valid_run, record_end
from echostep.recording.mcap_records import (
    DAMAGE_NAME,
    HEAD_SIZE,
    LIBRARY,
    MCAP_MAGIC,
    MESSAGE,
    METADATA_NAME,
    NEXT,
    PART_NAME,
    decompress_chunk,
    parse_record,
)
from echostep.recording.message_runs import MessageRun, PortChannels, read_messages


@dataclass
class Recording:
    """A recording on disk. Its damage is known once its portions have been iterated."""

    path: Path
    metadata: dict[str, str] = field(default_factory=dict)
    own_damage: FileDamage = field(default_factory=FileDamage)  # of this very file
    fraction: float = 0.0  # of the file, read so far
    grows: bool = False  # it is being written: reading ends before an unfinished record
    resume: int = -1  # offset from which `portions_from` continues after the last portion; -1 inside a compressed chunk
    library: str = ""  # that wrote the file
    goes_on_in: str = ""  # name of the file with the next part of the run
    before: list[str] = field(default_factory=list)  # damage of the recordings from which this one was made
    _log_offset_ns: int = 0  # log time minus arrival time
    _ended: bool = False  # its end record was read
    _intact: bool | None = None  # whether the checksum is right; None: unknown yet
    _channels: PortChannels = field(default_factory=PortChannels)
    _ports: set[str] = field(default_factory=set)  # with messages

    def chunks(self) -> Iterator[Chunk]:
        """Chunks in the order in which they were recorded."""
        for portion in self.portions():
            yield from portion.chunks()

    def portions(self) -> Iterator[Portion]:
        """The same chunks as portions of many."""
        for portion in self._placed(record for record in self._records() if isinstance(record, MessageRun)):
            self._ports.update(portion.ports[k] for k in np.unique(portion.port).tolist())
            yield portion
        self.fraction = 1.0

    def portions_from(self, offset: int) -> Iterator[Portion]:
        """The portions after a `resume` offset; all of them for 0. Channels are those known before the first message."""
        if not offset:
            yield from self.portions()
            return
        file, channels = map_file(self.path), PortChannels()
        channels.add_summary(read_ending(file))
        for _, record in self._scan(file, len(MCAP_MAGIC), channels, FileDamage()):
            if isinstance(record, tuple) and record[0] == Opcode.CHUNK:
                deque(self._records_in_chunk(record[1], channels), maxlen=0)
            if isinstance(record, MessageRun) or record[0] == Opcode.CHUNK:
                break
            self._note(*record)
        for record in self._from(file, offset, channels):
            if isinstance(record, MessageRun):
                yield record.portion

    def to_repair(self) -> list[Path]:
        """The files that `echostep repair` makes whole."""
        return [self.path] if self.own_damage else []

    def damage(self) -> list[str]:
        """Damage of the file, as sentences, once it was read; and damage of the files from which it was made."""
        return [*self._own_sentences(), *self.before]

    def damage_notes(self) -> list[str]:
        """The same, to be noted in a recording made from this one."""
        return [*made_of(self.path, self._own_sentences()), *self.before]

    def _own_sentences(self) -> list[str]:
        return self.own_damage.sentences(self._ports, self._channels.misnamed)

    def _records(self) -> Iterator[MessageRun | tuple[int, bytes]]:
        """Messages as runs, other records as opcode and body, in order, up to the footer; damaged bytes are skipped and counted."""
        file, self._channels, self._ports = map_file(self.path), PortChannels(), set()
        self.own_damage, self._ended = FileDamage(), False
        ending = Ending() if self.grows else read_ending(file)
        if self._intact is None:
            self._intact = bool(ending.data_end >= 0 and checksum_matches(file, ending.data_end))
        if self._intact:
            file = file[: ending.data_end]
        else:
            self._channels.add_summary(ending)
        yield from self._from(file, len(MCAP_MAGIC), self._channels)
        # Not for a file that is not read to its end
        self.own_damage.truncated = not (self._ended or self._intact or self.grows)

    def _from(self, file: Octets, offset: int, channels: PortChannels) -> Iterator[MessageRun | tuple[int, bytes]]:
        """The records from an offset on."""
        for begin, record in self._scan(file, offset, channels, self.own_damage):
            self.fraction = begin / len(file)
            self.resume = begin
            if isinstance(record, tuple):
                opcode, body = record
                if opcode == Opcode.FOOTER and begin + HEAD_SIZE + len(body) + len(MCAP_MAGIC) >= len(file):
                    self._ended = True
                    return
                if opcode == Opcode.DATA_END and (matches := checksum_matches(file, begin)) is not None:
                    self.own_damage.altered |= not matches
                    if matches:  # everything before it is complete
                        self._ended = True
                        return
                if opcode == Opcode.CHUNK:
                    yield from self._marked(self._records_in_chunk(body, channels), begin + HEAD_SIZE + len(body))
                self._note(opcode, body)
            yield record

    def _note(self, opcode: int, body: bytes) -> None:
        """Keep the recorder's name, its clock, earlier damage, and the name of the next file; other metadata are read at the opening."""
        if opcode == Opcode.HEADER and (header := parse_record(Header, body)):
            self.library = header.library
        if opcode == Opcode.METADATA and (stored := parse_record(Metadata, body)):
            if stored.name == METADATA_NAME:
                self._log_offset_ns = log_offset_ns(stored.metadata)
            elif stored.name == DAMAGE_NAME:
                self.before = list(stored.metadata.values())
            elif stored.name == PART_NAME:
                self.goes_on_in = stored.metadata.get(NEXT, "")

    def _placed(self, runs: Iterator[MessageRun]) -> Iterator[Portion]:
        """The portions without misplaced messages; portions of an intact file, or of another recorder, unchanged."""
        placement, this = Placement(), next(runs, None)
        if self._intact or self.grows or not self.library.startswith(LIBRARY):
            yield from (run.portion for run in chain([this] if this else [], runs))
            return
        while this is not None:
            place = self.resume, self.fraction
            following = next(runs, None)
            kept = placement.keep(this.sequence, following.sequence if following else this.sequence[:0])
            self.own_damage.misplaced = placement.misplaced
            ahead, (self.resume, self.fraction) = (self.resume, self.fraction), place
            yield this.portion if kept.all() else this.portion.where(kept)
            (self.resume, self.fraction), this = ahead, following

    def _marked(
        self, records: Iterator[MessageRun | tuple[int, bytes]], end: int
    ) -> Iterator[MessageRun | tuple[int, bytes]]:
        """The records of a compressed chunk that ends at `end`: reading can continue only after the last one."""
        before = next(records, None)
        self.resume = -1
        while before is not None:
            record = next(records, None)
            if record is None:
                self.resume = end
            yield before
            before = record

    def _records_in_chunk(self, body: bytes, channels: PortChannels) -> Iterator[MessageRun | tuple[int, bytes]]:
        if (records := decompress_chunk(body)) is None:
            self.own_damage.unreadable_chunks += 1
            return
        inside = FileDamage()
        for _, record in self._scan(np.frombuffer(records, np.uint8), 0, channels, inside):
            yield record
        self.own_damage.unreadable_chunks += bool(inside)

    def _scan(
        self, file: Octets, offset: int, channels: PortChannels, damage: FileDamage
    ) -> Iterator[tuple[int, MessageRun | tuple[int, bytes]]]:
        """Offset and content of portions and other valid records, from `offset` on; ranges without one are counted as damage."""
        while offset < len(file):
            run, offset = read_messages(file, offset, channels)
            if run:
                yield offset, self._on_arrival_clock(run)
            end = record_end(file, offset, channels.known)
            if (inside := begin_in_chunk(file, offset)) >= 0:
                damage.altered |= not self._intact and end >= 0 and not chunk_matches(file, inside, end)
                end = inside
            elif end < 0 and offset < len(file) and self.grows:
                return
            elif end < 0 and offset < len(file):
                end = next_valid_run(file, offset + 1, channels.known)
                damage.skip(offset, end, len(file))
            elif end >= 0 and file[offset] != MESSAGE:
                opcode, body = int(file[offset]), file[offset + HEAD_SIZE : end].tobytes()
                if opcode == Opcode.CHANNEL:
                    channels.add(body)
                yield offset, (opcode, body)
            else:
                continue
            offset = end

    def _on_arrival_clock(self, run: MessageRun) -> MessageRun:
        """The messages with their arrival times; if the metadata's clock cannot be true, log times stay: a constant shift harms nothing."""
        portion, offset_ns = run.portion, self._log_offset_ns
        if not offset_ns or np.median(portion.t_arrival_ns) < offset_ns:
            self._log_offset_ns = 0
            return run
        t_arrival_ns = np.maximum(portion.t_arrival_ns - offset_ns, 0)
        return MessageRun(replace(portion, t_arrival_ns=t_arrival_ns), run.sequence)


def open_recording(path: Path | str) -> Recording:
    """A recording and its metadata; raises EchostepError when the file is missing or holds no recorded bytes."""
    recording, has_bytes = Recording(Path(path)), False
    try:
        recording.grows = is_being_written(recording.path)
        with recording.path.open("rb") as file:
            begin = file.read(32)
            is_mcap, what = begins_as_mcap(begin[: len(MCAP_MAGIC)]), replaced(begin)
        for record in recording._records() if is_mcap else ():
            if isinstance(record, MessageRun):
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
    raise EchostepError(f"{path}: {what or 'no recorded bytes in it: is this an echostep recording (.mcap)?'}")
