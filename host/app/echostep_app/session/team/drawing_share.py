# SPDX-License-Identifier: MIT
"""A live walk without a plan, drawn for the team: what the page draws, or a drawing of its own where there is no page.

In: a tracker without a plan, under which name it publishes. Out: a `SharedDrawing`, which the teammate feed sends. Owns the drawing where there is
no page.
"""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime

from echostep.localization import Estimate
from echostep.path import MeasuredSegment
from echostep.plan import NO_PLAN
from echostep.tracker import Tracker
from echostep_app.page.drawing_process import DrawingProcess
from echostep_app.page.shared import SharedDrawing
from echostep_app.team.messages.shared_drawings import MOST_BYTES


def shared_drawing(tracker: Tracker, name: str) -> SharedDrawing:
    """The drawing of a tracker without a plan, in the frame of its start, named after the wearer and the time (UTC) at which the walk begins."""
    start = tracker.start.pose if tracker.start else None
    assert NO_PLAN.start is not None
    return SharedDrawing(start or NO_PLAN.start, f"drawn by {name}, {datetime.now(UTC):%Y-%m-%d %H:%M}Z", MOST_BYTES)


class UnseenDrawing:
    """Draws a run that has no page, from the tracker's segments; `close` ends it."""

    def __init__(self, tracker: Tracker, shared: SharedDrawing, fail: Callable[[str], object]) -> None:
        """`fail` is called with the words for an end before the end, in another thread."""
        self._tracker = tracker
        self._process = DrawingProcess(lambda _drawing: None, fail, live=True, shared=shared)
        tracker.watchers.append(self._watch)

    def close(self) -> None:
        """End the process."""
        self._tracker.watchers.remove(self._watch)
        self._process.close()

    def _watch(self, measured: MeasuredSegment | None, estimate: Estimate) -> None:
        if measured is not None:
            self._process.add(measured, estimate, 0)
