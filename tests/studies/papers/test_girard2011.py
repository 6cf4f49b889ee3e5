# SPDX-License-Identifier: MIT
"""The filter of Girard et al. 2011: each printed formula against a naive twin, and whole steps."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from echostep.walls.echo_sources import Walls
from echostep_studies.papers.girard2011 import Girard, GirardSettings, average, disc, merge, moved, similarity
from echostep_studies.papers.girard2011_rays import lambda_ray_ranges
from naive import walls as naive

ROOM = np.array([[0.0, 0.0, 5.0, 0.0], [5.0, 0.0, 5.0, 3.0], [5.0, 3.0, 0.0, 3.0], [0.0, 3.0, 0.0, 0.0]])
PRINTED = GirardSettings()
floats = st.floats(0.05, 6.0)


def cloud(walls: np.ndarray | None = ROOM, settings_: GirardSettings = PRINTED) -> Girard:
    return Girard(settings_, (2.0, 1.5), walls, np.random.default_rng(1))


def test_the_parameters_are_the_printed_ones() -> None:
    assert (PRINTED.nu, PRINTED.epsilon_m, PRINTED.kappa, PRINTED.tau_m, PRINTED.rays) == (150, 0.25, 20, 0.05, 7)
    assert math.degrees(PRINTED.aperture_rad) == pytest.approx(55.0)


def test_step_3_draws_uniformly_in_the_disc() -> None:
    errors = disc(np.random.default_rng(2), 20_000, 0.25)
    radius = np.hypot(*errors.T)
    assert radius.max() <= 0.25
    assert np.mean(radius < 0.25 * math.sqrt(0.5)) == pytest.approx(
        0.5, abs=0.02
    )  # half of the area holds half of them
    assert np.abs(errors.mean(0)).max() < 0.005


def test_step_4_applies_every_vector_to_every_particle_and_walls_remove() -> None:
    x, y = np.array([1.0, 4.9]), np.array([1.5, 1.5])
    vectors = np.array([[0.0, 0.2], [0.3, 0.0]])
    to_x, to_y, parent = moved(x, y, vectors, Walls(ROOM).near(x, y))
    assert parent.tolist() == [0, 0, 1]  # the last would have gone through the wall at x = 5
    assert to_x.tolist() == [1.0, 1.3, 4.9]
    assert to_y.tolist() == [1.7, 1.5, 1.7]


@given(st.lists(st.tuples(st.floats(-0.2, 0.2), st.floats(-0.2, 0.2), st.floats(0.01, 1.0)), min_size=1, max_size=60))
def test_step_5_merges_what_is_closer_than_tau(points: list[tuple[float, float, float]]) -> None:
    points = sorted(points, key=lambda point: -point[2])
    rows = np.array(points)
    x, y, weight = merge(rows[:, 0].copy(), rows[:, 1].copy(), rows[:, 2].copy(), 0.05)
    kept = naive.merged(points, 0.05)
    assert sorted(zip(x.tolist(), y.tolist(), strict=True)) == sorted((a, b) for a, b, _ in kept)
    assert weight.sum() == pytest.approx(rows[:, 2].sum())
    apart = [
        math.hypot(a - c, b - d)
        for k, (a, b) in enumerate(zip(x, y, strict=True))
        for c, d in zip(x[:k], y[:k], strict=True)
    ]
    assert all(away >= 0.05 for away in apart)


@given(st.lists(st.tuples(floats, floats), min_size=1, max_size=10), st.tuples(floats, floats))
def test_equation_1(modelled: list[tuple[float, float]], measured: tuple[float, float]) -> None:
    found = similarity(np.array(modelled), np.array(measured), 6.0)
    assert found == pytest.approx([naive.similarity(row, measured, 6.0) for row in modelled])


def test_equation_1_of_a_perfect_match_and_of_no_echo() -> None:
    assert similarity(np.array([[1.0, 2.0]]), np.array([1.0, 2.0]), 6.0)[0] == 1.0
    assert similarity(np.array([[3.0, 6.0]]), np.array([6.0, 6.0]), 6.0)[0] == pytest.approx(0.75)


def test_equation_2() -> None:
    assert average(np.array([0.0, 4.0]), np.array([2.0, 2.0]), np.array([3.0, 1.0])) == (1.0, 2.0)


@pytest.mark.long
@given(st.floats(0.1, 4.9), st.floats(0.1, 2.9), st.floats(-math.pi, math.pi))
@settings(max_examples=50)
def test_equation_3_by_plain_rays(x: float, y: float, heading: float) -> None:
    """The reading from visible reflectors is that of seven rays which stop at the first wall."""
    walls = Walls(ROOM, 0.5 * PRINTED.aperture_rad / PRINTED.rays)
    at = np.array([x]), np.array([y])
    found = lambda_ray_ranges(*at, np.array([heading]), walls.near(*at))[0]
    for ranger, axis in enumerate((0.5 * math.pi, -0.5 * math.pi)):
        twin = naive.cone_reading(x, y, heading + axis, ROOM, 7, PRINTED.aperture_rad, 6.0)
        nearly = naive.cone_reading(x, y, heading + axis, ROOM, 7, PRINTED.aperture_rad * (1 - 1e-9), 6.0)
        assert found[ranger] == pytest.approx(twin, abs=1e-9) or abs(twin - nearly) > 1e-6


def test_one_step_is_the_eight_steps() -> None:
    """Against the whole filter in plain Python, with the same draws."""
    filter_, twin = cloud(), naive.Girard(ROOM, (2.0, 1.5), np.random.default_rng(1))
    for dx, pair in ((0.5, (1.5, 1.5)), (0.6, (1.4, math.nan)), (-0.4, (1.5, 1.6))):
        at = filter_.step(dx, 0.0, 0.0, pair)
        assert at == pytest.approx(twin.step(dx, 0.0, 0.0, pair), abs=1e-9)
        assert len(filter_.x_m) == len(twin.particles)


def test_the_cloud_is_capped_and_stays_in_the_room() -> None:
    filter_ = cloud()
    for _ in range(6):
        filter_.step(0.1, 0.0, 0.0, (1.5, 1.5))
    assert len(filter_.x_m) == 150
    assert ((filter_.x_m > 0.0) & (filter_.x_m < 5.0) & (filter_.y_m > 0.0) & (filter_.y_m < 3.0)).all()


def test_without_a_model_the_cloud_grows() -> None:
    filter_, spread = cloud(None), []
    for _ in range(12):
        filter_.step(0.0, 0.0, 0.0, None)
        spread.append(float(np.hypot(filter_.x_m - 2.0, filter_.y_m - 1.5).mean()))
    assert spread[5] > 1.5 * spread[0]


def test_a_step_through_a_wall_is_made_and_counted() -> None:
    filter_ = cloud()
    x, _ = filter_.step(6.0, 0.0, 0.0, None)
    assert x == pytest.approx(8.0, abs=0.2)
    assert filter_.lost == 1
