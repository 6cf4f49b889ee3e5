# SPDX-License-Identifier: MIT
"""The real foot on the plan drawn around its path: the figure that `make real` prints."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from echostep.recording import open_recording
from echostep_studies.bench.recordings.hallways import names_in, read_hallway
from echostep_studies.frame.recordings import DATA
from needs_data import needs_data
from waiting import PATIENCE_S, ran

pytestmark = needs_data("gx5_gcp")


@pytest.mark.long
@pytest.mark.process
def test_the_real_walk_is_tracked_within_its_target(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "echostep_studies.figures.real_walk", "--out", str(tmp_path), "--seed", "3"]
    done = ran(command, timeout=5.0 * PATIENCE_S)
    assert done.returncode == 0, done.stdout + done.stderr  # 1 when the RMSE is above 0.30 m
    assert "foot real" in done.stdout
    assert "echoes simulated" in open_recording(tmp_path / "walk.mcap").metadata["note"]
    assert (tmp_path / "track.png").stat().st_size > 10_000


def test_the_footprints_are_the_surveyed_ones() -> None:
    walk = read_hallway(names_in(DATA)["33"])
    assert len(walk.print_m) == 48
    stride = ((walk.print_m[1:] - walk.print_m[:-1]) ** 2).sum(1) ** 0.5
    assert 60.0 < stride.sum() < 66.0
    assert abs(walk.accel[:200, 2].mean() - 9.8) < 0.2  # z is up after mounting
