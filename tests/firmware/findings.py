# SPDX-License-Identifier: MIT
"""What the app finds wrong with a board that a test has run."""

from __future__ import annotations

from board_runs import Bench
from echostep.board import messages as m
from echostep.board.reports import BoardReports
from echostep_app.board.faults.health import board_findings


def findings_of(bench: Bench) -> list[str]:
    """Every finding that any status gave rise to."""
    kept, found = BoardReports(), []
    for message in bench.messages:
        kept.add(message)
        if isinstance(message, m.Status):
            found += [str(f) for f in board_findings(kept)]
    return found
