"""Kill a recording run with SIGKILL at random moments, and see what is left of the recording.

In: nothing but options. Out: how much of the last second is missing, on the terminal; exit status 1 when more than a second is, or when a file
does not open. Owns the processes that it starts.

What is killed is a process that records chunks as the ports deliver them (850 a second), holds the interpreter for long moments as the filter's
kernels do, and says on a pipe, which outlives it, when each chunk was handed to the recorder. What the pipe says and the file does not hold is lost.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from echostep.errors import EchostepError
from echostep.recording.edit import repair
from echostep.recording.mcap_records import MCAP_MAGIC
from echostep.recording.recorder import open_recording

CHUNK_NS = 1_200_000  # between two chunks: 850 a second, as both ports deliver them
HANDED = struct.Struct("<Qq")
LIMIT_S = 1.0

WRITER = """
import os, struct, sys, time
from echostep.recording.recorder import Note, Recorder
from echostep.ports.chunks import Chunk
from echostep.output.foxglove import pose
path, pipe = sys.argv[1], int(sys.argv[2])
number, busy = 0, [(k * 7919) % 100_003 for k in range(100_003)]
with Recorder(path, {"note": "to be killed"}) as recorder:
    os.write(pipe, struct.pack("<Qq", 0, time.monotonic_ns()))
    while True:
        now = time.monotonic_ns()
        number += 1
        recorder.write(Chunk("mtx" if number % 3 else "board", now, number.to_bytes(8, "little") * 2))
        if not number % 400:
            sorted(busy)  # one call into C: nobody else runs meanwhile
        if not number % 40:
            recorder.notes(pose(now, (1.0, 2.0, 0.0), 0.5))
        os.write(pipe, struct.pack("<Qq", number, now))
        time.sleep(0.0012)
"""


@dataclass(frozen=True, slots=True)
class Kill:
    """What one kill cost: chunks handed to the recorder, and for how long before the kill they are missing."""

    handed: int
    missing: int
    missing_s: float
    opens: bool


def kill_once(path: Path, after_s: float) -> Kill:
    """Record, kill `after_s` seconds after the first chunk, read what is left; raises AssertionError when a chunk is not what was recorded."""
    read_end, write_end = os.pipe()
    run = subprocess.Popen([sys.executable, "-c", WRITER, str(path), str(write_end)], pass_fds=[write_end])
    os.close(write_end)
    try:
        handed = [HANDED.unpack(_exactly(read_end))]
        end = time.monotonic() + after_s
        while time.monotonic() < end:
            handed.append(HANDED.unpack(_exactly(read_end)))
    finally:
        run.send_signal(signal.SIGKILL)
        run.wait()
    while row := os.read(read_end, HANDED.size):
        handed.append(HANDED.unpack(row))
    os.close(read_end)
    return _cost(path, handed)


def _exactly(pipe: int) -> bytes:
    row = os.read(pipe, HANDED.size)
    if len(row) < HANDED.size:
        raise RuntimeError("the recording process has died by itself")
    return row


def _cost(path: Path, handed: Sequence[tuple[int, int]]) -> Kill:
    try:
        numbers = [int.from_bytes(chunk.data[:8], "little") for chunk in open_recording(path).chunks()]
        repair(path, path.with_suffix(".mended.mcap"))
        opens = path.with_suffix(".mended.mcap").read_bytes().endswith(MCAP_MAGIC)
    except EchostepError:
        numbers, opens = [], len(handed) == 1  # nothing was recorded yet
    assert numbers == list(range(1, len(numbers) + 1)), "chunks are missing in the middle"
    lost = [t_ns for number, t_ns in handed if number > len(numbers)]
    missing_s = (handed[-1][1] - lost[0]) * 1e-9 + CHUNK_NS * 1e-9 if lost else 0.0
    return Kill(len(handed) - 1, len(lost), missing_s, opens)


def main() -> int:
    """Run the kills and print what they cost."""
    parser = argparse.ArgumentParser(description="kill -9 a recorder at random moments")
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--longest", type=float, default=3.0, metavar="S", help="latest moment of a kill")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    rng, kills = random.Random(options.seed), []
    with tempfile.TemporaryDirectory() as folder:
        for k in range(options.kills):
            kills.append(kill_once(Path(folder) / f"{k}.mcap", rng.uniform(0.05, options.longest)))
            if not (k + 1) % 20:
                print(f"{k + 1} kills, worst {max(kill.missing_s for kill in kills) * 1e3:.0f} ms missing", flush=True)
    worst = max(kill.missing_s for kill in kills)
    typical = sorted(kill.missing_s for kill in kills)[len(kills) // 2]
    closed = sum(not kill.opens for kill in kills)
    print(
        f"{len(kills)} kills: the last {typical * 1e3:.0f} ms missing (median), {worst * 1e3:.0f} ms at worst; "
        f"{sum(kill.handed for kill in kills)} chunks handed over, {sum(kill.missing for kill in kills)} missing; {closed} files do not open"
    )
    return int(worst > LIMIT_S or closed > 0)


if __name__ == "__main__":
    sys.exit(main())
