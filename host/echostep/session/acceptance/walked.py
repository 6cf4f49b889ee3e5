# SPDX-License-Identifier: MIT
"""An acceptance walk tracked again from its recording, with the taps in between.

In: a recording. Out: `Walked`: estimates, taps and pings with their times. Owns nothing. Live and replayed pages are made of this alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import NamedTuple

from echostep.localization.estimate import Estimate
from echostep.plan.model import Plan
from echostep.ports.people.tap import POINT, parse_tap
from echostep.recording.reading import Recording, open_recording
from echostep.session.acceptance.heard import SeenPings
from echostep.session.acceptance.protocol import Protocol, recorded_protocol
from echostep.session.arrivals import Arrivals
from echostep.session.losses import Losses
from echostep.session.options import TrackingOptions
from echostep.session.progress import with_bar
from echostep.session.runs.replay import tracker_of
from echostep.tracker import Tracker


class TimedTap(NamedTuple):
    """A tap at `t_s`: of which point (its index), and whether the wearer stood on it."""

    t_s: float
    point: int
    standing: bool


@dataclass(slots=True)
class Taps:
    """Taps that were not taken back; `bad`: chunks that are none, or name no point, or came before any time was known."""

    points: int
    kept: list[TimedTap] = field(default_factory=list)
    taken_back: int = 0
    bad: int = 0

    def receive(self, payload: bytes, time_of: Callable[[int], float]) -> None:
        """Add the tap of a chunk, or take back the newest one; `time_of`: time of undelayed bytes that arrive then, NaN before any bytes."""
        tap = parse_tap(payload)
        if tap is not None and tap.point is None and self.kept:
            self.kept.pop()
            self.taken_back += 1
        elif tap is None or tap.point is None or tap.point >= self.points or math.isnan(t_s := time_of(tap.t_ns)):
            self.bad += 1
        else:
            self.kept.append(TimedTap(t_s, tap.point, tap.standing))


@dataclass(frozen=True, slots=True)
class Walked:
    """A walk that was tracked to its end."""

    recording: Recording
    protocol: Protocol
    plan: Plan
    tracker: Tracker
    estimates: list[Estimate]
    taps: Taps
    pings: SeenPings
    losses: Losses
    arrivals: Arrivals


def walk_again(path: Path) -> Walked:
    """Track a recording with its own plan, start, settings and seed; raises EchostepError."""
    recording = open_recording(path)
    protocol, plan = recorded_protocol(recording.metadata, path)
    tracker = tracker_of(recording, plan, TrackingOptions(None))
    walked = Walked(
        recording, protocol, plan, tracker, [], Taps(len(protocol.points)), SeenPings(), Losses(tracker), Arrivals()
    )
    tracker.watchers.append(walked.pings.note)
    for portion in with_bar(recording.portions(), f"tracking {path.name} again", lambda: recording.fraction):
        walked.arrivals.note(portion)
        for piece in portion.cut_after(POINT):
            walked.estimates.extend(tracker.take(piece))
            if tap := piece.of(POINT).received:
                walked.taps.receive(tap, partial(_time_of, tracker))
    return walked


def _time_of(tracker: Tracker, t_ns: int) -> float:
    """Time of undelayed bytes that arrive at `t_ns`, by the newest ones; NaN before any."""
    newest_s = tracker.front_end.newest_s
    return math.nan if math.isnan(newest_s) else newest_s + 1e-9 * (t_ns - tracker.arrival_ns(newest_s))
