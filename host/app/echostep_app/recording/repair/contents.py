# SPDX-License-Identifier: MIT
"""Contents of a recording: counts per port, decoded frames, gaps, and problems of the file.

In: a recording. Out: a summary as lines of text. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from echostep.board.messages import SCHEMA_HASH, Identity
from echostep.errors import EchostepError
from echostep.ports.chunks import BOARD, FOOT, LATEST_NS, MTX
from echostep.recording import Decoder, log_offset_ns, utc_offset_ns
from echostep.recording.damage.notes import made_of
from echostep.recording.mcap_records import port_of
from echostep_app.printing.console import console_for_people
from echostep_app.printing.progress import with_bar
from echostep_app.recording.capture_summary import refusals
from echostep_app.recording.repair.recovery import ArrivalOrder, RecordedMessage, Recovery

# All assumed.
LONGEST_LINE = 4000  # characters
LONGEST_VALUE = 100  # characters of a metadata value on the line of its key
DECODED_AT_ONCE = 1 << 16  # bytes of one port
BETWEEN_PORTS_NS = 100_000_000  # two threads read two ports: this much between the times of their chunks is not a fault
COUNTED_GAP_S = 1.0  # a longer time between two chunks of a port is counted as a gap


@dataclass
class PortContents:
    """Counts of one port's chunks and bytes."""

    chunks: int = 0
    received: int = 0  # bytes
    last_ns: int = 0  # arrival of the newest chunk
    longest_gap_s: float = 0.0
    gaps: int = 0  # longer than `COUNTED_GAP_S`

    def add(self, message: RecordedMessage) -> None:
        """Count one chunk."""
        gap_s = (message.t_ns - self.last_ns) * 1e-9 if self.chunks else 0.0
        self.longest_gap_s = max(self.longest_gap_s, gap_s)
        self.gaps += gap_s > COUNTED_GAP_S
        self.chunks += 1
        self.received += len(message.body)
        self.last_ns = message.t_ns


@dataclass
class Contents:
    """Counts of a recording: `ports` by name, and `derived` messages by topic."""

    ports: dict[str, PortContents] = field(default_factory=dict)
    derived: dict[str, int] = field(default_factory=dict)
    first_ns: int = LATEST_NS  # earliest arrival
    last_ns: int = 0  # latest arrival
    out_of_order: int = 0  # chunks that arrived more than BETWEEN_PORTS_NS before an earlier chunk of another port
    order: ArrivalOrder = field(default_factory=ArrivalOrder)  # corrects the times counted here
    decoder: Decoder = field(default_factory=Decoder)
    errors: list[str] = field(default_factory=list)  # of the decoder
    firmware: str = ""  # version and protocol hash in the board's newest Identity message
    _undecoded: dict[str, bytearray] = field(default_factory=dict)  # bytes by port

    @property
    def seconds(self) -> float:
        """Time from the first chunk to the last, s."""
        return max(self.last_ns - self.first_ns, 0) * 1e-9

    @property
    def chunks(self) -> int:
        """Chunks of all ports."""
        return sum(port.chunks for port in self.ports.values())

    def add(self, message: RecordedMessage) -> None:
        """Count one message."""
        port = port_of(message.channel)
        if not port:
            self._span(message.t_ns)
            self.derived[message.channel.topic] = self.derived.get(message.channel.topic, 0) + 1
            return
        self.out_of_order += message.t_ns < self.last_ns - BETWEEN_PORTS_NS
        self._span(message.t_ns)
        self.ports.setdefault(port, PortContents()).add(message)
        undecoded = self._undecoded.setdefault(port, bytearray())
        undecoded += message.body
        if len(undecoded) >= DECODED_AT_ONCE:
            self._decode(port, undecoded)

    def _span(self, t_ns: int) -> None:
        self.first_ns, self.last_ns = min(self.first_ns, t_ns), max(self.last_ns, t_ns)

    def finish(self) -> None:
        """Decode the remaining bytes; call it after the last `add`."""
        for port, undecoded in self._undecoded.items():
            self._decode(port, undecoded)

    def _decode(self, port: str, undecoded: bytearray) -> None:
        """Decode and clear the bytes of a port; each different error is kept once."""
        try:
            if port == BOARD:
                self._decode_board(bytes(undecoded))
            elif port == FOOT:
                self.decoder.foot.frames(bytes(undecoded))
            elif port == MTX:
                self.decoder.tracked.feed_batch(bytes(undecoded))
        except EchostepError as error:
            if str(error) not in self.errors:
                self.errors.append(str(error))
        undecoded.clear()

    def _decode_board(self, received: bytes) -> None:
        for row in self.decoder.board.frames(received).rows(Identity)[1]:
            identity = Identity.unpack(row.tobytes())
            version = f"{identity.version_major}.{identity.version_minor}.{identity.version_patch}"
            self.firmware = f"{version}, protocol 0x{identity.schema_hash:08X}"


def info(path: Path) -> list[str]:
    """The summary of a recording, as lines; raises EchostepError when it holds no readable message."""
    recovery, contents = Recovery(path), Contents()
    for message in with_progress(recovery, contents, f"reading {path.name}"):
        contents.add(message)
    contents.finish()
    if not contents.ports and not contents.derived:
        raise EchostepError(f"{path}: no message in it can be read: is this an echostep recording (.mcap)?")
    condition = problems_of(recovery, contents)
    if len(condition) == len(recovery.before):
        so_far = "it is being written: whole so far" if recovery.grows else "whole"
        condition.append(f"  {so_far}{', but made of a damaged recording' if recovery.before else ''}")
    if is_mended_by_repair(recovery, contents):
        condition.append(f"  echostep repair {path} -o OUT makes a whole file of what is readable")
    return [printable(line) for line in [*_head(recovery, contents), *_port_lines(contents), *condition]]


def printable(line: str) -> str:
    """The line, shortened and without control characters: the text of a file could control the terminal."""
    line = line if len(line) <= LONGEST_LINE else line[:LONGEST_LINE] + " ..."
    return "".join(c if c.isprintable() or c == "\n" else "?" for c in line)


def _head(recovery: Recovery, contents: Contents) -> list[str]:
    """Size, duration and metadata."""
    lines = [f"{recovery.path}: {recovery.size / 1e6:.1f} MB, {contents.seconds:.1f} s"]
    for key, value in recovery.metadata.items():
        if value:
            is_short = len(value) < LONGEST_VALUE and chr(10) not in value
            shown = value if is_short else "".join(f"\n    {line}" for line in value.splitlines())
            lines.append(f"  {key}: {shown}")
    return [*lines, *_time_line(recovery.metadata)]


def _time_line(metadata: Mapping[str, str]) -> list[str]:
    """The time that viewers show for a message, where it is not the time of day; nothing for another program's file."""
    if not metadata or log_offset_ns(metadata):
        return []
    if utc_offset_ns(metadata) is None:
        return ["  times: no time of day was recorded; viewers show the seconds of the run, in 1970"]
    return [
        "  times: of a clock that begins with the computer; echostep export FILE --plan PLAN -o NEW.mcap writes UTC"
    ]


def _port_lines(contents: Contents) -> list[str]:
    """Chunks and gaps of each port, frames of the board, samples of the MTx, derived messages."""
    lines = []
    for name, port in sorted(contents.ports.items()):
        gaps = f", silent {port.gaps} times, {port.longest_gap_s:.1f} s at most" if port.gaps else ""
        lines.append(f"  {name}: {port.received} bytes in {port.chunks} chunks{gaps}")
    board, mtx = contents.decoder.board.counts, contents.decoder.tracked.counts
    if BOARD in contents.ports:
        lines.append(f"  board frames: {board.good} good, {board.rejected} bad, {board.lost} lost")
        lines.append(
            f"  firmware: {contents.firmware or 'the board did not say'}; this host: protocol 0x{SCHEMA_HASH:08X}"
        )
    if MTX in contents.ports:
        refused = f", refused: {words}" if (words := refusals(mtx)) else ""
        rate = f" ({mtx.good / contents.seconds:.1f}/s)" if contents.seconds > 0.0 else ""
        lines.append(f"  MTx samples: {mtx.good}{rate}, {mtx.bad_checksum} bad checksums{refused}")
    if FOOT in contents.ports:
        foot = contents.decoder.foot.counts
        lines.append(f"  foot board frames: {foot.good} good, {foot.rejected} bad, {foot.lost} lost")
    if not contents.ports:
        lines.append(
            "  no bytes of a board or an MT: not a walk that echostep can replay; Foxglove and PlotJuggler show it"
        )
    if contents.derived:
        lines.append("  derived: " + ", ".join(f"{name} {count}" for name, count in sorted(contents.derived.items())))
    return lines


def damage_of(recovery: Recovery, contents: Contents) -> list[str]:
    """Damage of a file that was read to its end, as sentences; empty for a whole file, and for a file that is being written."""
    corrected = f"{contents.order.corrected} arrival times contradict their neighbours; repair corrects them"
    lines = recovery.own_damage.sentences(contents.ports, recovery.misnamed)
    return [*lines, *([corrected] if contents.order.corrected else [])]


def damage_notes(recovery: Recovery, contents: Contents) -> list[str]:
    """Damage of a recording and of its predecessors, for the recording made from it."""
    return [*made_of(recovery.path, damage_of(recovery, contents)), *recovery.before]


def problems_of(recovery: Recovery, contents: Contents) -> list[str]:
    """Problems of a file that was read to its end, as lines; empty for a complete file."""
    late = f"{contents.out_of_order} chunks of one port came long after later ones of another: repair leaves them so"
    end = "the end of the file is cut off behind the last message: nothing is lost, but other programs may not open it"
    lines = [*contents.errors, *recovery.before, *damage_of(recovery, contents)]
    lines += [end] if recovery.intact and not recovery.has_footer else []
    lines += [late] if contents.out_of_order else []
    return [f"  {line}" for line in lines]


def is_mended_by_repair(recovery: Recovery, contents: Contents) -> bool:
    """Whether a repaired copy lacks a fault of this file; bytes that the decoder could not read, and the order between ports, stay as they are."""
    unfinished = not recovery.has_footer and not recovery.grows
    return bool(recovery.own_damage or unfinished or contents.order.corrected)


def with_progress(recovery: Recovery, contents: Contents, title: str) -> Iterator[RecordedMessage]:
    """All messages with corrected arrival times, with a progress bar on a terminal."""
    messages = contents.order.correct(recovery.messages())
    return with_bar(messages, title, lambda: recovery.fraction, console_for_people(stderr=True))
