# SPDX-License-Identifier: MIT
"""Samples that are missing, repeated, late, clipped or nonsense."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from echostep.arrays import Floats
from echostep.foot.steps import Foot, walk_track
from foot import foot_walks as fw
from foot.foot_walks import moves, same, walking


def test_a_fifth_of_the_samples_may_be_missing() -> None:
    course = fw.course(fw.MANNERS["walking"], 10)
    t, accel, gyro = fw.samples(course, 100, rng=np.random.default_rng(8))
    kept = np.random.default_rng(9).random(len(t)) > 0.2
    track = walk_track(t[kept], accel[kept], gyro[kept])
    assert len(track.steps) == 10
    assert np.hypot(*moves(track)[:, :2].T) == pytest.approx(np.full(10, 1.3), abs=0.15)
    assert track.counts.gaps == 0


def test_duplicates_and_nonsense_are_counted_and_change_nothing() -> None:
    t, accel, gyro = walking()
    at = np.random.default_rng(10).choice(np.arange(1, len(t)), 90, replace=False)
    nonsense = np.array([np.nan, np.inf, 1e9])[np.arange(30) % 3]
    bad_accel, bad_gyro, bad_t = (np.repeat(v[at], 1, axis=0).copy() for v in (accel, gyro, t))
    bad_accel[:30, 0], bad_gyro[30:60, 2], bad_t[60:] = nonsense, -nonsense, t[at[60:] - 1]
    order = np.argsort(np.concatenate([np.arange(len(t)), at - 0.5]), kind="stable")
    mixed = [np.concatenate([a, b])[order] for a, b in ((t, bad_t), (accel, bad_accel), (gyro, bad_gyro))]
    track, plain = walk_track(mixed[0], mixed[1], mixed[2]), walk_track(t, accel, gyro)
    assert same(track.events, plain.events)
    assert (track.counts.impossible, track.counts.not_later) == (60, 30)
    assert track.counts.samples == len(t)


@pytest.mark.parametrize("gap_s", [0.4, 3.0, 100.0])
def test_a_gap_makes_it_unsure_and_it_recovers(gap_s: float) -> None:
    t, accel, gyro = walking(12)
    landing = 2.0 + 3 * 1.1 + 0.3  # in the middle of the fourth swing
    kept = (t < landing) | (t > landing + 1.1 * 2)
    t = np.where(t > landing, t + gap_s - 2.2, t)
    track = walk_track(t[kept], accel[kept], gyro[kept])
    across = [step for step in track.steps if step.t_start_s < landing < step.t_end_s]
    assert track.counts.gaps == 1
    assert len(across) == 1
    assert across[0].covariance[0, 0] >= (0.5 * gap_s) ** 2
    assert across[0].covariance[2, 2] >= (0.5 * gap_s) ** 2
    assert across[0].heading_sd_rad > 0.3
    after = [step for step in track.steps if step.t_start_s >= across[0].t_end_s]
    assert len(after) == 6
    assert np.hypot(*np.array([step.move_m for step in after])[:, :2].T) == pytest.approx(np.full(6, 1.3), abs=0.03)
    assert max(step.covariance[0, 0] for step in after) < 0.05


@pytest.mark.parametrize("gap_s", [0.4, 2.2, 4.4])
def test_who_walked_walks_on_where_samples_are_missing(gap_s: float) -> None:
    """The step over the gap is as long as the way at the pace before, and known to this."""
    t, accel, gyro = walking(16)
    begin = 2.0 + 4 * 1.1
    kept = (t < begin) | (t > begin + gap_s)
    track = walk_track(t[kept], accel[kept], gyro[kept])
    off = track.position_m[-1] - walk_track(t, accel, gyro).position_m[-1]
    sd = math.sqrt(max(step.covariance[0, 0] for step in track.steps))
    assert math.hypot(*off[:2]) < 2.0 * sd < 1.0 + 2.0 * gap_s


def test_a_hole_in_a_swing_is_no_observed_step() -> None:
    """A tenth of a second without samples: the step was a metre off, and was said to be known to 0.2 m."""
    t, accel, gyro = walking(12)
    swing = 2.0 + 3 * 1.1 + 0.3
    kept = (t < swing) | (t > swing + 0.12)
    track = walk_track(t[kept], accel[kept], gyro[kept])
    (across,) = (step for step in track.steps if step.t_start_s < swing < step.t_end_s)
    assert track.counts.gaps == 1
    off_m = math.hypot(across.move_m[0], across.move_m[1]) - 1.3
    assert abs(off_m) < 1.5 * math.sqrt(across.covariance[0, 0])
    assert across.covariance[0, 0] > 0.4**2


def test_a_clock_that_is_set_back_is_followed() -> None:
    t, accel, gyro = walking(10)
    t = np.where(t > 6.0, t - 5.5, t)
    track = walk_track(t, accel, gyro)
    assert track.counts.gaps == 1
    assert 0 < track.counts.not_later < 30
    assert len(track.steps) >= 8


def test_one_stamp_from_the_far_future_costs_a_few_samples_only() -> None:
    t, accel, gyro = walking(10)
    t[400] = 1e9
    track = walk_track(t, accel, gyro)
    assert track.counts.not_later < 30
    assert len(track.steps) >= 8


def test_clipped_gyros_are_noticed_and_trusted_less() -> None:
    t, accel, gyro = walking(10)
    limit = 0.8 * float(np.abs(gyro).max())
    track = walk_track(t, accel, np.clip(gyro, -limit, limit))
    plain = walk_track(t, accel, gyro)
    assert plain.counts.saturated == 0
    assert track.counts.saturated > 10
    assert len(track.steps) == 10
    assert np.hypot(*moves(track)[:, :2].T) == pytest.approx(np.full(10, 1.3), abs=0.08)
    assert track.steps[4].covariance[0, 0] > plain.steps[4].covariance[0, 0]


def test_a_start_in_mid_walk_is_unsure_but_a_start() -> None:
    """Switched on while running on a floor that shakes: not one still moment to take the level from."""
    course = fw.course(fw.MANNERS["running"], 20)
    t, accel, gyro = fw.samples(course, 200, rng=np.random.default_rng(11))
    on = (t > 2.3) & (t < course.landed_s[-1])
    t, accel, gyro = t[on], accel[on], gyro[on] + 0.5 * np.sin(250.0 * t[on])[:, None]
    track = walk_track(t, accel, gyro)
    assert track.steps[0].t_start_s - t[0] >= 3.0
    assert len(track.steps) >= 14
    assert np.hypot(*moves(track)[:, :2].T) == pytest.approx(np.full(len(track.steps), 2.4), abs=0.03)
    assert track.steps[0].covariance[0, 0] > track.steps[-1].covariance[0, 0]


def test_a_level_that_contradicts_every_rest_is_given_up() -> None:
    """The sensor slips by 30 degrees in mid-walk, within one sample."""
    t, accel, gyro = walking(16)
    slip = fw.pitched(np.array([0.5]))[0]
    after = t > 2.0 + 5 * 1.1 + 0.7
    track = walk_track(
        t, np.where(after[:, None], accel @ slip.T, accel), np.where(after[:, None], gyro @ slip.T, gyro)
    )
    assert track.counts.forced > 0
    assert np.hypot(*moves(track)[-6:, :2].T) == pytest.approx(np.full(6, 1.3), abs=0.03)


def test_a_large_gyro_bias_is_learnt_while_standing() -> None:
    t, accel, gyro = fw.samples(fw.course(fw.MANNERS["walking"], 10), 100)
    standing = np.arange(300)
    t = np.concatenate([standing / 100.0, t + 3.0])
    accel, gyro = np.vstack([accel[:1].repeat(300, 0), accel]), np.vstack([gyro[:1].repeat(300, 0), gyro])
    track = walk_track(t, accel, gyro + [0.05, -0.05, 0.05])
    walked = track.heading_rad[-1] - track.heading_rad[450]
    assert abs(walked) < 0.03


@settings(max_examples=60)
@given(
    table=arrays(
        np.float64, st.tuples(st.integers(1, 60), st.just(7)), elements=st.floats(allow_nan=True, allow_infinity=True)
    ),
    scale=st.sampled_from([1.0, 1e-3, 1e-300]),
)
def test_any_numbers_are_survived(table: Floats, scale: float) -> None:
    t, accel, gyro = walking(2)
    with np.errstate(over="ignore", invalid="ignore"):
        table = table * scale
    foot = Foot()
    foot.feed(t[:300], accel[:300], gyro[:300])
    foot.feed(table[:, 0], table[:, 1:4], table[:, 4:7])
    foot.feed(t[300:], accel[300:], gyro[300:])
    counts = foot.counts
    assert counts.samples + counts.impossible + counts.not_later == len(t) + len(table)
    assert np.isfinite(foot.position_m).all()
    assert math.isfinite(foot.heading_rad)
    assert np.isfinite(foot.nav.P).all()


def test_wrong_shapes_are_refused_in_one_line() -> None:
    with pytest.raises(ValueError, match="expected"):
        Foot().feed(np.zeros(3), np.zeros((3, 3)), np.zeros((2, 3)))
    assert Foot().feed(np.empty(0), np.empty((0, 3)), np.empty((0, 3))) == []
