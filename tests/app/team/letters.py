# SPDX-License-Identifier: MIT
"""Reports as a roster receives them."""

from __future__ import annotations

from echostep_app.team.messages.report import Report, encode
from echostep_app.team.roster import Roster
from team.team_reports import report

NOW, UNIX = 1000.0, 1.8e9


def heard(*reports: Report, at_s: float = NOW, retained: bool = False) -> Roster:
    roster = Roster()
    for r in reports:
        roster.receive(f"echostep/{r.team}/{r.name}/estimate", encode(r), retained, at_s, UNIX)
    return roster


def said(name: str = "anna", sequence: int = 1, **fields: object) -> Report:
    return report(name, sequence, UNIX, **fields)
