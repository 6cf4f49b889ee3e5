# SPDX-License-Identifier: MIT
"""Flips one random bit of a recording at a time, and replays it: the effect on the track, and whether the replay reported it.

In: options, optionally a recording and its plan; without one the first seconds of the demo are simulated. Out: counts by result, each bad flip;
exit status 1 when a track ended early or went astray without a word, or when the repaired file does not replay in full. Owns nothing.

Half of the flips are in arrival times, half anywhere in the file.
"""

from __future__ import annotations

import math
import random
import struct
import sys
import tempfile
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from echostep.errors import EchostepError
from echostep.localization.estimate import Estimate
from echostep.plan.model import Plan, load_plan
from echostep.recording.mcap_records import HEAD_SIZE, LOG_TIME_OFFSET, MCAP_MAGIC, MESSAGE
from echostep.recording.reading import open_recording
from echostep_app.recording.recorder import Recorder
from echostep_app.recording.repair.edit import repair
from echostep_app.session.losses import skipped
from echostep_app.session.options import TrackingOptions
from echostep_app.session.runs.replay import tracker_of
from places import PLAN
from reliability.campaign import Figure, none, options, report, track
from walks import walk_chunks

ASTRAY_M = 0.5  # from the track of the undamaged recording: half the radius of a sure position
EARLY_S = 1.0  # before the end of the undamaged track: two estimates


@dataclass(frozen=True, slots=True)
class Replayed:
    """Estimates of a replay and its messages; no estimates and the error's text when the file is refused."""

    estimates: Sequence[Estimate]
    said: Sequence[str]


@dataclass(frozen=True, slots=True)
class Flip:
    """One flip: result of the replay, whether a message was printed, and the result of the repaired file."""

    offset: int
    bit: int
    result: str
    said: bool
    repaired: str

    @property
    def bad(self) -> bool:
        """Whether the track suffered without a word, or the repaired file does."""
        return (self.result in ("early", "astray") and not self.said) or (
            self.repaired in ("early", "refused") and self.result != "refused"
        )


def replay(path: Path, plan: Plan) -> Replayed:
    """Track a recording as `echostep replay` does."""
    try:
        recording = open_recording(path)
        tracker = tracker_of(recording, plan, TrackingOptions(PLAN))
        estimates = [estimate for portion in recording.portions() for estimate in tracker.take(portion)]
    except EchostepError as error:
        return Replayed([], [str(error)])
    return Replayed(estimates, skipped(recording, tracker.streams))


def compare(replayed: Replayed, expected: Sequence[Estimate]) -> str:
    """Same | near | astray | early | refused: a track beside the undamaged one."""
    if not replayed.estimates:
        return "refused"
    times = [e.t_s for e in replayed.estimates]
    if any(b < a for a, b in zip(times, times[1:], strict=False)):
        return "back in time"
    if list(replayed.estimates) == list(expected):
        return "same"
    end, last = replayed.estimates[-1], expected[-1]
    if len(replayed.estimates) < len(expected) - 2 or end.t_s < last.t_s - EARLY_S:
        return "early"
    return "astray" if math.hypot(end.x_m - last.x_m, end.y_m - last.y_m) > ASTRAY_M else "near"


def arrival_offsets(content: bytes) -> list[int]:
    """Offsets of the log times of all messages."""
    offsets, offset = [], len(MCAP_MAGIC)
    while offset + HEAD_SIZE <= len(content):
        opcode, length = struct.unpack_from("<BQ", content, offset)
        if opcode == MESSAGE:
            offsets.append(offset + HEAD_SIZE + LOG_TIME_OFFSET)
        offset += HEAD_SIZE + length
    return offsets


def flip_once(content: bytes, where: tuple[int, int], plan: Plan, expected: Sequence[Estimate], folder: Path) -> Flip:
    """Flip bit `where[1]` of byte `where[0]`, replay, repair, replay the repaired file."""
    offset, bit = where
    flipped = bytearray(content)
    flipped[offset] ^= 1 << bit
    damaged, whole = folder / "flipped.mcap", folder / "repaired.mcap"
    damaged.write_bytes(flipped)
    replayed = replay(damaged, plan)
    whole.unlink(missing_ok=True)
    try:
        repair(damaged, whole)
        repaired = compare(replay(whole, plan), expected)
    except EchostepError:
        repaired = "refused"
    return Flip(offset, bit, compare(replayed, expected), bool(replayed.said), repaired)


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


def record_walk(path: Path, seconds: float) -> None:
    """The first seconds of the demo as a recording."""
    with Recorder(path, {"seed": "1"}) as recorder:
        for chunk in walk_chunks(seconds):
            recorder.write(chunk)


def main() -> int:
    """Flip, replay, print."""
    asked = options(
        __doc__, flips=(314, "how many"), seed=(1, "of the places"), seconds=(30.0, "of the simulated walk")
    )
    plan = load_plan(PLAN)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        record_walk(folder / "walk.mcap", asked.seconds)
        content = (folder / "walk.mcap").read_bytes()
        expected = replay(folder / "walk.mcap", plan).estimates
        flips = [
            flip_once(content, where, plan, expected, folder)
            for where in track(draw_flips(content, asked.flips, asked.seed), "flips")
        ]
    bad = [flip for flip in flips if flip.bad]
    print(*(f"byte {flip.offset}, bit {flip.bit}: {flip}" for flip in bad), sep="\n", end="\n" * bool(bad))
    results = Counter(f"replayed: {f.result}, {'said' if f.said else 'silent'}" for f in flips)
    results += Counter(f"repaired and replayed: {f.repaired}" for f in flips)
    return report(
        f"{len(flips)} flips of {len(content)} bytes, {len(expected)} estimates",
        [*(Figure(text, str(count)) for text, count in results.most_common()), none("bad ones", len(bad))],
    )


if __name__ == "__main__":
    sys.exit(main())
