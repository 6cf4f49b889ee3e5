# SPDX-License-Identifier: MIT
"""The rehearsal of the acceptance walk with the real firmware, in the corridors that the manual names."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from board_runs import needs_twin
from echostep.localization import TrackStatus
from echostep_app.session.acceptance.walked import score_taps, walk_again
from session.acceptance.simulated_walk import record, walk

MANUAL = Path(__file__).parents[4] / "host/docs/board.md"
(GIVES_M,) = map(float, re.findall(r"its mean error is at most ([0-9.]+) m", MANUAL.read_text(encoding="utf-8")))


@needs_twin
@pytest.mark.parametrize(
    "lengths", ["8x2", pytest.param("20x2", marks=pytest.mark.long), pytest.param("30x2.4", marks=pytest.mark.long)]
)
def test_a_rehearsal_gives_what_the_manual_says(tmp_path: Path, lengths: str) -> None:
    """From the first estimate to the last."""
    protocol, chunks, taps = walk(lengths, twin=True)
    walked = walk_again(record(tmp_path / "walk.mcap", protocol, chunks, taps))
    assert {estimate.status for estimate in walked.estimates} == {TrackStatus.TRACKING}
    card = score_taps(walked, walked.timed).card
    assert card.points == len(taps)
    assert card.horizontal.mean_m <= GIVES_M
