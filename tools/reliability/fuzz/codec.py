# SPDX-License-Identifier: MIT
"""Fuzz the firmware's codec, then all its portable files, with libFuzzer, one shard at a time (`make fuzz`), on from where the last one stopped.

In: tests/firmware/fuzz_codec.c, the firmware's codec, tests/firmware/corpus.txt (an input a line, hex), the log in out/fuzz. Out: the corpus
with what was found, reduced; for the whole firmware (tests/firmware/fuzz_firmware.c) the corpus in out/fuzz/firmware; the log with one more line;
executions so far on stdout. Exit status 1, and the input in out/fuzz, when a check
fails. Owns the build of the fuzzer. The sanitizers for addresses and undefined behaviour are on.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Sequence
from pathlib import Path

from places import OUT, ROOT
from reliability.campaign import CampaignJournal, Figure, options, report

FIRMWARE = ROOT / "firmware"
TESTS = ROOT / "tests/firmware"
SOURCES = [
    TESTS / "fuzz_codec.c",
    *(FIRMWARE / f"{name}.c" for name in ("cobs", "frame", "messages", "link", "status")),
]
# On a board that does what the input says
WHOLE = [TESTS / "fuzz_firmware.c", TESTS / "stub_board.c", *sorted(FIRMWARE.glob("*.c"))]
CORPUS = TESTS / "corpus.txt"
FOLDER = OUT / "fuzz"
FLAGS = ["-std=c11", "-O2", "-g", f"-I{FIRMWARE}", "-fsanitize=fuzzer,address,undefined"]
LONGEST = (70, 600)  # bytes of an input, in turn by shard: a frame, as many as fuzz_codec.c takes
WHOLE_LONGEST = (4000,)  # about a second of the board


def build(program: Path, sources: Sequence[Path] = SOURCES) -> Path:
    """The fuzzer, compiled; of the whole firmware, `main` is called by it."""
    options = ["-Dmain=firmware_main", "-fno-sanitize-recover=all", "-o", str(program)]
    subprocess.run(["clang", *FLAGS, *options, *map(str, sources)], check=True)
    return program


def unpack(folder: Path) -> Path:
    """The corpus as a folder with a file per input."""
    folder.mkdir()
    for number, line in enumerate(CORPUS.read_text().split()):
        (folder / str(number)).write_bytes(bytes.fromhex(line))
    return folder


def packed(inputs: Iterable[Path]) -> str:
    """The inputs, a line each, short ones first."""
    lines = {path.read_bytes().hex() for path in inputs if path.stat().st_size}
    return "".join(f"{line}\n" for line in sorted(lines, key=lambda line: (len(line), line)))


def fuzz(
    program: Path, corpus: Path, shard: int, *limits: str, longest: Sequence[int] = LONGEST
) -> subprocess.CompletedProcess[str]:
    """One run of the fuzzer, with the shard's number as its seed; new inputs go into the folder `corpus`."""
    command = [
        str(program),
        f"-max_len={longest[shard % len(longest)]}",
        f"-seed={shard}",
        "-print_final_stats=1",
        *limits,
        str(corpus),
    ]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def executions(log: str) -> int:
    """Executions of a run, from its log."""
    match = re.search(r"stat::number_of_executed_units:\s+(\d+)", log)
    return int(match[1]) if match else 0


def main() -> int:
    seconds = options(__doc__, seconds=(60, "of this run")).seconds
    journal = CampaignJournal(FOLDER / "codec.jsonl")
    shard = len(journal.rows) + 1
    with tempfile.TemporaryDirectory() as temporary:
        program = build(Path(temporary) / "fuzz")
        corpus, reduced = unpack(Path(temporary) / "corpus"), Path(temporary) / "reduced"
        done = fuzz(program, corpus, shard, f"-max_total_time={seconds}", f"-artifact_prefix={FOLDER}/")
        (FOLDER / "firmware").mkdir(exist_ok=True)
        limits = f"-max_total_time={seconds}", f"-artifact_prefix={FOLDER}/"
        whole = fuzz(
            build(Path(temporary) / "whole", WHOLE), FOLDER / "firmware", shard, *limits, longest=WHOLE_LONGEST
        )
        for failed in (run for run in (done, whole) if run.returncode):
            print(failed.stderr[-4000:], file=sys.stderr)
            return 1
        reduced.mkdir()
        subprocess.run([str(program), "-merge=1", str(reduced), str(corpus)], check=True, capture_output=True)
        CORPUS.write_text(packed(reduced.iterdir()))
    journal.add({"shard": shard, "executions": executions(done.stderr), "whole": executions(whole.stderr)})
    counts = [row["executions"] for row in journal.rows]
    return report(
        f"codec, shard {shard}: none failed",
        [
            Figure("executions", f"{counts[-1]:,}"),
            Figure("of all shards", f"{sum(counts):,}"),
            Figure("of the whole firmware", f"{sum(row.get('whole', 0) for row in journal.rows):,}"),
        ],
    )


if __name__ == "__main__":
    sys.exit(main())
