"""The cloud and its likelihood: normalised mixtures, resampling, walls that kill, moves that scatter."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from echostep.estimate import Status, ellipse95, estimate, trust
from echostep.likelihoods import EchoSettings, echo_model, log_echo
from echostep.particles import Cloud, CloudSettings, effective_size, systematic
from echostep.plan import Pose
from echostep.walls import FAR_M, build_index

MODEL = echo_model(EchoSettings())
BOX = build_index(np.array([[0.0, 0.0, 6.0, 0.0], [6.0, 0.0, 6.0, 2.0], [6.0, 2.0, 0.0, 2.0], [0.0, 2.0, 0.0, 0.0]]))


def cloud(size: int = 1000, heading: float = 0.0) -> Cloud:
    return Cloud(CloudSettings(size=size), Pose(1.0, 1.0, heading), 0.0, np.random.default_rng(1))


@pytest.mark.parametrize("wall", [0.3, 1.0, 3.0, 5.9, 7.0, FAR_M])
@pytest.mark.parametrize("edge", [0.4, FAR_M])
@pytest.mark.parametrize("off_axis_deg", [0.0, 20.0, 30.0])
def test_the_mixture_is_a_probability(wall: float, edge: float, off_axis_deg: float) -> None:
    """Summed over every range and no echo it is one; the normal's tail beyond the sensor's limits is all that may miss."""
    z = np.arange(0.0005, 7.5, 0.001)
    density = np.array([math.exp(log_echo(float(r), wall, math.radians(off_axis_deg), edge, MODEL)) for r in z])
    inside = density[(z >= 0.15) & (z <= 6.0)].sum() * 0.001
    silent = math.exp(log_echo(0.0, wall, math.radians(off_axis_deg), edge, MODEL))
    assert 0.75 < inside + silent < 1.25


def test_an_echo_where_the_wall_is_is_likeliest() -> None:
    best = log_echo(1.0, 1.0, 0.0, FAR_M, MODEL)
    assert all(log_echo(z, 1.0, 0.0, FAR_M, MODEL) < best for z in (0.5, 0.8, 1.2, 3.0, 0.0))


@given(st.lists(st.floats(0.0, 1.0), min_size=2, max_size=50), st.floats(0.0, 0.999), st.integers(1, 200))
def test_systematic_resampling_keeps_the_shares(weights: list[float], draw: float, count: int) -> None:
    weight = np.array(weights) + 1e-6
    chosen = systematic(weight, draw, count)
    expected = count * weight / weight.sum()
    copies = np.bincount(chosen, minlength=len(weight))
    assert copies.sum() == count
    assert (np.abs(copies - expected) <= 1.0 + 1e-6).all()


def test_the_effective_size() -> None:
    assert effective_size(np.zeros(10)) == pytest.approx(10.0)
    assert effective_size(np.array([0.0, -np.inf, -np.inf])) == pytest.approx(1.0)
    assert effective_size(np.full(3, -np.inf)) == 0.0


def test_walls_kill_and_the_rest_carries_on() -> None:
    found = cloud()
    found.move(0.0, 0.9, 0.1, 0.0, BOX)  # up to the wall at y = 2
    assert estimate(found, 0.0, 0.0, 0).y_m < 2.0
    assert found.rescues == 0


def test_a_move_through_a_wall_is_survived_wider() -> None:
    found = cloud()
    found.move(0.0, 3.0, 0.01, 0.0, BOX)
    assert found.rescues == 1
    assert estimate(found, 0.0, 0.0, 0).ellipse95.major_m > 1.0


def test_echoes_find_the_place_across_a_corridor() -> None:
    found = cloud()
    for _ in range(30):
        found.weigh(math.pi / 2, 0.7, 0.3, MODEL, BOX)  # the left wall is 0.7 m away: y = 1.3
        found.weigh(-math.pi / 2, 1.3, 0.3, MODEL, BOX)
    assert estimate(found, 0.0, 0.0, 0).y_m == pytest.approx(1.3, abs=0.05)


def test_an_unwatched_move_grows_the_cloud_and_it_shrinks_again() -> None:
    found = cloud(500)
    found.scatter(0.0, 0.0, 4.0, 3.0)
    assert len(found.x_m) == CloudSettings().largest
    assert estimate(found, 0.0, 0.0, 0).status == Status.LOST
    found.x_m[:] = 1.0
    found.y_m[:] = 1.0 + 0.1 * np.random.default_rng(2).standard_normal(len(found.y_m))
    for _ in range(60):
        found.weigh(math.pi / 2, 1.0, 1.0, MODEL, BOX)
    assert len(found.x_m) == 500


def test_the_ellipse_holds_95_percent() -> None:
    rng = np.random.default_rng(4)
    covariance = np.array([[0.5, 0.3], [0.3, 0.4]])
    points = rng.multivariate_normal([0, 0], covariance, 20_000)
    ellipse = ellipse95(0.5, 0.3, 0.4)
    c, s = math.cos(ellipse.angle_rad), math.sin(ellipse.angle_rad)
    along, across = points @ [c, s], points @ [-s, c]
    inside = (along / ellipse.major_m) ** 2 + (across / ellipse.minor_m) ** 2 <= 1.0
    assert inside.mean() == pytest.approx(0.95, abs=0.01)


def test_words_for_trust() -> None:
    assert [trust(r) for r in (0.3, 2.0, 8.0, math.nan)] == ["tracking", "uncertain", "lost", "lost"]
