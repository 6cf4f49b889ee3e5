# SPDX-License-Identifier: MIT
"""Tracking on what a teammate has drawn: one wearer walks without a plan, then the others of the team on its drawing.

In: the walks of a team that begin side by side, a seed. Out: the drawing as the broker keeps it; estimates without a plan and on the drawing. Owns
nothing. The drawing grows by stretches, as a live run's does, and is complete when the others set out; all starts are known. Simulated.
"""

from __future__ import annotations

from echostep.localization import Estimate
from echostep.path import MeasuredSegment
from echostep.plan import NO_PLAN, Plan, Pose
from echostep.ports.chunks import portion_of
from echostep.tracker import Tracker
from echostep_app.mapping.growing import GrowingMap
from echostep_app.mapping.plan import plan_of
from echostep_app.page.drawing_process import Stretches
from echostep_app.plan.writer import plan_json
from echostep_app.team.messages.shared_drawings import checked_drawing
from echostep_studies.team.tracking import PORTION
from echostep_studies.team.walks import TeamWalks


def drawing_by(walks: TeamWalks, who: int) -> Plan:
    """The drawing of wearer `who` at the end of its walk, as a teammate receives it."""
    tracker, stretches, growing = Tracker(NO_PLAN, walks.starts[who]), Stretches(0.0), GrowingMap()
    mapped = None

    def note(measured: MeasuredSegment | None, estimate: Estimate) -> None:
        nonlocal mapped
        if measured is not None:
            stretches.add(measured, estimate, 0)
        if stretches.ready:
            mapped = growing.grow(stretches.pop()[0])

    tracker.watchers.append(note)
    _track(tracker, walks, who)
    assert mapped is not None
    drawn, _ = plan_of(mapped, walks.starts[who], f"drawn by wearer {who}")
    return checked_drawing(plan_json(drawn).encode())


def track_on(plan: Plan, walks: TeamWalks, who: int, seed: int) -> list[Estimate]:
    """Estimates of a wearer from its true start, on a plan of one storey."""
    true = walks.starts[who]
    return _track(Tracker(plan, Pose(true.x_m, true.y_m, true.heading_rad), seed=seed), walks, who)


def _track(tracker: Tracker, walks: TeamWalks, who: int) -> list[Estimate]:
    """Estimates of a tracker that takes all bytes of a wearer."""
    chunks = walks.chunks[who]
    parts = (portion_of(list(chunks[begin : begin + PORTION])) for begin in range(0, len(chunks), PORTION))
    return [estimate for part in parts for estimate in tracker.take(part)]
