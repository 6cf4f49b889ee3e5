# SPDX-License-Identifier: MIT
"""What all pages of a run share beside the mailbox.

In: a plan. Out: `Shared`. Owns the counts over all pages.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from echostep.page.elements.guidance import RouteFinder
from echostep.page.elements.taps import Taps
from echostep.page.web.faults import Faults
from echostep.plan.model import Plan


@dataclass(slots=True)
class PageCounts:
    """Counts over all pages. `unknown`: requests that could not be parsed. `refused`: requests and pages. `flooding`: pages that asked too often."""

    unknown: int = 0
    refused: int = 0
    flooding: int = 0


@dataclass(frozen=True, slots=True)
class Shared:
    """One search for routes, one judge of check-ins, one list of faults, and the counts."""

    route_finder: RouteFinder
    taps: Taps
    faults: Faults = field(default_factory=Faults)
    counts: PageCounts = field(default_factory=PageCounts)

    @classmethod
    def of(cls, plan: Plan) -> Shared:
        """For the pages of a run on this plan."""
        return cls(RouteFinder(plan), Taps(plan))
