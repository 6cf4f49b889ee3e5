# SPDX-License-Identifier: MIT
"""Effect of a fault on a walk: silent streams, estimates beyond their stated error, and the table of both.

In: arrival times of valid measurements, estimates, the true path. Out: a `FaultOutcome`, rows of a Markdown table. Owns each stream's normal gap.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from echostep.arrays import Bools, Floats
from echostep.board import messages as m
from echostep.board.frames import BoardReader
from echostep.localization import Estimate, TrackStatus
from echostep.ports.chunks import BOARD, MTX, Chunk

SURE_M = 1.0  # an estimate with the status `tracking` claims to be within it


class Stream(NamedTuple):
    """A measurement, and the longest time between two valid ones that is normal."""

    is_valid: Callable[[m.Message], bool]
    normal_s: float


def _ping(ranger: m.Ranger) -> Stream:
    return Stream(lambda x: isinstance(x, m.Ping) and x.ranger == ranger and x.outcome != m.Outcome.BUS_ERROR, 0.25)


def _gyro(name: str) -> Stream:
    return Stream(lambda x: isinstance(x, m.Gyros) and getattr(x, name) != m.GYROS_INVALID, 0.05)


STREAMS = {
    "left": _ping(m.Ranger.LEFT),
    "right": _ping(m.Ranger.RIGHT),
    "thigh": _gyro("thigh"),
    "calf": _gyro("calf"),
    "belt": _gyro("belt"),
    "pressure": Stream(lambda x: isinstance(x, m.Pressure) and x.pressure != m.PRESSURE_PRESSURE_INVALID, 0.4),
    "compass": Stream(lambda x: isinstance(x, m.Compass) and x.bearing != m.COMPASS_BEARING_INVALID, 0.35),
    "sync": Stream(lambda x: isinstance(x, m.Sync), 0.06),
}
FOOT = "foot"  # the bytes of the MTx
NORMAL_S = {name: stream.normal_s for name, stream in STREAMS.items()} | {FOOT: 0.05}


@dataclass
class FaultOutcome:
    """What a fault did. `silent_s`: by stream, time in too wide gaps. `whole_s`: from the begin to the end of the last gap; None: never."""

    name: str
    lost_frames: int = 0
    silent_s: dict[str, float] = field(default_factory=dict)
    whole_s: float | None = 0.0
    tracking: float = 0.0  # share of the estimates after the begin
    worst_tracking_m: float = 0.0
    wrongly_sure: int = 0  # estimates that were `tracking` and more than SURE_M off
    worst_m: float = 0.0


def heard(
    chunks: Iterable[Chunk], reader: BoardReader, times_s: dict[str, list[float]], walk_s: Callable[[int], float]
) -> Iterator[Chunk]:
    """The same chunks; the times of valid measurements go into `times_s`. `walk_s`: seconds of the walk at an arrival time (ns)."""
    for chunk in chunks:
        t_s = walk_s(chunk.t_arrival_ns)
        if chunk.port == MTX:
            times_s[FOOT].append(t_s)
        for message in reader.feed(chunk.data) if chunk.port == BOARD else ():
            for name, stream in STREAMS.items():
                if stream.is_valid(message):
                    times_s[name].append(t_s)
        yield chunk


def judge_streams(
    outcome: FaultOutcome, times_s: dict[str, list[float]], begin_s: float, end_s: float, least_s: float = 0.0
) -> None:
    """Find the gaps of each stream from the fault's begin on; one of `least_s` or less is none."""
    for name, normal_s in NORMAL_S.items():
        arrived = np.array([begin_s, *(t_s for t_s in times_s[name] if begin_s <= t_s <= end_s), end_s])
        gaps = np.diff(arrived)
        wide = gaps > max(normal_s, least_s)
        if not wide.any():
            continue
        outcome.silent_s[name] = float(gaps[wide].sum())
        whole_s = None if wide[-1] else float(arrived[1:][wide][-1]) - begin_s
        if outcome.whole_s is not None:
            outcome.whole_s = None if whole_s is None else max(outcome.whole_s, whole_s)


def columns(estimates: Sequence[Estimate]) -> tuple[Floats, Floats, Bools]:
    """Times (n,), positions (n, 2), and whether the status is `tracking` (n,)."""
    xy_m = np.array([(e.x_m, e.y_m) for e in estimates]).reshape(-1, 2)
    sure = np.array([e.status is TrackStatus.TRACKING for e in estimates], np.bool_)
    return np.array([e.t_s for e in estimates]), xy_m, sure


def judge_estimates(outcome: FaultOutcome, t_s: Floats, xy_m: Floats, sure: Bools, truth: Floats) -> None:
    """Compare estimates (n,), (n, 2), `sure` those with the status `tracking`, with the true path (k, 3): t_s, x, y."""
    if not len(t_s):
        return
    true_m = np.column_stack([np.interp(t_s, truth[:, 0], truth[:, k]) for k in (1, 2)])
    off_m = np.hypot(*(xy_m - true_m).T)
    outcome.tracking = float(sure.mean())
    outcome.worst_tracking_m = float(off_m[sure].max(initial=0.0))
    outcome.wrongly_sure = int((off_m[sure] > SURE_M).sum())
    outcome.worst_m = float(off_m.max())


def _silent(outcome: FaultOutcome) -> str:
    """What was missing, streams of equal time together."""
    groups: dict[str, list[str]] = {}
    for name, seconds in outcome.silent_s.items():
        groups.setdefault(f"{seconds:.1f} s", []).append(name)
    if len(groups) == 1 and len(outcome.silent_s) == len(NORMAL_S):
        return f"all {next(iter(groups))}"
    return "; ".join(f"{', '.join(names)} {seconds}" for seconds, names in groups.items()) or "nothing"


def table(outcomes: list[FaultOutcome]) -> str:
    """The outcomes as a Markdown table."""
    lines = [
        "| fault | frames lost | silent | whole after | share of `tracking` | worst while `tracking` "
        f"| `tracking` and more than {SURE_M:g} m off | worst |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for o in outcomes:
        whole = "never" if o.whole_s is None else f"{o.whole_s:.1f} s"
        name = ", ".join(f"`{part}`" if "=" in part else part for part in o.name.split(", "))
        lines.append(
            f"| {name} | {o.lost_frames} | {_silent(o)} | {whole} | {100 * o.tracking:.0f} % "
            f"| {o.worst_tracking_m:.2f} m | {o.wrongly_sure} | {o.worst_m:.2f} m |"
        )
    return "\n".join(lines) + "\n"
