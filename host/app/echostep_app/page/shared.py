# SPDX-License-Identifier: MIT
"""State that all pages of a run share beside the mailbox, and the plan of a drawing for the team.

In: a plan; plan.json of a drawing, each replaces the one before. Out: `Shared`; the newest drawing, once. Owns the counts over pages,
and the drawing: neither the thread that draws nor the run that publishes it waits.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass, field, replace

from echostep.plan import Plan, Pose
from echostep_app.page.elements.guidance import RouteFinder
from echostep_app.page.elements.taps import Taps
from echostep_app.page.web.faults import Faults


@dataclass(slots=True)
class PageCounts:
    """Counts over all pages. `unknown`: requests that could not be parsed. `refused`: requests and pages. `flooding`: pages that asked too often."""

    unknown: int = 0
    refused: int = 0
    flooding: int = 0


@dataclass(frozen=True, slots=True)
class Shared:
    """One search for routes, one judge of check-ins, one list of faults, and the counts. `takes_files`: files may be dropped onto the pages."""

    route_finder: RouteFinder
    taps: Taps
    faults: Faults = field(default_factory=Faults)
    counts: PageCounts = field(default_factory=PageCounts)
    takes_files: bool = False

    @classmethod
    def of(cls, plan: Plan, *, takes_files: bool = False) -> Shared:
        """For the pages of a run on this plan."""
        return cls(RouteFinder(plan), Taps(plan), takes_files=takes_files)

    def on(self, plan: Plan) -> Shared:
        """For the same pages, which show a run on another plan from now on."""
        return replace(self, route_finder=RouteFinder(plan), taps=Taps(plan))


class SharedDrawing:
    """`start`: pose at which the walk begins in the plan; `name`: its name; `most_bytes`: a longer plan is not kept, and counted in `too_long`."""

    def __init__(self, start: Pose, name: str, most_bytes: int) -> None:
        self.start, self.name = start, name
        self.too_long = 0
        self._most_bytes = most_bytes
        self._lock = threading.Lock()
        self._newest: bytes | None = None

    def put(self, plan: bytes) -> None:
        """A newer plan; empty: nothing is drawn yet."""
        with self._lock:
            if len(plan) > self._most_bytes:
                self.too_long += 1
            elif plan:
                self._newest = plan

    def take(self) -> bytes | None:
        """The newest plan, if it was not taken yet."""
        with self._lock:
            newest, self._newest = self._newest, None
            return newest
