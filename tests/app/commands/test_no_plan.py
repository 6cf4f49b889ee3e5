# SPDX-License-Identifier: MIT
"""A walk in a building without a plan: its track, its height, its way back (simulated)."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
import pytest

from command_line import echostep
from echostep.height.height_filter import RelativeHeight
from echostep.height.levels import HeightChange
from echostep.plan import NO_PLAN
from echostep_app.session.metadata import run_metadata
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.scenario import Scenario
from page.frames import PLAN
from recording.damages import write_recording


@pytest.mark.slow
def test_a_walk_without_a_plan_is_tracked_and_led_back(tmp_path: Path) -> None:
    """Twenty metres along the corridor and back: the walk ends where it began, and the way back is said."""
    scenario = Scenario(PLAN, ((2.0, 7.5), (22.0, 7.5), (2.4, 7.5)), 4, PythonBoard(4))
    metadata = run_metadata(NO_PLAN, NO_PLAN.start, 4, "without a plan")
    write_recording(tmp_path / "walk.mcap", scenario.chunks(), metadata)
    replay = ("replay", "walk.mcap", "--headless")
    done = echostep(*replay, "--out", "first", "--guide", "exit", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader((tmp_path / "first/track.csv").read_text().splitlines()))
    x, y = (np.array([float(row[name]) for row in rows]) for name in ("x_m", "y_m"))
    assert abs(math.hypot(x[0], y[0])) < 0.1
    assert max(y) == pytest.approx(20.0, abs=0.5), "the first heading is up"
    assert math.hypot(x[-1], y[-1]) < 1.5
    cues = list(csv.DictReader((tmp_path / "first/cues.csv").read_text().splitlines()))
    assert "Turn around" in {cue["text"] for cue in cues[: int(np.argmax(y))]}
    assert cues[-1]["kind"] == "arrived"
    assert (tmp_path / "first/track.png").stat().st_size > 5_000
    again = echostep(*replay, "--out", "second", cwd=tmp_path)
    assert again.returncode == 0, again.stderr
    assert (tmp_path / "second/track.csv").read_bytes() == (tmp_path / "first/track.csv").read_bytes()
    assert "nothing corrects the drift" in again.stdout
    refused = echostep(*replay, "--guide", "Kitchen", cwd=tmp_path)
    assert (refused.returncode, refused.stderr.strip()) == (
        2, "echostep: --guide Kitchen: without a plan the only destination is: exit",
    )  # fmt: skip


def test_the_height_follows_the_foot_and_the_pressure_holds_it() -> None:
    """Twenty steps of 0.17 m with an error of 1 cm each, then standing while the weather moves the pressure by 0.5 m in ten minutes."""
    height = RelativeHeight(0.02)
    for k in range(20):
        height.update(HeightChange(0.18, 0.02, 100.0 + 0.17 * (k + 1), 0.14, 0.0, 0.7))
    assert height.height_m == pytest.approx(3.5, abs=0.15)
    for k in range(600):
        height.update(HeightChange(0.0, 0.005, 103.4 + 0.5 * k / 600, 0.14, 0.0, 1.0))
    assert height.height_m == pytest.approx(3.5, abs=0.4)
    assert 0.02 < height.sd_m < 0.6


def test_without_a_foot_the_pressure_alone_tells_the_height() -> None:
    height = RelativeHeight(0.02)
    for pressure_m in (50.0, 50.0, 53.0, 56.0, 56.0, 56.0):
        height.update(HeightChange(0.0, math.inf, pressure_m, 0.14, 0.0, 10.0))
    assert height.height_m == pytest.approx(6.0, abs=0.3)
    for _ in range(30):
        height.update(HeightChange(0.0, math.inf, 0.0, math.inf, 0.0, 10.0))
    assert height.sd_m > 3.0
