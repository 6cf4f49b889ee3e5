# SPDX-License-Identifier: MIT
"""An acceptance walk tracked again from its recording, with the taps in between.

In: a recording. Out: `Walked`: estimates, taps and pings with their times. Owns nothing. Live and replayed pages are made of this alone.
Errors at the tapped points are those of ISO/IEC 18305, and against the radius that was stated there.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from echostep.errors import EchostepError
from echostep.localization import Estimate
from echostep.plan import Plan
from echostep.ports.chunks import LATEST_NS, POINT
from echostep.recording import Recording, open_recording
from echostep.tracker import Tracker
from echostep_app.ports.tap import Tap, parse_tap
from echostep_app.printing.progress import with_bar
from echostep_app.scorecard.card import PATH_S, Scored, score
from echostep_app.scorecard.track_columns import ScoredPath, track_of
from echostep_app.session.acceptance.heard import SeenPings
from echostep_app.session.acceptance.protocol import Protocol, recorded_protocol
from echostep_app.session.losses import Arrivals, Losses
from echostep_app.session.options import TrackingOptions
from echostep_app.session.runs.replay import tracker_of


class TimedTap(NamedTuple):
    """A tap at `t_s`: of which point (its index), and whether the wearer stood on it."""

    t_s: float
    point: int
    standing: bool


@dataclass(slots=True)
class Taps:
    """Taps that were not taken back; `bad`: chunks that are none, or name no point."""

    points: int
    kept: list[Tap] = field(default_factory=list)
    taken_back: int = 0
    bad: int = 0

    def receive(self, payload: bytes) -> None:
        """Add the tap of a chunk, or take back the newest one."""
        tap = parse_tap(payload)
        if tap is not None and tap.point is None and self.kept:
            self.kept.pop()
            self.taken_back += 1
        elif tap is None or tap.point is None or tap.point >= self.points:
            self.bad += 1
        else:
            self.kept.append(tap)


@dataclass(frozen=True, slots=True)
class Walked:
    """A walk that was tracked to its end."""

    recording: Recording
    protocol: Protocol
    plan: Plan
    tracker: Tracker
    estimates: list[Estimate]
    taps: Taps
    timed: list[TimedTap]
    pings: SeenPings
    losses: Losses
    arrivals: Arrivals


def walk_again(path: Path) -> Walked:
    """Track a recording with its own plan, start, settings and seed; raises EchostepError."""
    recording = open_recording(path)
    protocol, plan = recorded_protocol(recording.metadata, path)
    tracker, taps = tracker_of(recording, plan, TrackingOptions(None)), Taps(len(protocol.points))
    for portion in recording.portions():
        if POINT in portion.ports:
            for chunk in portion.where(portion.port == portion.ports.index(POINT)).chunks():
                taps.receive(chunk.data)
    walked = Walked(recording, protocol, plan, tracker, [], taps, [], SeenPings(), Losses(tracker), Arrivals())
    tracker.watchers.append(walked.pings.note)
    _track(walked, deque(sorted(taps.kept, key=lambda tap: tap.t_ns)))
    return walked


def _track(walked: Walked, due: deque[Tap]) -> None:
    """Track all portions; a tap's time is that of the newest message which had arrived by then, and the time since. One before any has no time."""
    recording, tracker, last_ns = walked.recording, walked.tracker, 0

    def time_next() -> None:
        tap = due.popleft()
        t_s = tracker.front_end.newest_s + 1e-9 * (tap.t_ns - last_ns)
        if not math.isnan(t_s) and tap.point is not None:
            walked.timed.append(TimedTap(t_s, tap.point, tap.standing))

    for portion in with_bar(recording.portions(), f"tracking {recording.path.name} again", lambda: recording.fraction):
        walked.arrivals.note(portion)
        arrival_ns, begin = np.maximum.accumulate(portion.t_arrival_ns), 0
        while begin < len(arrival_ns):
            end = int(np.searchsorted(arrival_ns, due[0].t_ns if due else LATEST_NS, side="right"))
            if end > begin:
                walked.estimates.extend(tracker.take(portion.rows(begin, end)))
                begin, last_ns = end, int(arrival_ns[end - 1])
            if begin < len(arrival_ns):
                time_next()
    while due:
        time_next()


class PointError(NamedTuple):
    """A point by its name: taps, mean error vector and mean distance (m)."""

    name: str
    taps: int
    x_m: float
    y_m: float
    mean_m: float


def score_taps(walked: Walked, taps: Sequence[TimedTap]) -> Scored:
    """Compare the estimates with the points at the times of their taps; raises EchostepError when there is nothing to compare."""
    path, points, plan = walked.recording.path, walked.protocol.points, walked.plan
    if not taps or not walked.estimates:
        what = "no position" if taps else "no tap"
        raise EchostepError(f"{path}: {what} in it, so no error: echostep info {path} shows what was recorded")
    t_s = np.array([tap.t_s for tap in taps])
    if len(taps) > 1 and float(np.median(np.diff(t_s))) <= PATH_S:
        raise EchostepError(
            f"{path}: most taps came within {PATH_S:g} s of the one before: no walk from point to point"
        )
    at = [points[tap.point] for tap in taps]
    floors = len(plan.levels) > 1
    truth = ScoredPath(
        Path("points"), t_s, np.array([(p.x_m, p.y_m) for p in at]), np.zeros(len(taps), bool), {},
        height_m=np.array([plan.levels[p.level].height_m for p in at]) if floors else None,
        level=np.array([float(p.level) for p in at]) if floors else None,
    )  # fmt: skip
    return score(track_of(walked.estimates, str(path)), truth)


def by_point(walked: Walked, scored: Scored) -> list[PointError]:
    """The errors at each point that was tapped, in the order of the points."""
    at = scored.matched
    rows = []
    for point in walked.protocol.points:
        here = (at.true_xy_m == (point.x_m, point.y_m)).all(axis=1)
        if at.true_level is not None:
            here &= at.true_level == point.level
        if here.any():
            x_m, y_m = (at.xy_m - at.true_xy_m)[here].mean(axis=0).tolist()
            rows.append(PointError(point.name, int(here.sum()), x_m, y_m, float(at.error_m[here].mean())))
    return rows
