# SPDX-License-Identifier: MIT
"""Where each ping of a recorded walk was sent, by the tracker, while it is believed.

In: a recording, a tracker on its plan. Out: `PosedPings`. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.localization import Estimate
from echostep.path import MeasuredSegment
from echostep.ports.chunks import Portion
from echostep.tracker import Tracker
from echostep_app.output.ping_poses import placed_pings


class PosedPings(NamedTuple):
    """Pings (n,) in order of time: `ranger` 0 left, 1 right; place in the map and axis; `range_m`, NaN without an echo.

    The last two are numbers of the whole walk: the share of the pings that were sent while `tracking`, the only ones here, and the ranger's part.
    """

    ranger: Ints
    x_m: Floats
    y_m: Floats
    axis_rad: Floats
    range_m: Floats
    believed: float
    part: int


class SwappedTracker(Tracker):
    """A tracker that takes each ranger's pings as the other one's."""

    def _follow(self, measured: MeasuredSegment) -> list[Estimate]:
        return super()._follow(replace(measured, ranger=1 - measured.ranger))


def posed_pings(tracker: Tracker, portions: Iterable[Portion]) -> PosedPings:
    """Track a walk and place its pings."""
    rows: list[Floats] = [np.zeros((0, 5))]
    every, part = 0, 0

    def watch(measured: MeasuredSegment | None, estimate: Estimate) -> None:
        nonlocal every, part
        if measured is None:
            return
        every += len(measured.t_s)
        part = measured.ranger_part or part
        on_sheet = [0.0, estimate.level * tracker.laid_out.sheet.pitch_m, 0.0, 0.0, 0.0]
        rows.append(placed_pings(measured, estimate) + on_sheet)

    tracker.watchers.append(watch)
    for portion in portions:
        tracker.take(portion)
    found = np.concatenate(rows)
    ranger, x, y, axis, range_m = found.T
    return PosedPings(ranger.astype(np.int64), x, y, axis, range_m, len(found) / max(every, 1), part)
