# SPDX-License-Identifier: MIT
"""Reports for the tests of the team: one that is right, and its parts.

Reports as a roster receives them.
"""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

from echostep.localization import Estimate
from echostep.plan import Plan
from echostep.tracker import Tracker
from echostep_app.printing.lines import moment
from echostep_app.team.endpoint import Outlet
from echostep_app.team.messages.report import Motion, Position, Report, ReportedPlace, StreamReport, encode
from echostep_app.team.publish import Publishing
from echostep_app.team.roster import Roster
from walks import PLAN

POSITION = Position(12.5, 0.0, 3.0, 2.0, 0.04, 0.01, 0.09, 0.75, 0.5, 0.1, 0, "Ground floor", 0.98, 0.0, 0.1)
PLACE = ReportedPlace(48.2, 16.37, None, 0.31, None, 61.4)


def report(name: str = "anna", sequence: int = 1, at_s: float | None = None, **fields: Any) -> Report:
    """A report of team red that says it was sent at this Unix time, now by default."""
    sent_s = time.time() if at_s is None else at_s
    made = Report(
        1, "red", name, "0123abcd", sequence, moment(sent_s), moment(sent_s + 10.0), "live", "tracking", POSITION,
        Motion(7, 9.5, 1.2, 0.4), PLACE, StreamReport(100.0, 360.0, 0, 0, 0, True, ()), "Demo office", PLAN.digest, "0.1.0", None, 0,
    )  # fmt: skip
    return replace(made, **fields)


def offered(plan: Plan, *estimates: Estimate) -> list[Report]:
    """What a tracker on this plan offers of these estimates."""
    reports: list[Report] = []
    publishing = Publishing(Outlet((), "anna", "red"), Tracker(plan), "live", print)
    publishing._offer = reports.append  # type: ignore[assignment, method-assign]
    publishing.publish(estimates)
    return reports


NOW, UNIX = 1000.0, 1.8e9


def heard(*reports: Report, at_s: float = NOW, retained: bool = False) -> Roster:
    roster = Roster()
    for r in reports:
        roster.receive(f"echostep/{r.team}/{r.name}/estimate", encode(r), retained, at_s, UNIX)
    return roster


def said(name: str = "anna", sequence: int = 1, **fields: object) -> Report:
    return report(name, sequence, UNIX, **fields)
