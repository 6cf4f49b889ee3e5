# SPDX-License-Identifier: MIT
"""Stages between a source of chunks and the tracker: pacing, messages of people and team, recording, grouping into portions.

In: chunks in order of arrival; None where a live port delivered nothing for a while. Out: the same chunks with those messages among
them, and portions. Owns nothing.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import islice

from echostep.ports.chunks import Chunk, Portion, portion_of
from echostep_app.interruption import sleep
from echostep_app.output.foxglove import log_line
from echostep_app.printing.console import print_notices
from echostep_app.printing.people import output_faults
from echostep_app.recording.recorder import Recorder

LEAST_SLEEP_S = 0.02  # shorter waits are not worth a system call per chunk


def paced(chunks: Iterable[Chunk], speed: float) -> Iterator[Chunk]:
    """Delay chunks so that they come at most `speed` times as fast as they arrived."""
    start_s, first_ns = time.monotonic(), None
    for chunk in chunks:
        first_ns = chunk.t_arrival_ns if first_ns is None else first_ns
        early_s = (chunk.t_arrival_ns - first_ns) * 1e-9 / speed - (time.monotonic() - start_s)
        if early_s > LEAST_SLEEP_S:
            sleep(early_s)
        yield chunk


ArrivalNs = Callable[[Chunk | None], int]  # arrival time of what comes after a chunk


# A port without a device: its name, and what has come there since the last call
MessageSource = tuple[str, Callable[[], Iterable[bytes]]]


def with_messages(
    chunks: Iterable[Chunk | None], sources: Sequence[MessageSource], arrival_ns: ArrivalNs
) -> Iterator[Chunk | None]:
    """Insert what people and team have sent since the previous chunk, after that chunk."""
    for chunk in chunks:
        yield chunk
        for port, pop in sources:
            for payload in pop():
                yield Chunk(port, arrival_ns(chunk), payload)


def recorded(
    chunks: Iterable[Chunk | None], recorder: Recorder, *, wait_for_disk: bool = False
) -> Iterator[Chunk | None]:
    """Write each chunk before it is passed on, and a line on each fault of the output. `wait_for_disk`: for sources that can be slowed down."""
    told = 0
    for chunk in chunks:
        if chunk is not None:
            recorder.write(chunk)
            for fault in output_faults()[told:]:
                recorder.write_derived([log_line(chunk.t_arrival_ns + recorder.log_offset_ns, fault)])
                told += 1
            if wait_for_disk:
                recorder.wait_for_disk(chunk)
        print_notices(recorder.notices)
        yield chunk


def portions_of(chunks: Iterable[Chunk | None], size: int) -> Iterator[Portion]:
    """Portions of `size` chunks; with 1, no chunk waits for the next. A None gives no row, so a portion may be empty."""
    remaining = iter(chunks)
    while batch := list(islice(remaining, size)):
        yield portion_of([chunk for chunk in batch if chunk is not None])
