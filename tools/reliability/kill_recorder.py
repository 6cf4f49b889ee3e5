# SPDX-License-Identifier: MIT
"""Kills a recording process with SIGKILL at random moments, and measures what is missing from its file.

In: options. Out: how many milliseconds before each kill are missing; exit status 1 when it is more than a second, when a file does not open, or
when a recording of an earlier run is not the same bytes as before. Owns the processes that it starts.

All runs record under one name in one folder, as `echostep live` does.

The killed process records 850 chunks a second, as the ports deliver them, and holds the interpreter lock for long moments, as the filter's
kernels do. It writes number and time of each recorded chunk to a pipe, which outlives it. A chunk that is in the pipe but not in the file
is lost.
"""

from __future__ import annotations

import hashlib
import os
import random
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from echostep.errors import EchostepError
from echostep.recording import MCAP_MAGIC, open_recording
from echostep_app.recording.repair.edit import repair
from places import OUT
from reliability.campaign import CampaignJournal, Figure, none, options, report

CHUNK_NS = 1_200_000  # between two chunks: 850 a second, as both ports deliver them
ROW = struct.Struct("<Qq")
LIMIT_MS = 1000.0

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
    """Loss of one kill: chunks given to the recorder, chunks missing, the time before the kill that they span; earlier recordings that changed."""

    given: int
    missing: int
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
    return Kill(len(given) - 1, len(lost), missing_s, opens, changed)


def main() -> int:
    """Run the kills and print the losses."""
    asked = options(
        __doc__,
        out=(OUT / "kills.jsonl", "losses so far; they are not measured again"),
        kills=(200, "how many"),
        longest=(3.0, "latest moment of a kill, s"),
        seed=(1, "of the moments"),
    )
    rng = random.Random(asked.seed)
    with tempfile.TemporaryDirectory() as folder:
        wanted, moments_s = Path(folder) / "walk.mcap", [rng.uniform(0.05, asked.longest) for _ in range(asked.kills)]
        runs = {
            f"{k}, after {after_s:.3f} s": partial(kill_once, wanted, after_s) for k, after_s in enumerate(moments_s)
        }
        kills = CampaignJournal(asked.out).play("kill -9", runs)
    missing_ms = sorted(1e3 * kill["missing_s"] for kill in kills)
    return report(
        f"{len(kills)} kills",
        [
            Figure("missing at the end, median", f"{missing_ms[len(kills) // 2]:.0f} ms"),
            Figure("missing at worst", f"{missing_ms[-1]:.0f} ms", f"<= {LIMIT_MS:.0f} ms", missing_ms[-1] <= LIMIT_MS),
            *(Figure(f"chunks {what}", f"{sum(kill[what] for kill in kills):,}") for what in ("given", "missing")),
            none("files that do not open", sum(not kill["opens"] for kill in kills)),
            none("earlier recordings that changed", sum(kill["changed"] for kill in kills)),
        ],
    )


if __name__ == "__main__":
    sys.exit(main())
