# SPDX-License-Identifier: MIT
"""A recording process that is killed with SIGKILL, and what is missing from its file.

It records 850 chunks a second, as the ports deliver them, and holds the interpreter lock for long moments, as the filter's kernels do. It writes
number and time of each recorded chunk to a pipe, which outlives it. A chunk that is in the pipe but not in the file is lost.
"""

from __future__ import annotations

import hashlib
import os
import struct
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from echostep.errors import EchostepError
from echostep.recording import MCAP_MAGIC, open_recording
from echostep_app.recording.repair.edit import repair

CHUNK_NS = 1_200_000  # between two chunks: 850 a second, as both ports deliver them
ROW = struct.Struct("<Qq")

WRITER = """
import os, struct, sys, time
from pathlib import Path
from echostep.ports.chunks import Chunk
from echostep_app.session.metadata import start_recording
from echostep_app.output.foxglove import pose
path, pipe = sys.argv[1], int(sys.argv[2])
number, busy = 0, [(k * 7919) % 100_003 for k in range(100_003)]
with start_recording(Path(path), {"note": "to be killed"}) as recorder:
    os.write(pipe, struct.pack("<Qq", 0, time.monotonic_ns()))
    while True:
        now = time.monotonic_ns()
        number += 1
        recorder.write(Chunk("mtx" if number % 3 else "board", now, number.to_bytes(8, "little") * 2))
        if not number % 400:
            sorted(busy)  # one call into C: no other thread runs meanwhile
        if not number % 40:
            recorder.write_derived(pose(now, (1.0, 2.0, 0.0), 0.5))
        os.write(pipe, struct.pack("<Qq", number, now))
        time.sleep(0.0012)
"""


@dataclass(frozen=True, slots=True)
class Kill:
    """Loss of one kill: the time before it that is missing, and earlier recordings that changed."""

    missing_s: float
    opens: bool
    changed: int


def recordings(wanted: Path) -> dict[str, str]:
    """Recordings under a name: name and digest of each."""
    pattern = f"{wanted.stem}-*{wanted.suffix}"
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in wanted.parent.glob(pattern)}


def kill_once(wanted: Path, after_s: float) -> Kill:
    """Record under a name, kill `after_s` seconds after the first chunk, read the file; AssertionError when a chunk in the middle is missing."""
    before = recordings(wanted)
    read_end, write_end = os.pipe()
    command = [sys.executable, "-c", WRITER, str(wanted), str(write_end)]
    run = subprocess.Popen(command, pass_fds=[write_end], stdout=subprocess.DEVNULL)
    os.close(write_end)
    with os.fdopen(read_end, "rb") as pipe:
        try:
            given = [ROW.unpack(pipe.read(ROW.size))]
            end = time.monotonic() + after_s
            while time.monotonic() < end:
                given.append(ROW.unpack(pipe.read(ROW.size)))
        finally:
            run.kill()
            run.wait()
        given += ROW.iter_unpack(pipe.read())
    after = recordings(wanted)
    changed = sum(after.get(name) != digest for name, digest in before.items())
    (new,) = after.keys() - before.keys()
    return _loss(wanted.with_name(new), given, changed)


def _loss(path: Path, given: Sequence[tuple[int, int]], changed: int) -> Kill:
    try:
        numbers = [int.from_bytes(chunk.data[:8], "little") for chunk in open_recording(path).chunks()]
        whole = path.with_name(f"repaired-{path.name}")
        repair(path, whole)
        opens = whole.read_bytes().endswith(MCAP_MAGIC)
    except EchostepError:
        numbers, opens = [], len(given) == 1  # killed before the first chunk was written
    assert numbers == list(range(1, len(numbers) + 1)), "chunks are missing in the middle"
    lost = [t_ns for number, t_ns in given if number > len(numbers)]
    missing_s = (given[-1][1] - lost[0]) * 1e-9 + CHUNK_NS * 1e-9 if lost else 0.0
    return Kill(missing_s, opens, changed)
