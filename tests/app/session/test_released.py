# SPDX-License-Identifier: MIT
"""What a run leaves behind in its process when it has ended: nothing of its tracker, session and page."""

from __future__ import annotations

import gc
from pathlib import Path

import pytest

from command_line import echostep
from echostep.tracker import Tracker
from echostep_app.page.live import LivePage
from echostep_app.session.runs import demo
from echostep_app.session.session import Session
from echostep_app.simulation.scenario import DEMO_WAYPOINTS


def alive() -> set[int]:
    gc.collect()
    return {id(o) for o in gc.get_objects() if type(o) in {Tracker, Session, LivePage}}


@pytest.mark.slow
def test_runs_in_one_process_leave_no_tracker_and_no_page_behind(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(demo, "DEMO_WAYPOINTS", DEMO_WAYPOINTS[:2])
    before = alive()
    for seed in (1, 2):
        done = echostep("demo", "--port", 0, "--seed", seed, "--out", tmp_path, "--no-open")
        assert done.returncode == 0, done.stderr
    assert alive() <= before
