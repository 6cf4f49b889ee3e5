# SPDX-License-Identifier: MIT
"""Importing maps of ROS and pictures: dark pixels become walls by a scale, thresholds, the pose of the origin, letters are left out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageDraw

import command_line
from echostep.plan import load_plan
from echostep_app.plan.importers.formats import import_plan, is_foreign
from echostep_app.plan.importers.summary import size_m
from echostep_app.plan.places.gaps import door_gaps
from plan.imported_plans import imported_file

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
    plan, report = imported_file(tmp_path / "map.yaml")
    assert plan.levels[0].walls.reshape(-1, 2).min(axis=0) == pytest.approx((-10 + 20 * 0.05, -20 + 20 * 0.05))
    assert len(plan.levels[0].walls) == 12  # both faces, cut by the gap
    assert report.left_out == {"specks of less than 4 pixels": 1}
    assert report.units == "0.05 m a pixel (resolution)"
    assert is_foreign(tmp_path / "map.yaml")


def test_a_slanting_wall_is_no_stair(tmp_path: Path) -> None:
    slanting = np.full((200, 200), FREE, dtype=np.uint8)
    for k in range(180):
        slanting[10 + k, 10 + k // 2 : 13 + k // 2] = OCCUPIED
    Image.fromarray(slanting).save(tmp_path / "map.pgm")
    (tmp_path / "map.yaml").write_text(YAML.format("pgm", 0, 0))
    assert len(import_plan(tmp_path / "map.yaml").levels[0].walls) <= 8


PIXEL_M = 0.02
WALLS = (
    (50, 50, 550, 59),
    (50, 441, 550, 450),
    (50, 50, 59, 450),
    (541, 50, 550, 450),
    (250, 50, 259, 200),
    (250, 246, 259, 450),
)


def scan(path: Path, ink: int = 40, paper: int = 225) -> Path:
    """A house of 10 m by 8 m with a partition that has a gap of 0.9 m; letters, a frame of dots, grey paper with noise."""
    image = Image.new("L", (600, 500), paper)
    draw = ImageDraw.Draw(image)
    for box in WALLS:
        draw.rectangle(box, fill=ink)
    for x in (100, 120, 140):  # letters of 0.2 m
        draw.rectangle((x, 150, x + 3, 160), fill=ink)
    noise = np.random.default_rng(3).integers(-15, 15, (500, 600))
    Image.fromarray(np.clip(np.asarray(image) + noise, 0, 255).astype(np.uint8)).save(path)
    return path


@pytest.mark.parametrize(("kind", "ink", "paper"), [("png", 40, 225), ("jpg", 90, 150), ("bmp", 30, 90)])
def test_a_scan_becomes_walls(tmp_path: Path, kind: str, ink: int, paper: int) -> None:
    plan, report = imported_file(scan(tmp_path / f"a.{kind}", ink, paper), scale_m=PIXEL_M)
    (level,) = plan.levels
    assert size_m(level) == pytest.approx((10.0, 8.0), abs=0.1)
    assert 3 <= report.left_out["spots and letters up to 0.6 m"] < 10  # JPEG adds some
    assert report.units == "0.02 m a pixel (--scale)"
    assert "traced from a picture" in report.doubts[0]
    gaps = [gap for gap in door_gaps(level) if gap.width_m == pytest.approx(0.9, abs=0.1)]
    assert gaps
    assert all(4.0 <= gap.line[0] <= 4.2 + 2 * PIXEL_M + 1.0 for gap in gaps)


@pytest.mark.process
def test_the_command_takes_two_points(tmp_path: Path) -> None:
    """The outer walls are 500 pixels and 10 m apart."""
    path, out = scan(tmp_path / "a.png"), tmp_path / "plan.json"
    done = command_line.echostep("plan", "import", path, "-o", out, "--scale", "50,50,550,50=10", "--no-picture")
    assert done.returncode == 0, done.stderr
    assert size_m(load_plan(out).levels[0]) == pytest.approx((10.0, 8.0), abs=0.1)
    assert load_plan(out).picture == (0.02, 0.0, 0.0)
