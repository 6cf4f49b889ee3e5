# SPDX-License-Identifier: MIT
"""State that all pages of a run share, except the mailbox.

In: a plan. Out: `Shared`. Owns the counts over pages.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from echostep.plan import Plan
from echostep_app.page.elements.taps import Taps
from echostep_app.page.web.faults import Faults
from echostep_app.plan.closures import OpenWays


@dataclass(slots=True)
class PageCounts:
    """Counts over all pages. `unknown`: requests that could not be parsed. `refused`: requests and pages. `flooding`: pages that asked too often."""

    unknown: int = 0
    refused: int = 0
    flooding: int = 0


@dataclass(frozen=True, slots=True)
class Shared:
    """One router, one judge of check-ins, one list of faults, and the counts. `takes_files`: files may be dropped onto the pages."""

    ways: OpenWays
    taps: Taps
    faults: Faults = field(default_factory=Faults)
    counts: PageCounts = field(default_factory=PageCounts)
    takes_files: bool = False

    @classmethod
    def of(cls, plan: Plan, *, takes_files: bool = False) -> Shared:
        """For the pages of a run on this plan."""
        return cls(OpenWays(plan), Taps(plan), takes_files=takes_files)

    def on(self, plan: Plan) -> Shared:
        """For the same pages, which show a run on another plan from now on."""
        return replace(self, ways=OpenWays(plan), taps=Taps(plan))
