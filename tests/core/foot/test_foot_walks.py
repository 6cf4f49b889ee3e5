# SPDX-License-Identifier: MIT
"""Walks whose truth is known: one setting for every manner, rate and mounting."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from echostep.foot.steps import Foot, FootSettings, Stance, Step, walk_track
from foot import foot_walks as fw
from foot.foot_walks import moves, same, walking

LATENCY_S = 0.05


@pytest.mark.parametrize("rate_hz", [50, 100, 200, 500])
@pytest.mark.parametrize("manner", list(fw.MANNERS))
def test_every_manner_of_walking_at_every_rate(manner: str, rate_hz: int) -> None:
    course = fw.course(fw.MANNERS[manner], 10)
    track = walk_track(*fw.samples(course, rate_hz, rng=np.random.default_rng(rate_hz)))
    true = np.diff(course.prints_m, axis=0)
    assert len(track.steps) == 10
    off = np.hypot(*moves(track)[:, :2].T) - np.hypot(*true[:, :2].T)
    said = np.sqrt([np.linalg.eigvalsh(step.covariance[:2, :2])[-1] for step in track.steps])
    assert abs(off.mean()) < 0.01 * np.hypot(*true[0, :2]) + 0.01
    assert (np.abs(off) < 3.0 * said).all()
    assert moves(track)[:, 2] == pytest.approx(true[:, 2], abs=0.04)
    assert track.position_m[-1, 2] == pytest.approx(course.prints_m[-1, 2], abs=0.1)
    turned = track.heading_rad[-1] - 10 * fw.MANNERS[manner].turn_rad
    assert abs(math.remainder(turned, 2 * math.pi)) < 0.05
    assert track.counts.forced == 0


def test_steps_end_with_the_landing_and_are_told_at_once() -> None:
    course = fw.course(fw.MANNERS["walking"], 10)
    t, accel, gyro = fw.samples(course, 100, rng=np.random.default_rng(5))
    foot, steps = Foot(), []
    for k in range(len(t)):
        for event in foot.feed(t[k : k + 1], accel[k : k + 1], gyro[k : k + 1]):
            if isinstance(event, Step):
                steps.append(event)
                assert foot.in_stance
                assert t[k] - event.t_end_s <= LATENCY_S
    assert [step.t_end_s for step in steps] == pytest.approx(course.landed_s.tolist(), abs=0.06)
    assert [step.t_start_s for step in steps] == pytest.approx(course.left_s.tolist(), abs=0.12)


def test_stances_and_steps_alternate_and_moves_add_up_to_the_position() -> None:
    track = walk_track(*walking(10))
    for before, after in zip(track.events, track.events[1:], strict=False):
        assert isinstance(before, Step) != isinstance(after, Step)
        assert before.t_end_s <= after.t_start_s or isinstance(after, Stance)
    last = track.steps[-1]
    told = int(np.searchsorted(track.t_s, last.t_end_s + LATENCY_S))
    assert moves(track).sum(0) == pytest.approx(track.position_m[told], abs=0.01)
    assert track.stance[told]


def test_height_of_the_sensor_is_what_it_says() -> None:
    """A foot that rolls slowly under a sensor 15 cm up: told so, steps are right; told 0, every step is short."""
    manner = fw.FootManner(height_m=0.15, stance_s=0.9, roll_s=0.4, toe_off_rad=0.6)
    course = fw.course(manner, 10)
    samples = fw.samples(course, 200)
    off = {h: float(np.hypot(*moves(walk_track(*samples, FootSettings(h)))[:, :2].T).mean()) - 1.3 for h in (0.0, 0.15)}
    assert abs(off[0.15]) < 0.005
    assert off[0.0] < -0.01


def test_errors_are_no_larger_than_said() -> None:
    """Over many walks with an MTx's noise and biases: moves within their covariance, headings within their growth."""
    course = fw.course(fw.MANNERS["walking"], 8)
    nees, heading = [], []
    for seed in range(30):
        track = walk_track(*fw.samples(course, 100, rng=np.random.default_rng([6, seed])))
        assert len(track.steps) == 8
        for step, true in zip(track.steps, np.diff(course.prints_m, axis=0), strict=True):
            along = np.array([math.cos(step.heading_rad), math.sin(step.heading_rad), 0.0])
            off = float(np.hypot(*step.move_m[:2]) - np.hypot(*true[:2]))
            nees.append(off**2 / float(along @ step.covariance @ along))
        total = math.sqrt(sum(step.heading_sd_rad**2 for step in track.steps))
        heading.append(track.heading_rad[-1] / total)
    assert np.mean(nees) < 1.0
    assert 0.2 < np.sqrt(np.mean(np.square(heading))) < 1.5


def test_standing_for_ten_minutes_stays_there() -> None:
    rng = np.random.default_rng(7)
    t = np.arange(60_000) / 100.0
    accel = np.array([1.0, -2.0, 9.55]) + 0.02 * rng.standard_normal((len(t), 3))
    gyro = np.array([0.01, -0.02, 0.015]) + 0.0087 * rng.standard_normal((len(t), 3))
    track = walk_track(t, accel, gyro)
    assert track.events == []
    assert track.stance[100:].all()
    assert np.abs(track.position_m).max() < 0.02
    assert abs(track.heading_rad[-1]) < 0.06


@settings(max_examples=20)
@given(cuts=st.lists(st.integers(0, 900), max_size=30), seed=st.integers(0, 3))
def test_any_portions_give_the_same_bits(cuts: list[int], seed: int) -> None:
    t, accel, gyro = walking(3, seed=seed)
    edges = [0, *sorted(min(cut, len(t)) for cut in cuts), len(t)]
    foot = Foot()
    events = [e for a, b in zip(edges, edges[1:], strict=False) for e in foot.feed(t[a:b], accel[a:b], gyro[a:b])]
    whole = walk_track(t, accel, gyro)
    assert same(events, whole.events)
    assert foot.position_m == tuple(whole.position_m[-1])
    assert foot.heading_rad == whole.heading_rad[-1]
    assert foot.in_stance == whole.stance[-1]
    assert foot.counts == whole.counts
