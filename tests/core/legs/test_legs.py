# SPDX-License-Identifier: MIT
"""Strides of simulated people, whose legs know nothing of the estimator: their feet are placed (`walker`)."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echostep.arrays import Floats
from echostep.legs.kinematics import CURVE_SPEED, LegLengths, heel_rise
from echostep.legs.stride import Flag
from echostep.legs.strides import StrideEstimator
from echostep_simulation.people.leg_angles import LegDimensions
from echostep_simulation.people.walker import Person, Waypoint, walk
from legs.leg_walks import strides_of, total_m, walked


def test_five_metres_by_many_people_whose_feet_are_placed() -> None:
    rng, errors = np.random.default_rng(7), []
    for seed in range(16):
        stride = rng.uniform(0.95, 1.55)
        thigh_m = rng.uniform(0.38, 0.47)
        leg = LegDimensions(thigh_m, min(rng.uniform(0.38, 0.47), 1.1 * thigh_m))  # longer shanks include the foot
        person = Person(stride_m=stride, stride_s=1.15 * (1.3 / stride) ** 0.6 * rng.uniform(0.93, 1.07), leg=leg)
        w = walk([(0.0, 0.0), (5.0, 0.0)], person, np.random.default_rng(seed))
        sign, bias = rng.choice([-1.0, 1.0], 2), 0.02 * rng.standard_normal(2)
        thigh, shank = (sign[k] * c[::10] + bias[k] for k, c in enumerate((w.thigh_rad_s, w.calf_rad_s)))
        errors.append(total_m(strides_of(w.t_s[::10], thigh, shank, LegLengths(leg.thigh_m, leg.shank_m))) / 5.0 - 1.0)
    assert np.abs(errors).mean() < 0.03
    assert np.abs(errors).max() < 0.05


def test_the_foot_pushes_off_farther_in_a_fast_walk() -> None:
    phase, shank = np.linspace(0.0, 0.6, 61), np.radians(np.linspace(15.0, -40.0, 61))
    still, slow, usual, fast = (heel_rise(phase, shank, speed) for speed in (0.0, 0.365, CURVE_SPEED, 0.565))
    assert np.degrees((fast - usual)[[33, 56]]) == pytest.approx([0.0, 6.0], abs=1e-9)
    assert np.degrees((usual - slow)[[33, 56]]) == pytest.approx([0.0, 3.0], abs=1e-9)
    assert (still >= 0.0).all()


@pytest.mark.parametrize("scale", [0.9, 1.1])
def test_lengths_are_linear_in_the_scale(scale: float) -> None:
    walk_samples = walked([(0.0, 0.0), (8.0, 0.0)])
    usual, scaled = (strides_of(*walk_samples, LegLengths(scale=k)) for k in (1.0, scale))
    steady = [
        (a.length_m, b.length_m) for a, b in zip(usual, scaled, strict=True) if not a.flags & ~Flag.SLOW & ~Flag.FAST
    ]
    assert len(steady) > 3
    assert all(b == pytest.approx(scale * a) for a, b in steady)


def test_a_poor_gyro_learns_its_bias_while_he_stands() -> None:
    t, thigh, shank = walked([(0.0, 0.0), (6.0, 0.0)])
    assert total_m(strides_of(t, thigh + 0.15, shank - 0.12)) == pytest.approx(
        total_m(strides_of(t, thigh, shank)), rel=0.01
    )


@pytest.mark.parametrize("hz", [50, 200, 500])
def test_any_rate(hz: int) -> None:
    assert total_m(strides_of(*walked([(0.0, 0.0), (20.0, 0.0)], hz=hz))) == pytest.approx(20.0, rel=0.05)


@pytest.mark.parametrize("thigh_sign", [1.0, -1.0])
@pytest.mark.parametrize("shank_sign", [1.0, -1.0])
def test_any_sign(thigh_sign: float, shank_sign: float) -> None:
    t, thigh, shank = walked([(0.0, 0.0), (8.0, 0.0)])
    usual = strides_of(t, thigh, shank)
    assert total_m(strides_of(t, thigh_sign * thigh, shank_sign * shank)) == pytest.approx(total_m(usual), abs=1e-9)


def test_portions_do_not_matter() -> None:
    t, thigh, shank = walked([(0.0, 0.0), (9.0, 0.0, 2.0), (9.0, 6.0)])
    legs, found = StrideEstimator(), []
    for a, b in ((0, 1), (1, 333), (333, 900), (900, len(t))):
        found += legs.feed(t[a:b], thigh[a:b], shank[a:b])
    assert [*found, *legs.finish()] == strides_of(t, thigh, shank, LegLengths())


def test_strides_follow_each_other() -> None:
    strides = strides_of(*walked([(0.0, 0.0), (25.0, 0.0, 3.0), (25.0, 20.0)]))
    assert all(a.t_end_s <= b.t_start_s + 0.02 for a, b in zip(strides, strides[1:], strict=False))
    assert sum(Flag.STANDING in s.flags for s in strides) >= 2


def test_backward_is_flagged_and_not_counted() -> None:
    t, thigh, shank = walked([(0.0, 0.0), (10.0, 0.0)])
    n = len(t)
    twice_s: Floats = np.arange(2.0 * n) * 0.01
    strides = strides_of(twice_s, np.concatenate([thigh, -thigh[::-1]]), np.concatenate([shank, -shank[::-1]]))
    back = [s for s in strides if Flag.BACKWARD in s.flags]
    assert len(back) >= 4
    assert all(s.length_m == 0.0 and s.length_sd_m > 0.3 and s.t_start_s > 0.9 * n * 0.01 for s in back)
    assert total_m(strides) == pytest.approx(10.0, abs=1.6)


def test_marching_in_place_is_not_a_way() -> None:
    t, thigh, shank = walked([(0.0, 0.0), (8.0, 0.0)])
    after = np.arange(0.0, 20.0, 0.01)
    moves = np.clip((after - 2.0) / 1.0, 0.0, 1.0) * np.clip((18.0 - after) / 1.0, 0.0, 1.0)
    lifted = moves * np.clip(np.sin(2 * math.pi * after / 1.2), 0.0, None) ** 2
    marched = [np.concatenate([a, np.gradient(k * lifted, after)]) for a, k in ((thigh, 0.7), (shank, -0.6))]
    strides = strides_of(np.concatenate([t, t[-1] + 0.01 + after]), marched[0], marched[1])
    in_place = [s for s in strides if s.t_start_s > t[-1] and Flag.STANDING not in s.flags]
    assert total_m(strides) == pytest.approx(8.0, abs=1.0)
    assert sum(Flag.UNSEEN in s.flags and s.length_sd_m > 0.3 for s in in_place) > 0.8 * len(in_place)


def test_stairs_are_recognised() -> None:
    for z0, z1, flag in ((3.5, 0.0, Flag.STAIRS_DOWN), (0.0, 3.5, Flag.STAIRS_UP)):
        way: list[Waypoint] = [(0.0, 0.0, 0.0, z0), (12.0, 0.0, 0.0, z0), (18.0, 0.0, 0.0, z1), (30.0, 0.0, 0.0, z1)]
        strides = strides_of(*walked(way))
        found = [s for s in strides if s.flags & (Flag.STAIRS_UP | Flag.STAIRS_DOWN)]
        assert 6 <= len(found) <= 14
        assert all(flag in s.flags and s.rise_m * (z1 - z0) > 0.0 for s in found)
        assert total_m(strides) == pytest.approx(30.0, rel=0.06)


def test_a_gap_is_bridged_and_said() -> None:
    t, thigh, shank = walked([(0.0, 0.0), (20.0, 0.0)])
    kept = (t < 9.0) | (t > 10.5)
    strides = strides_of(t[kept], thigh[kept], shank[kept])
    assert sum(Flag.GAP in s.flags for s in strides) == 1
    assert total_m(strides) == pytest.approx(20.0, rel=0.1)


def test_a_long_gap_is_unobserved() -> None:
    t, thigh, shank = walked([(0.0, 0.0), (20.0, 0.0)])
    later = np.where(t > 9.0, t + 1e6, t)
    strides = strides_of(later, thigh, shank)
    assert total_m(strides) < 21.0
    assert any(Flag.GAP in s.flags and s.length_m == 0.0 and s.length_sd_m > 10.0 for s in strides)


def test_nonsense_is_counted() -> None:
    t, thigh, shank = walked([(0.0, 0.0), (8.0, 0.0)])
    bad = thigh.copy()
    bad[::50], bad[25::50] = math.nan, 1e9
    legs = StrideEstimator()
    found = [*legs.feed(t, bad, shank), *legs.finish()]
    assert legs.counts.impossible == len(bad[::50]) + len(bad[25::50])
    assert total_m(found) == pytest.approx(8.0, rel=0.08)
    assert strides_of(np.empty(0), np.empty(0), np.empty(0)) == []
    assert total_m(strides_of(t, np.zeros_like(t), np.zeros_like(t))) == 0.0


def test_a_shank_to_the_floor_is_seen() -> None:
    whole = LegLengths(0.48, 0.56)
    assert whole.measured_to_floor
    assert whole.to_ankle_m == pytest.approx(0.483, abs=0.001)
    assert LegLengths(0.43, 0.43).to_ankle_m == 0.43
