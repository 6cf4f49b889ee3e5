"""What is done with recordings: look into one, cut a piece out, mend what a crash left.

In: recordings. Out: text, new recordings (MCAP in compressed, indexed chunks, as viewers like them). Owns nothing.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

from mcap.records import Channel, Schema
from mcap.writer import Writer
from rich.console import Console
from rich.progress import Progress

from echostep.board.messages import BY_ID, Identity
from echostep.errors import EchostepError
from echostep.ports.chunks import BOARD, LATEST_NS, MTX
from echostep.recording.capture import Decoder
from echostep.recording.mcap_records import port_of
from echostep.recording.recorder import METADATA_NAME
from echostep.recording.recovery import Entry, Salvage

SHOW_EVERY = 5000  # messages
LONGEST_LINE = 4000
DECODED_AT_ONCE = 1 << 16
GAP_S = 1.0  # a port that says nothing for so long was away
START = "start_x_y_rad"
IDENTITY = next(identifier for identifier, kind in BY_ID.items() if kind is Identity)


class Packer:
    """Writes messages of one recording into another one; a file that could not be finished is removed."""

    def __init__(self, path: Path, origin: Path, schemas: Mapping[int, Schema]) -> None:
        if path.exists() and path.resolve() == origin.resolve():
            raise EchostepError(f"{path}: that is the recording itself: give another name with -o")
        self.path = path
        self._schemas = schemas
        self._numbers: dict[int, int] = {0: 0}
        self._channels: dict[tuple[str, str, int], int] = {}
        with self._told():
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = path.open("wb")
        self._writer = Writer(self._file)
        self._writer.start(profile="", library="echostep")

    def about(self, about: Mapping[str, str]) -> None:
        """What the recorder was told; comes before the messages."""
        self._writer.add_metadata(METADATA_NAME, dict(about))

    def write(self, entry: Entry) -> None:
        """One message."""
        channel = entry.channel
        key = (channel.topic, channel.message_encoding, channel.schema_id)
        with self._told():
            number = self._channels.get(key) or self._register(channel, key)
            self._writer.add_message(number, entry.t_ns, entry.body, entry.publish_ns, entry.sequence)

    def _register(self, channel: Channel, key: tuple[str, str, int]) -> int:
        if channel.schema_id not in self._numbers and (schema := self._schemas.get(channel.schema_id)):
            self._numbers[schema.id] = self._writer.register_schema(schema.name, schema.encoding, schema.data)
        schema_id = self._numbers.get(channel.schema_id, 0)
        self._channels[key] = self._writer.register_channel(
            channel.topic, channel.message_encoding, schema_id, channel.metadata
        )
        return self._channels[key]

    def close(self) -> None:
        """Finish the file."""
        with self._told():
            self._writer.finish()  # type: ignore[no-untyped-call]
            self._file.close()

    def __enter__(self) -> Packer:
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

    @contextmanager
    def _told(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise EchostepError(f"{self.path}: cannot write: {error.strerror}") from error


@dataclass
class PortFacts:
    """What one port brought."""

    chunks: int = 0
    received: int = 0
    last_ns: int = 0
    longest_gap_s: float = 0.0
    gaps: int = 0

    def add(self, entry: Entry) -> None:
        """Count one chunk."""
        gap_s = (entry.t_ns - self.last_ns) * 1e-9 if self.chunks else 0.0
        self.longest_gap_s = max(self.longest_gap_s, gap_s)
        self.gaps += gap_s > GAP_S
        self.chunks += 1
        self.received += len(entry.body)
        self.last_ns = entry.t_ns


@dataclass
class Facts:
    """What is in a recording."""

    ports: dict[str, PortFacts] = field(default_factory=dict)
    derived: dict[str, int] = field(default_factory=dict)
    first_ns: int = LATEST_NS
    last_ns: int = 0
    earlier: int = 0  # chunks that stand behind later ones
    decoder: Decoder = field(default_factory=Decoder)
    notes: list[str] = field(default_factory=list)
    waiting: dict[str, bytearray] = field(default_factory=dict)
    firmware: str = ""  # of the board, as it said last

    @property
    def seconds(self) -> float:
        """From the first chunk to the last."""
        return max(self.last_ns - self.first_ns, 0) * 1e-9

    def add(self, entry: Entry) -> None:
        """Count one message."""
        port = port_of(entry.channel)
        if not port:
            self.derived[entry.channel.topic] = self.derived.get(entry.channel.topic, 0) + 1
            return
        self.earlier += entry.t_ns < self.last_ns
        self.first_ns, self.last_ns = min(self.first_ns, entry.t_ns), max(self.last_ns, entry.t_ns)
        self.ports.setdefault(port, PortFacts()).add(entry)
        waiting = self.waiting.setdefault(port, bytearray())
        waiting += entry.body
        if len(waiting) >= DECODED_AT_ONCE:
            self._try(port, waiting)

    def finish(self) -> None:
        """Decode what still waits."""
        for port, waiting in self.waiting.items():
            self._try(port, waiting)

    def _try(self, port: str, waiting: bytearray) -> None:
        try:
            self._decode(port, bytes(waiting))
        except EchostepError as error:
            if str(error) not in self.notes:
                self.notes.append(str(error))
        waiting.clear()

    def _decode(self, port: str, body: bytes) -> None:
        if port == BOARD:
            for row in self.decoder.board.frames(body).rows(IDENTITY)[1]:
                said = Identity.unpack(row.tobytes())
                self.firmware = f"{said.version_major}.{said.version_minor}.{said.version_patch}"
        elif port == MTX:
            self.decoder.mtx.feed_batch(body)


def info(path: Path) -> list[str]:
    """What a recording holds, in lines for people; raises EchostepError when it holds nothing."""
    salvage, facts = Salvage(path), Facts()
    for entry in shown(salvage, f"reading {path.name}"):
        facts.add(entry)
    facts.finish()
    if not facts.ports and not facts.derived:
        raise EchostepError(f"{path}: no message in it can be read: is this an echostep recording (.mcap)?")
    condition = _condition(salvage, facts)
    mend = f"  echostep repair {path} -o OUT makes a whole file of it"
    lines = [*_head(salvage, facts), *_ports(facts), *(condition or ["  whole"]), *([mend] if condition else [])]
    return [printable(line) for line in lines]


def printable(line: str) -> str:
    """The line without anything that a terminal would obey, and not endless: a stranger may have written it."""
    line = line if len(line) <= LONGEST_LINE else line[:LONGEST_LINE] + " ..."
    return "".join(c if c.isprintable() or c == "\n" else "?" for c in line)


def _head(salvage: Salvage, facts: Facts) -> list[str]:
    lines = [f"{salvage.path}: {salvage.size / 1e6:.1f} MB, {facts.seconds:.1f} s"]
    for key, value in salvage.about.items():
        if value:
            lines.append(f"  {key}: {value if len(value) < 100 and chr(10) not in value else _indented(value)}")
    return lines


def _indented(text: str) -> str:
    return "".join(f"\n    {line}" for line in text.splitlines())


def _ports(facts: Facts) -> list[str]:
    lines = []
    for name, port in sorted(facts.ports.items()):
        gaps = f", silent {port.gaps} times, {port.longest_gap_s:.1f} s at most" if port.gaps else ""
        lines.append(f"  {name}: {port.received} bytes in {port.chunks} chunks{gaps}")
    board, mtx = facts.decoder.board.counts, facts.decoder.mtx.counts
    if BOARD in facts.ports:
        lines.append(f"  board frames: {board.good} good, {board.rejected} bad, {board.lost} lost{_firmware(facts)}")
    if MTX in facts.ports:
        lines.append(f"  MTx samples: {mtx.good}{_rate(mtx.good, facts.seconds)}, {mtx.bad_checksum} bad checksums")
    if facts.derived:
        lines.append("  derived: " + ", ".join(f"{name} {count}" for name, count in sorted(facts.derived.items())))
    return lines


def _firmware(facts: Facts) -> str:
    return f"; firmware {facts.firmware}" if facts.firmware else ""


def _rate(count: int, seconds: float) -> str:
    return f" ({count / seconds:.1f}/s)" if seconds > 0.0 else ""


def _condition(salvage: Salvage, facts: Facts) -> list[str]:
    """What is wrong with the file, nothing: no lines."""
    lines = [f"  {note}" for note in facts.notes]
    places = [place for place in salvage.skipped if place[1] < salvage.size]
    if places:
        lost = sum(end - begin for begin, end in places)
        lines.append(f"  damaged: {lost} bytes in {len(places)} places make no sense, the first at byte {places[0][0]}")
    if salvage.closed:
        lines.append(f"  damaged: {salvage.closed} compressed chunks cannot be opened")
    if facts.earlier:
        lines.append(f"  {facts.earlier} chunks stand behind later ones")
    if not salvage.finished:
        middle = ", in the middle of a record" if len(places) < len(salvage.skipped) else ""
        lines.append(f"  the file ends too early{middle}: the recorder was stopped before it could close it")
    return lines


def repair(path: Path, out: Path) -> list[str]:
    """All that can be saved of a recording, in a file that every tool opens; raises EchostepError when nothing can."""
    salvage, saved = Salvage(path), Facts()
    with Packer(out, path, salvage.schemas) as packer:
        _copy(salvage, packer, shown(salvage, f"mending {path.name}"), saved.add, lambda about: about)
        if not saved.ports and not saved.derived:
            raise EchostepError(f"{path}: nothing in it can be saved: no message makes sense")
    chunks = sum(port.chunks for port in saved.ports.values())
    derived = sum(saved.derived.values())
    return [
        f"{out}: {chunks} chunks and {derived} derived messages, {saved.seconds:.1f} s",
        *(_condition(salvage, saved) or ["  nothing was wrong with it"]),
    ]


def cut(path: Path, begin_s: float, end_s: float, out: Path) -> list[str]:
    """The messages from `begin_s` up to `end_s`, seconds after the recording's first chunk; raises EchostepError when there are none.

    The wearer's place at the beginning of the piece is taken from the recorded estimates; without them a replay of the piece asks for it.
    """
    if not (math.isfinite(begin_s) and begin_s >= 0.0 and end_s > begin_s):
        raise EchostepError(
            f"--from {begin_s:g} --to {end_s:g}: expected 0 <= from < to, in seconds after the beginning"
        )
    first_ns = _first_ns(path)
    begin_ns = first_ns + round(begin_s * 1e9)
    end_ns = first_ns + round(end_s * 1e9) if math.isfinite(end_s) else 1 << 64
    start = _place_at(path, begin_ns) if begin_s > 0.0 else None
    salvage, kept = Salvage(path), Facts()

    def about(whole: Mapping[str, str]) -> dict[str, str]:
        place = {} if begin_s == 0.0 else {START: start or "unknown"}
        return {**whole, **place, "cut": f"{begin_s:g} to {end_s:g} s of {path.name}"}

    with Packer(out, path, salvage.schemas) as packer:
        wanted = (e for e in shown(salvage, f"cutting {path.name}") if begin_ns <= e.t_ns < end_ns)
        _copy(salvage, packer, wanted, kept.add, about)
        if not kept.ports:
            raise EchostepError(
                f"{path}: nothing was recorded from {begin_s:g} to {end_s:g} s; see echostep info {path}"
            )
    chunks = sum(port.chunks for port in kept.ports.values())
    lines = [f"{out}: {chunks} chunks, {kept.seconds:.1f} s"]
    if begin_s > 0.0 and start is None:
        lines.append("Where the wearer stood there is not recorded: replay it with --start X,Y,DEG")
    return lines


def _copy(
    salvage: Salvage, packer: Packer, entries: Iterable[Entry], count: Callable[[Entry], None],
    about: Callable[[Mapping[str, str]], Mapping[str, str]],
) -> None:  # fmt: skip
    """Entries into a new file, behind what the recorder was told as far as it is known by then."""
    begun = False
    for entry in entries:
        if not begun:
            begun = True
            packer.about(about(salvage.about))
        count(entry)
        packer.write(entry)


def _first_ns(path: Path) -> int:
    for entry in Salvage(path).entries():
        if port_of(entry.channel):
            return entry.t_ns
    raise EchostepError(f"{path}: no recorded bytes in it: is this an echostep recording (.mcap)?")


def _place_at(path: Path, t_ns: int) -> str | None:
    """The last estimate before a time, as a recording's start; None when there is none."""
    import json

    found = None
    for entry in Salvage(path).entries():
        if entry.channel.topic == "/estimate" and entry.t_ns <= t_ns:
            with suppress(ValueError, KeyError, TypeError):
                body = json.loads(entry.body)
                x, y, heading = (float(body[key]) for key in ("x_m", "y_m", "heading_rad"))
                found = f"{x!r},{y!r},{heading!r},{int(body.get('level', 0))}"
    return found


def shown(salvage: Salvage, title: str) -> Iterator[Entry]:
    """All entries, with a progress bar on a terminal."""
    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task(title, total=1.0)
        for k, entry in enumerate(salvage.entries()):
            if not k % SHOW_EVERY:
                progress.update(task, completed=salvage.fraction)
            yield entry
