# SPDX-License-Identifier: MIT
"""The README's moving picture is of today's walk, small, and shows what its caption says."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from echostep.arrays import Ints
from echostep.localization import TrackStatus
from echostep.plan import load_plan
from echostep_app.output.track_plot import TRACK_COLOUR, TRUTH_COLOUR
from echostep_app.simulation.devices.board import PythonBoard
from echostep_app.simulation.scenario import Scenario
from echostep_studies.figures import walk_picture

pytestmark = pytest.mark.slow

PLAN = load_plan(walk_picture.PLAN)


@pytest.fixture(scope="module")
def walk() -> list[walk_picture.Moment]:
    """The first metres of the demo's walk."""
    return walk_picture.moments(Scenario(PLAN, ((2.0, 7.5), (7.0, 7.5)), walk_picture.SEED, PythonBoard(1)), PLAN)


def pixels_of(picture: Image.Image, colour: str, about: int = 12) -> int:
    """How many pixels have this colour, give or take `about` in each channel."""
    wanted = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)])
    rgb: Ints = np.asarray(picture.convert("RGB")).astype(int)
    return int((np.abs(rgb - wanted).max(axis=2) < about).sum())


def test_the_picture_in_the_manual_moves_is_small_and_is_of_this_walk() -> None:
    assert walk_picture.PICTURE.stat().st_size < 2_000_000
    with Image.open(walk_picture.PICTURE) as picture:
        shown: Any = picture
        assert shown.n_frames > 60
        assert shown.info["loop"] == 0
        described = picture.getexif()[walk_picture.IMAGE_DESCRIPTION]
        assert described == walk_picture.source(PLAN), (
            "the walk or the walls changed: python -m echostep_studies.figures.walk_picture"
        )
        picture.seek(shown.n_frames // 2)
        middle = picture.convert("RGB")
    for colour in (TRACK_COLOUR, walk_picture.PARTICLE_COLOUR):
        assert pixels_of(middle, colour, about=40) > 30, colour  # lossy


def test_each_frame_shows_truth_estimate_ellipse_and_particles(walk: list[walk_picture.Moment]) -> None:
    first, last = walk_picture.frames([walk[0], walk[-1]], PLAN)
    assert first.size == last.size
    for colour in (TRACK_COLOUR, TRUTH_COLOUR, walk_picture.PARTICLE_COLOUR):
        assert pixels_of(last, colour) > 30, colour
    assert np.any(np.asarray(first) != np.asarray(last))


def test_while_no_position_is_claimed_none_is_drawn(walk: list[walk_picture.Moment]) -> None:
    lost = replace(walk[-1], estimate=replace(walk[-1].estimate, status=TrackStatus.LOST))
    claimed, unclaimed = walk_picture.frames([walk[-1], lost], PLAN)
    assert pixels_of(unclaimed, TRACK_COLOUR) < pixels_of(claimed, TRACK_COLOUR) - 30
    assert pixels_of(unclaimed, walk_picture.PARTICLE_COLOUR) > 30


def test_the_true_position_is_that_of_the_estimates_moment(walk: list[walk_picture.Moment]) -> None:
    assert len(walk) > 8
    for moment in walk:
        off_m = np.hypot(*(np.array([moment.estimate.x_m, moment.estimate.y_m]) - moment.truth_m))
        assert off_m < 0.5
        assert np.hypot(*(moment.particles_m.mean(axis=0) - moment.truth_m)) < 0.5
    assert np.hypot(*(walk[-1].truth_m - walk[0].truth_m)) > 4.0


def test_the_written_picture_lasts_as_long_as_the_walk_six_times_faster(
    tmp_path: Path, walk: list[walk_picture.Moment]
) -> None:
    some = walk[:6]
    path = tmp_path / "walk.webp"
    walk_picture.write(path, some, walk_picture.frames(some, PLAN), "a test")
    with Image.open(path) as picture:
        shown: Any = picture
        lasting_ms = []
        for k in range(shown.n_frames):
            picture.seek(k)
            picture.load()
            lasting_ms.append(picture.info["duration"])
        assert picture.getexif()[walk_picture.IMAGE_DESCRIPTION] == "a test"
    walked_ms = 1000 * (some[-1].estimate.t_s - some[0].estimate.t_s) / walk_picture.SPEED
    assert abs(sum(lasting_ms[:-1]) - walked_ms) < 25 * len(lasting_ms)
