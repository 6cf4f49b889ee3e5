# SPDX-License-Identifier: MIT
"""Importing maps of ROS: pixels to metres, thresholds, the pose of the origin; and pictures and formats that are not imported."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from echostep_app.plan.importers.formats import import_plan, open_plan
from echostep_app.plan.importers.report import ImportReport

FREE, UNKNOWN, OCCUPIED = 254, 205, 0
YAML = "image: map.{}\nresolution: 0.05\norigin: [-10.0, -20.0, {}]\nnegate: {}\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"


def grid() -> np.ndarray:
    """A room of 8 m by 6 m with walls of 0.1 m and a gap of 0.9 m in the east, in 200 by 160 pixels; a speck inside."""
    grid = np.full((160, 200), UNKNOWN, dtype=np.uint8)
    grid[20:140, 20:180] = OCCUPIED
    grid[22:138, 22:178] = FREE
    grid[60:78, 178:180] = FREE
    grid[100, 100] = OCCUPIED
    return grid


def test_a_room(tmp_path: Path) -> None:
    Image.fromarray(grid()).save(tmp_path / "map.pgm")
    (tmp_path / "map.yaml").write_text(YAML.format("pgm", 0, 0))
    report = ImportReport()
    plan = import_plan(tmp_path / "map.yaml", report=report)
    assert plan.levels[0].walls.reshape(-1, 2).min(axis=0) == pytest.approx((-10 + 20 * 0.05, -20 + 20 * 0.05))
    assert len(plan.levels[0].walls) == 12  # both faces, cut by the gap
    assert report.left_out == {"specks of less than 4 pixels": 1}
    assert report.units == "0.05 m a pixel (resolution)"
    assert open_plan(tmp_path / "map.yaml").digest == plan.digest


def test_a_slanting_wall_is_no_stair(tmp_path: Path) -> None:
    slanting = np.full((200, 200), FREE, dtype=np.uint8)
    for k in range(180):
        slanting[10 + k, 10 + k // 2 : 13 + k // 2] = OCCUPIED
    Image.fromarray(slanting).save(tmp_path / "map.pgm")
    (tmp_path / "map.yaml").write_text(YAML.format("pgm", 0, 0))
    assert len(import_plan(tmp_path / "map.yaml").levels[0].walls) <= 8
