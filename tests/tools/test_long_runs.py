# SPDX-License-Identifier: MIT
"""The long runs in short: demos one after the other in a process, browsers on the page of a replay and on a commander's; what is judged of them."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from echostep_app.session.runs import demo
from echostep_app.simulation.scenario import DEMO_WAYPOINTS
from reliability import demo_loops, viewers
from team.team_broker import needs_broker


@pytest.mark.slow
def test_two_demos_in_one_process(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(demo, "DEMO_WAYPOINTS", DEMO_WAYPOINTS[:2])
    monkeypatch.setattr("sys.argv", ["demo_loops", "--minutes", "0"])
    assert demo_loops.main() == 0
    assert "after the first" in capsys.readouterr().out


def test_growth_from_run_to_run_is_judged() -> None:
    k = np.arange(30.0)
    grows, stays = (np.stack([k * 2.0, 300.0 + mb * k], axis=1) for mb in (0.6, 0.4))
    assert [[f.passed for f in demo_loops.figures(rows) if f.limit != "-"] for rows in (grows, stays)] == [
        [False],
        [True],
    ]
    assert "+0.600 MB" in [f.measured for f in demo_loops.figures(grows)]
    assert [f.measured for f in demo_loops.figures(grows)][-1] == "+1080 MB/h"


@pytest.mark.long
@needs_broker
@pytest.mark.browser
@pytest.mark.process
@pytest.mark.skipif(shutil.which("chromium") is None, reason="no chromium on this machine")
def test_browsers_on_a_replay_and_on_a_commanders_page(tmp_path: Path) -> None:
    pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    figures = viewers.run(0.01, 2, viewers.WALK, tmp_path)
    assert {f.what for f in figures if f.passed} == {"requests without an answer", "errors of pages"}
    assert not [f for f in figures if f.passed is False]


def test_what_a_page_lacks_is_judged() -> None:
    rows = np.array([[t, 100.0 + t / 3600.0, 50.0] for t in range(0, 3600, 60)])
    answers = np.full((60, 5), 40.0)
    answers[3, 2] = viewers.ANSWER_MS
    figures = {f.what: f for f in viewers.figures(rows, answers, np.full(6, 29.9), [3.0, 2.0], ["wrong"])}
    assert figures["memory of replay"].measured.endswith("+1.0 MB/h after a fifth of the time")
    assert figures["requests without an answer"].measured == "1 of 300"
    assert [figures[what].passed for what in ("requests without an answer", "errors of pages")] == [False, False]
