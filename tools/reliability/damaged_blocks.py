# SPDX-License-Identifier: MIT
"""Damages blocks of a recording, as disks and file systems do, and replays it: what the tracker claims where the path has a hole.

In: options; the first seconds of the demo are simulated. Out: by kind of damage, the worst distance of an estimate that
says `tracking` from the undamaged track; exit status 1 when one is more than 1 m off, a time is moved, or a changed track is not told. Owns nothing.
"""

from __future__ import annotations

import math
import random
import struct
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from echostep.localization.estimate import Estimate, TrackStatus
from echostep.localization.limits import TRACKING_M
from echostep.plan.model import Plan, load_plan
from echostep.recording.mcap_records import HEAD_SIZE
from places import PLAN
from reliability.campaign import Figure, none, options, report, track
from reliability.flip_recording import arrival_offsets, record_walk, replay

PAGE = 4096  # bytes of a block of most file systems
PAGES = 16  # of a long stretch: a second and a half of a walk
LATE_S = 5.0  # of a time behind the end of the walk: it has been moved

Damage = Callable[[bytes, random.Random], bytes]


def _page(content: bytes, rng: random.Random, pages: int = 1) -> slice:
    """A stretch of whole blocks behind the first one."""
    begin = PAGE * rng.randrange(1, max(len(content) // PAGE - pages, 2))
    return slice(begin, begin + PAGE * pages)


def _replaced(content: bytes, where: slice, by: bytes) -> bytes:
    return content[: where.start] + by + content[where.stop :]


def _twice(content: bytes, rng: random.Random) -> bytes:
    where = _page(content, rng, rng.choice((1, PAGES)))
    return _replaced(content, where, 2 * content[where])


def _from_elsewhere(content: bytes, rng: random.Random) -> bytes:
    where, other = _page(content, rng), _page(content, rng, PAGES)
    return content[: where.start] + content[other] + content[where.start :]


def _exchanged(content: bytes, rng: random.Random) -> bytes:
    pages = rng.choice((1, PAGES))
    first, second = sorted((_page(content, rng, pages), _page(content, rng, pages)), key=lambda s: s.start)
    between = content[min(first.stop, second.start) : second.start]
    return _replaced(content, slice(first.start, second.stop), content[second] + between + content[first])


def _zeroed(content: bytes, rng: random.Random) -> bytes:
    for _ in range(rng.choice((1, 8))):
        content = _replaced(content, _page(content, rng), bytes(PAGE))
    return content


def _random(content: bytes, rng: random.Random) -> bytes:
    return _replaced(content, _page(content, rng), rng.randbytes(PAGE))


def _left_out(content: bytes, rng: random.Random) -> bytes:
    return _replaced(content, _page(content, rng, rng.choice((1, PAGES))), b"")


def _bits(content: bytes, rng: random.Random) -> bytes:
    changed = bytearray(content)
    for _ in range(len(content) * 8 // 100_000):
        changed[rng.randrange(8, len(content))] ^= 1 << rng.randrange(8)
    return bytes(changed)


def _messages(content: bytes) -> list[slice]:
    """Each message's record."""
    begins = [offset - HEAD_SIZE - 6 for offset in arrival_offsets(content)]
    return [slice(begin, begin + HEAD_SIZE + struct.unpack_from("<Q", content, begin + 1)[0]) for begin in begins]


def _messages_lost(content: bytes, rng: random.Random) -> bytes:
    """Those of one port, or of both, for a tenth of a second to some seconds."""
    messages, count = _messages(content), rng.choice((100, 250, 900, 4000))
    first, channel = rng.randrange(len(messages) - count), rng.choice((1, 2, None))
    for where in reversed(messages[first : first + count]):
        if channel in (None, struct.unpack_from("<H", content, where.start + HEAD_SIZE)[0]):
            content = _replaced(content, where, b"")
    return content


def _reversed(content: bytes, rng: random.Random) -> bytes:
    messages = _messages(content)
    first = rng.randrange(len(messages) - 200)
    run = messages[first : first + 200]
    return _replaced(content, slice(run[0].start, run[-1].stop), b"".join(content[where] for where in reversed(run)))


KINDS: dict[str, Damage] = {
    "a block or 16 written twice": _twice, "16 blocks from elsewhere put in": _from_elsewhere, "blocks exchanged": _exchanged,
    "1 or 8 blocks of zeros": _zeroed, "a block of random bytes": _random, "blocks left out": _left_out,
    "a flipped bit in 100,000": _bits, "messages left out": _messages_lost, "200 messages in reverse": _reversed,
}  # fmt: skip


def falsely_tracking_m(estimates: Sequence[Estimate], expected: Sequence[Estimate]) -> float:
    """Greatest distance of an estimate that says `tracking` from the undamaged track at its time; infinite for one later than that track."""
    t_s = np.array([e.t_s for e in expected])
    worst = 0.0
    for e in estimates:
        if e.t_s > t_s[-1] + LATE_S:
            return math.inf
        if e.status is TrackStatus.TRACKING:
            x, y = (
                float(np.interp(e.t_s, t_s, [getattr(other, axis) for other in expected])) for axis in ("x_m", "y_m")
            )
            worst = max(worst, math.hypot(e.x_m - x, e.y_m - y))
    return worst


def damage_once(
    content: bytes, kind: str, rng: random.Random, plan: Plan, expected: Sequence[Estimate], folder: Path
) -> tuple[float, bool]:
    """The worst distance, and whether the replay told of the damage or nothing has changed."""
    path = folder / "damaged.mcap"
    path.write_bytes(KINDS[kind](content, rng))
    replayed = replay(path, plan)
    return falsely_tracking_m(replayed.estimates, expected), bool(replayed.said) or list(replayed.estimates) == list(
        expected
    )


def main() -> int:
    """Damage, replay, print."""
    asked = options(
        __doc__, each=(12, "damages of each kind"), seed=(1, "of the places"), seconds=(30.0, "of the walk")
    )
    plan, rng = load_plan(PLAN), random.Random(asked.seed)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        record_walk(folder / "walk.mcap", asked.seconds)
        content = (folder / "walk.mcap").read_bytes()
        expected = replay(folder / "walk.mcap", plan).estimates
        cases = [(kind, k) for kind in KINDS for k in range(asked.each)]
        found = [
            (kind, *damage_once(content, kind, rng, plan, expected, folder)) for kind, _ in track(cases, "damages")
        ]
    figures = []
    for kind in KINDS:
        worst = [distance for name, distance, _ in found if name == kind]
        figures.append(Figure(f"{kind}: furthest from the track while tracking", f"{max(worst):.2f} m of {len(worst)}"))
    astray = sum(distance > TRACKING_M for _, distance, _ in found)
    silent = sum(not told for *_, told in found)
    title = f"{len(found)} damages of {len(content)} bytes, {len(expected)} estimates"
    return report(title, [*figures, none("falsely tracking", astray), none("not told", silent)])


if __name__ == "__main__":
    sys.exit(main())
