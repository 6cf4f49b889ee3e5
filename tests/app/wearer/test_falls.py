# SPDX-License-Identifier: MIT
"""Falls: simulated ones are told, what only looks like one is not; the word of page, terminal and reports is steady."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import groupby

import numpy as np
import pytest

from echostep.localization import Estimate, TrackStatus
from echostep.plan import Pose
from echostep.ports.chunks import MTX as MTX_PORT
from echostep.ports.chunks import Chunk, portion_of
from echostep.ports.people.check_in import PERSON, CheckIn
from echostep.tracker import Tracker
from echostep_app.page.live import LivePage
from echostep_app.wearer.falls import FRESH_S, Fall
from echostep_app.wearer.steady_status import HOLD_S, SteadyStatus
from echostep_app.wearer.wearer_signs import Sign, WearerSigns
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.scenario import START_NS, Scenario
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
from page.frames import LOCAL, PLAN


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


LATE_NS = 1_400_000_000  # so long the MTx's bytes wait in a busy computer, longer than the second that makes a dropout
BUSY_S = 9.0  # then it is no longer busy
WORSE = list(TrackStatus)


def walked() -> list[Chunk]:
    """A walk of 11 m, then at rest, as a busy computer reads it."""
    scenario = Scenario(PLAN, ((2.0, 7.5), (9.5, 7.5), (9.5, 10.8)), 5, PythonBoard(seed=5))

    def late(chunk: Chunk) -> Chunk:
        at_ns = chunk.t_arrival_ns
        is_late = chunk.port == MTX_PORT and at_ns < START_NS + BUSY_S * 1e9
        return replace(chunk, t_arrival_ns=(at_ns // LATE_NS + 1) * LATE_NS) if is_late else chunk

    return sorted(map(late, scenario.chunks()), key=lambda chunk: chunk.t_arrival_ns)


def shown(chunks: list[Chunk], size: int, *, replay: bool) -> tuple[list[Estimate], list[Estimate]]:
    """Estimates of the tracker, and as the page shows them, from portions of so many chunks."""
    tracker, own, page_has = Tracker(PLAN, Pose(2.0, 7.5, 0.0), seed=1), list[Estimate](), list[Estimate]()
    with LivePage(tracker, "test", LOCAL, replay=replay) as page:
        for begin in range(0, len(chunks), size):
            portion = portion_of(chunks[begin : begin + size])
            own += tracker.take(portion)
            page_has += [scene.estimate for scene in page._new if scene.estimate]
            page.publish(portion)
    return own, page_has


def words_of(estimates: list[Estimate]) -> list[str]:
    return [word.value for word, _ in groupby(e.status for e in estimates)]


def test_a_busy_computer_says_uncertain_once_and_never_lost() -> None:
    chunks = walked()
    own, live = shown(chunks, 5, replay=False)
    _, replayed = shown(chunks, 3000, replay=True)
    assert len(words_of(own)) > 8
    said = words_of(live)
    assert said == ["tracking", "uncertain", "tracking"][: max(len(said), 2)]  # 11 m are short: it may end there
    assert live == replayed  # although a live page shows steps ahead of their echoes, too
    assert all(WORSE.index(said.status) >= WORSE.index(was.status) for was, said in zip(own, live, strict=True))
    last_s = max(e.t_s for e in own if e.status is TrackStatus.UNCERTAIN)
    assert {e.status.value for e in live if last_s <= e.t_s < last_s + HOLD_S} == {"uncertain"}


def test_a_check_in_is_believed_at_once() -> None:
    tracker, steady = Tracker(PLAN, Pose(2.0, 7.5, 0.0), seed=1), SteadyStatus()
    (*_, last) = tracker.take(portion_of(walked()))
    assert steady.shown(replace(last, status=TrackStatus.LOST), tracker).status is TrackStatus.LOST
    assert steady.shown(last, tracker).status is TrackStatus.LOST
    assert steady.worst(last.t_s - 60.0, last.status) is last.status  # a clock that went back
    assert steady.worst(last.t_s, TrackStatus.LOST) is TrackStatus.LOST
    (stated,) = tracker.feed(Chunk(PERSON, 0, CheckIn(last.x_m, last.y_m, None, 0.1).encode()))
    assert steady.shown(stated, tracker).status is stated.status is TrackStatus.TRACKING
