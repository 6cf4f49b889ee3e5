# SPDX-License-Identifier: MIT
"""Falls: simulated ones are told, what only looks like one is not, whichever sensors there are; the trunk's tilt."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echostep_app.wearer.falls import FRESH_S, Fall
from echostep_app.wearer.wearer_signs import Sign, WearerSigns
from echostep_studies.incapacity.falls import message_index, signs_of
from echostep_studies.simulation.body_motion import ICM20649, MTX, MotionSamples
from echostep_studies.simulation.falling import (
    FALLS,
    NO_FALLS,
    BodySamples,
    Manner,
    all_fours,
    forward,
    sideways,
    walk_then,
)


def run(manner: Manner, seed: int) -> BodySamples:
    return walk_then(manner, MTX if seed % 2 else ICM20649, np.random.default_rng(seed))


def falls(signs: list[Sign]) -> list[Fall]:
    return [sign for sign in signs if isinstance(sign, Fall)]


@pytest.mark.slow
@pytest.mark.parametrize("manner", FALLS)
def test_the_belt_tells_every_fall_once_within_7_s(manner: str) -> None:
    for seed in range(4):
        samples = run(FALLS[manner], seed)
        (fall,) = falls(signs_of(samples, belt=True))
        assert samples.event_s < fall.t_s < fall.known_s < samples.event_s + 7.0


@pytest.mark.slow
@pytest.mark.parametrize("manner", NO_FALLS)
def test_what_is_no_fall_is_not_told(manner: str) -> None:
    for seed in range(4):
        assert not falls(signs_of(run(NO_FALLS[manner], seed), belt=True))


def test_the_foot_alone_tells_falls_that_leave_it_on_its_side() -> None:
    told = [bool(falls(signs_of(run(sideways, seed), belt=False))) for seed in range(6)]
    assert sum(told) >= 4


@pytest.mark.slow
def test_all_fours_are_told_from_lying_by_the_thigh_alone() -> None:
    taken = 0
    for seed in range(8):
        samples = run(all_fours, seed)
        blind = samples._replace(thigh=MotionSamples(*(np.full_like(x, np.nan) for x in samples.thigh)))
        assert not falls(signs_of(samples, belt=True))
        taken += bool(falls(signs_of(blind, belt=True)))
    assert taken  # the limit of a belt without a thigh


def test_a_belt_without_an_accelerometer_leaves_it_to_the_foot() -> None:
    seed = next(seed for seed in range(6) if falls(signs_of(run(sideways, seed), belt=False)))
    samples = run(sideways, seed)
    for lives_s in (0.0, samples.event_s - 2.0):  # never there, or broken in mid-walk
        force = np.where(samples.belt.t_s[:, None] < lives_s, samples.belt.force, np.nan)
        blind = samples._replace(belt=samples.belt._replace(force=force))
        assert falls(signs_of(blind, belt=True)) == falls(signs_of(samples, belt=False))


def test_nothing_is_told_before_the_standing_direction_is_learnt() -> None:
    samples = run(forward, 1)
    assert not falls(signs_of(samples._replace(strides=samples.strides[:2]), belt=True))


@pytest.mark.parametrize("value", [math.nan, math.inf, -1e308, 1e38])
def test_numbers_that_no_sensor_measures_tell_nothing_and_break_nothing(value: float) -> None:
    samples = run(sideways, 1)
    rng = np.random.default_rng(1)
    for of in (samples.belt, samples.thigh, samples.foot):
        of.force[rng.random(of.force.shape) < 0.2] = value
        of.rate[rng.random(of.rate.shape) < 0.2] = value
    for belt in (True, False):
        assert not falls(signs_of(samples, belt=belt))


def test_the_trunks_tilt_is_told_while_the_belt_tells() -> None:
    samples, signs = run(forward, 2), WearerSigns()
    tilts: list[float] = []
    belt = samples.belt
    assert math.isnan(signs.falls.trunk_tilt_rad(0.0))
    for second in range(25):
        now = (belt.t_s >= second) & (belt.t_s < second + 1.0)
        part = message_index(belt.t_s[now])
        signs.add_belt(belt.t_s[now], belt.rate[now], belt.force[now], samples.thigh.force[now], part)
        signs.settle()
        for t0_s, t1_s in samples.strides.tolist():
            if second <= t1_s < second + 1.0:
                signs.falls.add_stride(t0_s, t1_s, 1.4)
        tilts.append(math.degrees(signs.falls.trunk_tilt_rad(second + 0.9)))
    walking = [tilt for tilt in tilts[: int(samples.event_s)] if not math.isnan(tilt)]
    assert walking
    assert max(walking) < 15.0
    assert 70.0 < tilts[-1] < 110.0
    assert math.isnan(signs.falls.trunk_tilt_rad(25.0 + FRESH_S))
