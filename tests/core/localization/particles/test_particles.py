# SPDX-License-Identifier: MIT
"""The cloud and its likelihood: normalised mixtures, resampling, walls that kill, moves that scatter."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from echostep.echoes.likelihood import EchoSettings, echo_density, echo_model
from echostep.localization import CloudSettings, Start, TrackStatus
from echostep.localization.cloud_estimate import estimate_of
from echostep.localization.particles.cloud import Cloud, cloud_about
from echostep.particles.arrays import Move, PingBatch
from echostep.particles.ellipse import ellipse95
from echostep.particles.kernels import effective_size, systematic
from echostep.plan import Pose
from echostep.walls.echo_sources import Walls
from echostep.walls.tile_points import CORNER, EDGE

TRAVEL_M, ALIKE, UNPLANNED = 0.05, 0.2, 0.6  # path between two pings; density like the one before, and by no plan
MODEL = echo_model(EchoSettings())
BOX = Walls(np.array([[0.0, 0.0, 6.0, 0.0], [6.0, 0.0, 6.0, 2.0], [6.0, 2.0, 0.0, 2.0], [0.0, 2.0, 0.0, 0.0]]))
NONE = np.zeros(0)
NOTHING = PingBatch(NONE, NONE, NONE, NONE, np.zeros(0, np.int64), NONE, NONE, NONE, NONE, NONE)
Source = tuple[float, float, float]  # distance, degrees off the axis, kind


def cloud(size: int = 1000, heading: float = 0.0) -> Cloud:
    return cloud_about(CloudSettings(size=size), Start(Pose(1.0, 1.0, heading)), 0.0, np.random.default_rng(1))


def heard(axis_rad: float, range_m: float, count: int = 1, power: float = 0.3) -> PingBatch:
    share, axis, ranges, powers, travel, alike, unplanned = np.tile(
        [[0.5], [axis_rad], [range_m], [power], [TRAVEL_M], [ALIKE], [UNPLANNED]], count
    )
    stray = np.full(count, MODEL.stray)
    return PingBatch(
        share, axis, ranges, powers, np.zeros(count, np.int64), travel, stray, np.zeros(count), alike, unplanned
    )


def log_p(range_m: float, sources: list[Source]) -> float:
    rows = np.array(sources, dtype=float).reshape(-1, 3)
    return math.log(
        echo_density(range_m, len(rows), rows[:, 0].copy(), np.radians(rows[:, 1]), rows[:, 2].copy(), MODEL)
    )


@given(
    st.lists(
        st.tuples(st.floats(0.3, 6.2), st.floats(0.0, 35.0), st.sampled_from([0.0, EDGE, CORNER])), max_size=8
    ).map(sorted)
)
@settings(max_examples=25)
def test_the_mixture_is_a_probability(sources: list[Source]) -> None:
    """Summed over every range and no echo it is one; the normals' tails beyond the sensor's limits are all that may miss."""
    z = np.arange(0.0025, 7.5, 0.005)
    density = np.array([math.exp(log_p(float(r), sources)) for r in z])
    inside = density[(z >= 0.15) & (z <= 6.3)].sum() * 0.005
    assert 0.9 < inside + math.exp(log_p(0.0, sources)) < 1.1


def test_what_roughens_a_scattered_cloud_leads_through_no_wall() -> None:
    """All stand 5 cm before a wall: noise of 10 cm would carry a third of them through it."""
    scattered = cloud_about(CloudSettings(size=20), Start(Pose(1.0, 1.0, 0.0)), 0.0, np.random.default_rng(1))
    count = len(scattered.x_m)
    scattered.x_m, scattered.y_m = np.full(count, 0.05), np.linspace(0.1, 1.9, count)
    scattered.log_weight = np.where(np.arange(count) % 10, -50.0, 0.0)
    scattered.resample_if_needed(BOX.near(scattered.x_m, scattered.y_m, 1.0))
    assert scattered.is_scattered
    assert scattered.x_m.max() > 0.1 > scattered.x_m.min() > 0.0


def test_an_echo_where_the_wall_is_is_likeliest() -> None:
    wall = [(1.0, 0.0, 0.0)]
    assert all(log_p(z, wall) < log_p(1.0, wall) for z in (0.5, 0.8, 1.2, 3.0, 0.0))


def test_the_nearest_source_that_is_heard_answers() -> None:
    """An edge is heard now and then; a wall at the rim is heard less than one ahead; the inside of a corner nearly like a wall."""
    behind = (2.0, 0.0, 0.0)
    weak, strong = [(1.0, 0.0, EDGE), behind], [(1.0, 0.0, CORNER), behind]
    assert log_p(2.0, strong) < log_p(2.0, weak) < log_p(2.0, [behind])
    assert log_p(1.0, [behind]) < log_p(1.0, weak) < log_p(1.0, strong) <= log_p(1.0, [(1.0, 0.0, 0.0)])
    assert log_p(3.0, [(3.0, 33.0, 0.0)]) < log_p(3.0, [(3.0, 20.0, 0.0)]) < log_p(3.0, [(3.0, 0.0, 0.0)])


@given(st.lists(st.floats(0.0, 1.0), min_size=2, max_size=50), st.floats(0.0, 0.999), st.integers(1, 200))
def test_systematic_resampling_keeps_the_shares(weights: list[float], draw: float, count: int) -> None:
    weight = np.array(weights) + 1e-6
    chosen = systematic(weight, draw, count)
    expected = count * weight / weight.sum()
    copies = np.bincount(chosen, minlength=len(weight))
    assert copies.sum() == count
    assert (np.abs(copies - expected) <= 1.0 + 1e-6).all()


def test_the_effective_size() -> None:
    assert effective_size(np.ones(10)) == pytest.approx(10.0)
    assert effective_size(np.array([1.0, 0.0, 0.0])) == pytest.approx(1.0)
    assert effective_size(np.zeros(3)) == 0.0


def test_walls_take_the_weight_and_the_rest_carries_on() -> None:
    found = cloud()
    found.propagate_and_reweight(Move(0.0, 0.9, 0.1, 0.0), NOTHING, MODEL, BOX)  # up to the wall at y = 2
    assert estimate_of([(found, 1.0)], 0.0, 0.0, 0).y_m < 2.0
    assert estimate_of([(found, 1.0)], 0.0, 0.0, 0).ellipse95.major_m < 1.0


@pytest.mark.parametrize(("bend_m", "passes"), [(0.83, True), (0.0, False)])
def test_a_turn_leads_round_the_end_of_a_wall(bend_m: float, passes: bool) -> None:
    """North, then west by an arc of 90 degrees: the chord from begin to end cuts the wall's end by 0.1 m."""
    jamb = Walls(np.array([[-3.0, 1.5, 0.6, 1.5]]))
    found = cloud(200)
    found.x_m[:], found.y_m[:], found.turn_rad[:] = 1.0, 1.0, 0.0
    pings = heard(math.pi / 2, 0.0, 3)._replace(share=np.array([0.25, 0.5, 0.75]))
    move = Move(-0.8, 0.8, 0.01, 0.0, 0.0, bend_m * 0.8, bend_m * 0.8)
    assert (found.propagate_and_reweight(move, pings, MODEL, jamb).log_path > -0.1) == passes


def test_a_move_through_a_wall_is_survived_wider() -> None:
    found = cloud()
    found.x_m[:], found.y_m[:], found.turn_rad[:] = 1.0, 1.0, 0.0
    found.propagate_and_reweight(Move(0.0, 3.0, 0.01, 0.0), NOTHING, MODEL, BOX)
    assert estimate_of([(found, 1.0)], 0.0, 0.0, 0).ellipse95.major_m > 1.0


def test_echoes_find_the_place_across_a_corridor() -> None:
    found = cloud()
    for _ in range(30):
        for axis, range_m in ((math.pi / 2, 0.7), (-math.pi / 2, 1.3)):  # the left wall is 0.7 m away: y = 1.3
            explained = found.propagate_and_reweight(Move(0.0, 0.0, 0.0, 0.0), heard(axis, range_m), MODEL, BOX)
    assert estimate_of([(found, 1.0)], 0.0, 0.0, 0).y_m == pytest.approx(1.3, abs=0.05)
    assert explained[0] > 0.3 * 1.0  # the power of the pings


def test_an_unwatched_move_grows_the_cloud_and_it_shrinks_again() -> None:
    found = cloud(300)
    found.scatter(Move(0.0, 0.0, 6.0, 3.0))
    assert len(found.x_m) == CloudSettings().largest
    assert estimate_of([(found, 1.0)], 0.0, 0.0, 0).status == TrackStatus.LOST
    found.x_m[:] = 1.0 + 0.02 * np.random.default_rng(3).standard_normal(len(found.y_m))
    found.y_m[:] = 1.0 + 0.1 * np.random.default_rng(2).standard_normal(len(found.y_m))
    found.turn_rad[:] = 0.0
    for _ in range(60):
        found.propagate_and_reweight(Move(0.0, 0.0, 0.0, 0.0), heard(math.pi / 2, 1.0, power=1.0), MODEL, BOX)
    assert len(found.x_m) < 1000


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
    assert [TrackStatus.of(r) for r in (0.3, 2.0, 8.0, math.nan)] == ["tracking", "uncertain", "lost", "lost"]
