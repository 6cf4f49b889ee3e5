# SPDX-License-Identifier: MIT
"""Recordings as disks and file systems damage them, and the replay of what is left.

In: the bytes of a recording, a generator of places. Out: damaged bytes; estimates, and what the replay says. Owns the kinds of damage.
"""

from __future__ import annotations

import math
import random
import struct
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from mcap.reader import make_reader

from echostep.localization import Estimate, TrackStatus
from echostep.ports.chunks import Chunk
from echostep.recording import MCAP_MAGIC, open_recording
from echostep.recording.damage.scan import CHUNK, CHUNK_HEAD
from echostep.recording.mcap_records import HEAD_SIZE, LOG_TIME_OFFSET, MESSAGE
from echostep_app.recording.recorder import Recorder
from echostep_app.session.losses import skipped
from echostep_app.session.options import TrackingOptions
from echostep_app.session.runs.replay import tracker_of
from walks import DEMO, PLAN, walk_chunks

BLOCK = 4096  # bytes, of most file systems
BLOCKS = 16  # of a long stretch: a second and a half of a walk
ASTRAY_M = 0.5  # from the track of the undamaged recording: half the radius of a sure position
EARLY_S = 1.0  # before the end of the undamaged track: two estimates
LATE_S = 5.0  # of a time behind the end of the walk: it has been moved


@dataclass(frozen=True, slots=True)
class Replayed:
    """Estimates of a replay, and its messages."""

    estimates: Sequence[Estimate]
    said: Sequence[str]


def write_recording(path: Path, chunks: Iterable[Chunk], metadata: Mapping[str, str]) -> bytes:
    """A recording of these chunks."""
    with Recorder(path, metadata) as recorder:
        for chunk in chunks:
            recorder.write(chunk)
    return path.read_bytes()


def read_by_index(path: Path, chunks: int, *, reverse: bool) -> list[bytes]:
    """Data of all messages in so many chunks, found by the index of chunks alone, as @mcap/core's indexed reader, Rerun and `mcap cat` find them."""
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
        assert summary is not None
        assert len(summary.chunk_indexes) == chunks
        return [message.data for _, _, message in make_reader(file).iter_messages(reverse=reverse)]


def record_walk(path: Path, seconds: float) -> bytes:
    """The first seconds of the demo as a recording."""
    return write_recording(path, walk_chunks(seconds), {"seed": "1"})


def replay(path: Path) -> Replayed:
    """Track a recording as `echostep replay` does."""
    recording = open_recording(path)
    tracker = tracker_of(recording, PLAN, TrackingOptions(DEMO))
    estimates = [estimate for portion in recording.portions() for estimate in tracker.take(portion)]
    return Replayed(estimates, skipped(recording, tracker.streams))


def compare(estimates: Sequence[Estimate], expected: Sequence[Estimate]) -> str:
    """Same | near | astray | early | back in time: a track beside the undamaged one."""
    times = [e.t_s for e in estimates]
    if any(b < a for a, b in zip(times, times[1:], strict=False)):
        return "back in time"
    if list(estimates) == list(expected):
        return "same"
    end, last = estimates[-1], expected[-1]
    if len(estimates) < len(expected) - 2 or end.t_s < last.t_s - EARLY_S:
        return "early"
    return "astray" if math.hypot(end.x_m - last.x_m, end.y_m - last.y_m) > ASTRAY_M else "near"


def falsely_tracking_m(estimates: Sequence[Estimate], expected: Sequence[Estimate]) -> float:
    """Greatest distance of an estimate that says `tracking` from the undamaged track at its time; infinite for one later than that track."""
    t_s = np.array([e.t_s for e in expected])
    if any(e.t_s > t_s[-1] + LATE_S for e in estimates):
        return math.inf
    sure = [e for e in estimates if e.status is TrackStatus.TRACKING]
    x_m, y_m = (np.interp([e.t_s for e in sure], t_s, [getattr(e, axis) for e in expected]) for axis in ("x_m", "y_m"))
    return float(np.hypot([e.x_m for e in sure] - x_m, [e.y_m for e in sure] - y_m).max(initial=0.0))


def arrival_offsets(content: bytes) -> list[int]:
    """Offsets of the log times of all messages, also in chunks that are not compressed."""
    offsets, offset = [], len(MCAP_MAGIC)
    while offset + HEAD_SIZE <= len(content):
        opcode, length = struct.unpack_from("<BQ", content, offset)
        if opcode == MESSAGE:
            offsets.append(offset + HEAD_SIZE + LOG_TIME_OFFSET)
        offset += CHUNK_HEAD if opcode == CHUNK else HEAD_SIZE + length
    return offsets


def message_records(content: bytes) -> list[slice]:
    """Each message's record."""
    begins = [offset - HEAD_SIZE - 6 for offset in arrival_offsets(content)]
    return [slice(begin, begin + HEAD_SIZE + struct.unpack_from("<Q", content, begin + 1)[0]) for begin in begins]


def flipped(content: bytes, offset: int, bit: int) -> bytes:
    """One bit is another one."""
    changed = bytearray(content)
    changed[offset] ^= 1 << bit
    return bytes(changed)


def draw_flips(content: bytes, count: int, seed: int) -> list[tuple[int, int]]:
    """Byte and bit of each flip: alternately in an arrival time and anywhere behind the first 8 bytes."""
    rng, times = random.Random(seed), arrival_offsets(content)
    return [
        (
            rng.choice(times) + rng.randrange(8) if k % 2 else rng.randrange(len(MCAP_MAGIC), len(content)),
            rng.randrange(8),
        )
        for k in range(count)
    ]


def _stretch(content: bytes, rng: random.Random, blocks: int = 1) -> slice:
    """Whole blocks behind the first one."""
    begin = BLOCK * rng.randrange(1, max(len(content) // BLOCK - blocks, 2))
    return slice(begin, begin + BLOCK * blocks)


def _replaced(content: bytes, where: slice, by: bytes) -> bytes:
    return content[: where.start] + by + content[where.stop :]


def _written_twice(content: bytes, rng: random.Random) -> bytes:
    where = _stretch(content, rng, rng.choice((1, BLOCKS)))
    return _replaced(content, where, 2 * content[where])


def _from_elsewhere(content: bytes, rng: random.Random) -> bytes:
    where, other = _stretch(content, rng), _stretch(content, rng, BLOCKS)
    return content[: where.start] + content[other] + content[where.start :]


def _exchanged(content: bytes, rng: random.Random) -> bytes:
    blocks = rng.choice((1, BLOCKS))
    first, second = sorted((_stretch(content, rng, blocks) for _ in range(2)), key=lambda stretch: stretch.start)
    between = content[min(first.stop, second.start) : second.start]
    return _replaced(content, slice(first.start, second.stop), content[second] + between + content[first])


def _zeroed(content: bytes, rng: random.Random) -> bytes:
    for _ in range(rng.choice((1, 8))):
        content = _replaced(content, _stretch(content, rng), bytes(BLOCK))
    return content


def _bits(content: bytes, rng: random.Random) -> bytes:
    for _ in range(len(content) * 8 // 100_000):
        content = flipped(content, rng.randrange(8, len(content)), rng.randrange(8))
    return content


def _messages_lost(content: bytes, rng: random.Random) -> bytes:
    """Those of one port, or of both, for a tenth of a second to some seconds."""
    messages, count = message_records(content), rng.choice((100, 250, 900, 4000))
    first, channel = rng.randrange(len(messages) - count), rng.choice((1, 2, None))
    for where in reversed(messages[first : first + count]):
        if channel in (None, struct.unpack_from("<H", content, where.start + HEAD_SIZE)[0]):
            content = _replaced(content, where, b"")
    return content


def _reversed(content: bytes, rng: random.Random) -> bytes:
    messages = message_records(content)
    first = rng.randrange(len(messages) - 200)
    run = messages[first : first + 200]
    return _replaced(content, slice(run[0].start, run[-1].stop), b"".join(content[where] for where in reversed(run)))


KINDS: dict[str, Callable[[bytes, random.Random], bytes]] = {
    "a block or 16 written twice": _written_twice,
    "16 blocks from elsewhere put in": _from_elsewhere,
    "blocks exchanged": _exchanged,
    "1 or 8 blocks of zeros": _zeroed,
    "a block of random bytes": lambda content, rng: _replaced(content, _stretch(content, rng), rng.randbytes(BLOCK)),
    "blocks left out": lambda content, rng: _replaced(content, _stretch(content, rng, rng.choice((1, BLOCKS))), b""),
    "a flipped bit in 100,000": _bits,
    "messages left out": _messages_lost,
    "200 messages in reverse": _reversed,
}
