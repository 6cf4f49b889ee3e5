# SPDX-License-Identifier: MIT
"""Where each ping of a recorded walk was sent, by the tracker, while it is believed.

In: a recording, a tracker on its plan. Out: `PosedPings`. Owns nothing.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.localization.estimate import Estimate, TrackStatus
from echostep.path import MeasuredSegment
from echostep.ports.chunks import Portion
from echostep.tracker import Tracker


class PosedPings(NamedTuple):
    """Pings (n,) in order of time: `ranger` 0 left, 1 right; place in the map and axis; `range_m`, NaN without an echo.

    The last two are numbers of the whole walk: the share of the pings that were sent while `tracking`, which alone are here, and the ranger's part.
    """

    ranger: Ints
    x_m: Floats
    y_m: Floats
    axis_rad: Floats
    range_m: Floats
    believed: float
    part: int


class SwappedTracker(Tracker):
    """A tracker to which each ranger's pings are the other one's."""

    def _follow(self, measured: MeasuredSegment) -> list[Estimate]:
        return super()._follow(replace(measured, ranger=1 - measured.ranger))


def posed_pings(tracker: Tracker, portions: Iterable[Portion]) -> PosedPings:
    """Track a walk and place its pings."""
    rows: list[Floats] = []
    every, part = 0, 0

    def watch(measured: MeasuredSegment | None, estimate: Estimate) -> None:
        nonlocal every, part
        if measured is None:
            return
        every += len(measured.t_s)
        part = measured.ranger_part or part
        if estimate.status is TrackStatus.TRACKING and not measured.segment.unobserved:
            rows.append(_placed(measured, estimate, tracker.laid_out.sheet.pitch_m))

    tracker.watchers.append(watch)
    for portion in portions:
        tracker.take(portion)
    found = np.concatenate(rows) if rows else np.zeros((0, 5))
    ranger, x, y, axis, range_m = found.T
    return PosedPings(ranger.astype(np.int64), x, y, axis, range_m, len(found) / max(every, 1), part)


def _placed(measured: MeasuredSegment, estimate: Estimate, pitch_m: float) -> Floats:
    """Rows (k, 5) of a segment's pings: back from the estimate at its end, along the way in the walk frame."""
    segment = measured.segment
    span_s = segment.t1_s - segment.t0_s
    share = np.clip((measured.t_s - segment.t0_s) / span_s, 0.0, 1.0) if span_s > 0.0 else np.ones(len(measured.t_s))
    way_x, way_y = segment.way_m(share)
    back_x, back_y = segment.dx_m - way_x, segment.dy_m - way_y
    turn = estimate.heading_rad - segment.heading1_rad
    c, s = math.cos(turn), math.sin(turn)
    x = estimate.x_m + estimate.level * pitch_m - (c * back_x - s * back_y)
    y = estimate.y_m - (s * back_x + c * back_y)
    axis = estimate.heading_rad - (1.0 - share) * segment.turn_rad + measured.off_heading_rad
    return np.column_stack([measured.ranger, x, y, axis, measured.range_m])
