# SPDX-License-Identifier: MIT
"""Meetings: covariance intersection of particles, who is believed, and what hostile or repeated meetings can do."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from aiding.team.two_wearers import BUILDING, filter_at
from echostep.aiding import AidedFilter, MeetingEffect, on_the_way, start_at
from echostep.aiding.team.meeting import WRONG, Meeting, covariance
from echostep.aiding.team.meeting_memory import MOST_NAMES, PLACE_M, RENEWED_M, MeetingMemory
from echostep.aiding.team.meetings import best_omega, information, places_at, weigh
from echostep.arrays import Floats
from echostep.localization import CloudSettings, Start
from echostep.localization.particles.cloud import Cloud, cloud_about
from echostep.localization.particles.start import STATED
from echostep.path import Odometer, PathSegment
from echostep.plan import Pose
from echostep.ports.chunks import Chunk, portion_of
from echostep.ports.people.meeting import MEETING, MeetingMessage, parse_meeting
from echostep.tracker import Tracker
from walks import PLAN, walk_chunks

AREA_M2 = 250.0
KIM = Meeting("kim", "tracking", 4.0, 5.0, 0, 0.01, 0.0, 0.01)
FAR = Meeting("eve", "tracking", 20.0, 2.0, 0, 0.0025, 0.0, 0.0025)
ANNA, BO = replace(FAR, name="anna"), replace(FAR, name="bo")
FAR_MESSAGE = MeetingMessage("eve", "tracking", 20.0, 2.0, 0, 0.0025, 0.0, 0.0025)


def cloud(mean: tuple[float, float], sd: tuple[float, float], size: int = 20_000, seed: int = 1) -> Cloud:
    """A cloud whose particles are drawn from a normal distribution."""
    rng = np.random.default_rng(seed)
    made = cloud_about(CloudSettings(size=size, largest=size), Start(Pose(*mean, 0.0)), 0.0, rng)
    made.x_m, made.y_m = (m + s * rng.standard_normal(len(made.x_m)) for m, s in zip(mean, sd, strict=True))
    return made


def moments(c: Cloud) -> tuple[Floats, Floats]:
    place = np.column_stack([c.x_m, c.y_m])
    return c.weight @ place, np.cov(place, rowvar=False, aweights=c.weight, bias=True)


variances = st.tuples(st.floats(0.01, 9.0), st.floats(0.01, 9.0), st.floats(-0.9, 0.9))


@given(variances, variances, st.booleans())
@settings(max_examples=50)
def test_omega_is_the_best_of_all(own: tuple[float, ...], other: tuple[float, ...], is_range: bool) -> None:
    """No share of a fine grid has a smaller fused determinant."""

    def matrix(v: tuple[float, ...]) -> Floats:
        xy = v[2] * math.sqrt(v[0] * v[1])
        return np.asarray(np.linalg.inv(np.array([[v[0], xy], [xy, v[1]]])), np.float64)

    a = matrix(own)
    b = np.outer([0.6, 0.8], [0.6, 0.8]) * other[0] if is_range else matrix(other)
    omega = best_omega(a, b)
    grid = [float(np.linalg.det(w * a + (1.0 - w) * b)) for w in np.linspace(0.0, 1.0, 201)]
    assert float(np.linalg.det(omega * a + (1.0 - omega) * b)) >= max(grid) * (1.0 - 1e-9)


@pytest.mark.parametrize("range_m", [None, 3.0])
def test_particles_are_fused_as_the_formula_says(range_m: float | None) -> None:
    """[Julier and Uhlmann 1997, eq. 3 and 4] of normal distributions, against the weighted particles."""
    met = Meeting("kim", "tracking", 4.0, 5.0, 0, 0.04, 0.0, 0.04, range_m=range_m, range_sd_m=0.2)
    at = (7.3, 5.2) if range_m else (4.4, 5.2)
    own = cloud(at, (1.2, 0.25), 200_000)  # so narrow that the ring of a range is straight on it
    mean, spread = moments(own)
    a, b = np.asarray(np.linalg.inv(spread), np.float64), information(met, mean)
    omega = best_omega(a, b)
    assert 0.0 < omega < 1.0
    told = np.array([4.0 + range_m, 5.0]) if range_m else np.array([4.0, 5.0])
    fused = np.linalg.inv(omega * a + (1.0 - omega) * b)
    expected = fused @ (omega * a @ mean + (1.0 - omega) * b @ told)
    right = weigh(own, met, AREA_M2)
    found, found_spread = moments(own)
    assert right > 0.98
    assert found == pytest.approx(expected, abs=0.02)
    assert np.sqrt(np.diag(found_spread)) == pytest.approx(np.sqrt(np.diag(fused)), rel=0.12)


def test_a_sure_cloud_is_not_changed_by_a_bit() -> None:
    own = cloud((4.3, 5.2), (0.1, 0.1))
    before, drawn = own.log_weight.copy(), own._rng.bit_generator.state
    assert weigh(own, KIM, AREA_M2) > 0.99
    assert np.array_equal(own.log_weight, before)
    assert own._rng.bit_generator.state == drawn


@given(st.floats(-math.pi, math.pi), st.floats(0.0, 1.0))
@settings(max_examples=20)
def test_a_meeting_on_the_way_is_at_the_places_to_which_it_leads(turn_rad: float, share: float) -> None:
    """Of each particle by its own turn and scale."""
    own, segment = cloud((4.3, 5.2), (1.5, 1.0), 200), PathSegment(10.0, 12.0, 1.2, 0.3, 0.0, 0.0, 0.02, 0.001, 1)
    own.turn_rad = turn_rad + np.linspace(-0.5, 0.5, len(own.x_m))
    own.scale = np.linspace(0.9, 1.1, len(own.x_m))
    found = places_at(own, on_the_way(KIM, segment, 10.0 + 2.0 * share))
    for k in (0, len(found) // 3, len(found) - 1):
        way = share * own.scale[k] * complex(1.2, 0.3) * np.exp(1j * own.turn_rad[k])
        assert found[k] == pytest.approx([own.x_m[k] + way.real, own.y_m[k] + way.imag])


def test_a_range_is_from_the_place_at_which_it_was_measured() -> None:
    """The cloud of a stride's begin is 3 m from the beacon, at its end 1.8 m."""
    segment = PathSegment(10.0, 11.0, 1.2, 0.0, 0.0, 0.0, 0.02, 0.001, 1)
    measured = replace(KIM, range_m=1.8, range_sd_m=0.2)
    rights = [
        weigh(cloud((1.0, 5.0), (0.05, 0.05), 500), on_the_way(measured, segment, t_s), AREA_M2) for t_s in (10.0, 11.0)
    ]
    assert rights[0] < 0.1
    assert rights[1] > 0.95


def test_the_way_to_a_meeting_ends_with_its_segment_and_a_guess_is_none() -> None:
    segment = PathSegment(10.0, 12.0, 1.2, 0.4, 0.0, 0.0, 0.02, 0.001, 1)
    for t_s, share in ((-math.inf, 0.0), (9.0, 0.0), (11.0, 0.5), (13.0, 1.0)):
        met = on_the_way(KIM, segment, t_s)
        assert (met.way_x_m, met.way_y_m) == pytest.approx((1.2 * share, 0.4 * share))
        assert start_at(met).sd_m >= start_at(KIM).sd_m
    assert on_the_way(KIM, replace(segment, sd_m=50.0), 11.0) is KIM
    assert on_the_way(KIM, replace(segment, t1_s=10.0), 10.0) is KIM


def test_two_who_meet_again_and_again_do_not_become_sure() -> None:
    """Rumours go round: what each tells the other is its own. Without the intersection both would shrink without end."""
    pair = [cloud((5.0, 5.0), (1.5, 1.5), seed=k) for k in (1, 2)]
    for _ in range(20):
        told = [moments(c) for c in pair]
        for c, (mean, spread) in zip(pair, reversed(told), strict=True):
            weigh(c, Meeting("x", "uncertain", mean[0], mean[1], 0, spread[0, 0], spread[0, 1], spread[1, 1]), AREA_M2)
    for c in pair:
        assert np.sqrt(np.diag(moments(c)[1])).min() > 1.2


def test_a_teammate_elsewhere_does_not_pull_a_sure_cloud() -> None:
    """Nor do two of them; not a bit of it changes."""
    sure = filter_at(4.0, 7.5, right=0.9999)
    before, drawn = sure.cloud.x_m.copy(), sure._rng.bit_generator.state
    for name in ("eve", "mallory"):
        assert sure.meet(replace(FAR, name=name)) is MeetingEffect.CONTRADICTS
    assert np.array_equal(sure.cloud.x_m, before)
    assert sure.belief.probability(sure.belief.tracked) == pytest.approx(0.9999)
    assert sure._rng.bit_generator.state == drawn


def test_a_stated_start_is_given_up_when_a_second_teammate_contradicts() -> None:
    stated = filter_at(4.0, 7.5, right=STATED)
    assert stated.meet(ANNA) is MeetingEffect.CONTRADICTS
    assert stated.meet(ANNA) is MeetingEffect.REPEATED
    assert stated.meet(BO) is MeetingEffect.MOVED


def test_an_agreement_answers_a_contradiction() -> None:
    stated = filter_at(4.0, 7.5, right=STATED)
    beside = Meeting("kim", "tracking", 4.3, 7.4, 0, 0.01, 0.0, 0.01)
    effects = [stated.meet(met) for met in (ANNA, beside, BO)]
    assert effects == [MeetingEffect.CONTRADICTS, MeetingEffect.USED, MeetingEffect.CONTRADICTS]


@pytest.mark.parametrize(("range_m", "moved"), [(PLACE_M + 0.1, False), (1.0, True)])
def test_a_near_radio_range_moves_a_doubted_cloud_about_the_teammate_and_a_far_one_none(
    range_m: float, moved: bool
) -> None:
    doubted = filter_at(4.0, 7.5, right=0.4)
    effect = doubted.meet(replace(FAR, range_m=range_m, range_sd_m=0.1))
    assert effect is (MeetingEffect.MOVED if moved else MeetingEffect.CONTRADICTS)
    near = np.hypot(doubted.cloud.map_x_m - 20.0, doubted.cloud.y_m - 2.0) < 2.5
    assert (float(doubted.cloud.weight @ near) > 0.95) == moved


def test_a_doubted_cloud_moves_to_the_teammate_after_a_tap() -> None:
    doubted = filter_at(4.0, 7.5, right=0.4)
    assert doubted.meet(FAR) is MeetingEffect.MOVED
    mean = doubted.cloud.weight @ np.column_stack([doubted.cloud.map_x_m, doubted.cloud.y_m])
    assert mean == pytest.approx([20.0, 2.0], abs=0.1)
    assert 0.5 < doubted.belief.probability(doubted.belief.tracked) < 1.0 - WRONG["tracking"]
    assert doubted.belief.search is None


def test_an_unknown_start_is_found_by_a_meeting() -> None:
    lost = AidedFilter(BUILDING, Start(), 0.0, np.random.default_rng(4))
    assert lost.belief.is_searching
    assert lost.meet(FAR) is MeetingEffect.USED
    near = np.hypot(lost.cloud.map_x_m - 20.0, lost.cloud.y_m - 2.0) < 2.5
    assert float(lost.cloud.weight @ near) > 0.95
    assert lost.belief.probability(lost.belief.tracked) <= 1.0 - WRONG["tracking"]


@pytest.mark.parametrize("met", [
    Meeting("kim", "tracking", 4.0, 5.0, 0, 0.01, 0.0, 0.01, age_s=10.0),
    Meeting("kim", "lost", 4.0, 5.0, 0, 0.01, 0.0, 0.01), Meeting("kim", "uncertain", 4.0, 5.0, 0, 9.0, 0.0, 9.0),
])  # fmt: skip
def test_a_teammate_without_a_place_says_nothing(met: Meeting) -> None:
    doubted = filter_at(4.0, 7.5, right=0.4)
    before = doubted.cloud.log_weight.copy()
    assert doubted.meet(met) is MeetingEffect.EMPTY
    assert np.array_equal(doubted.cloud.log_weight, before)


def test_the_same_teammate_counts_again_after_a_way() -> None:
    odometer = Odometer()
    memory = MeetingMemory(odometer)
    assert memory.refusal(KIM) is None
    odometer.add(0.9 * RENEWED_M)
    assert memory.refusal(KIM) is MeetingEffect.REPEATED
    assert memory.refusal(FAR) is None
    odometer.add(0.2 * RENEWED_M)
    assert memory.refusal(KIM) is None  # since the one that counted, not since the one that did not
    for k in range(3 * MOST_NAMES):
        memory.refusal(Meeting(str(k), "tracking", 0.0, 0.0, 0, 0.01, 0.0, 0.01))
    assert len(memory._met_m) == MOST_NAMES


def test_an_old_report_says_less() -> None:
    old = Meeting("kim", "tracking", 4.0, 5.0, 0, 0.01, 0.0, 0.01, age_s=5.0)
    assert np.diag(covariance(old)) == pytest.approx(np.diag(covariance(KIM)) + 25.0)


@given(st.binary(max_size=600) | st.sampled_from([
    b'{"name":"k","status":"tracking","x_m":1e999,"y_m":0,"level":0,"xx_m2":1,"xy_m2":0,"yy_m2":1}', b"[" * 500,
    MeetingMessage("kim", "tracking", 4.0, 5.0, 0, 0.01, 0.5, 0.01).encode(), MeetingMessage("kim", "tracking", 4.0, 5.0, 9, 1.0, 0.0, 1.0).encode(),
]))  # fmt: skip
def test_hostile_meetings_are_counted(payload: bytes) -> None:
    tracker = _SHARED
    before = tracker.state.meetings.get("bad", 0)
    tracker.feed(Chunk(MEETING, 0, payload))
    assert tracker.state.meetings["bad"] == before + 1
    assert tracker.front_end.counts.unknown_ports == 0


_SHARED = Tracker(PLAN)


def test_a_meeting_comes_back_from_its_bytes() -> None:
    met = MeetingMessage("Kim", "uncertain", 1.25, -2.5, 3, 0.5, 0.1, 0.25, 1.5, 0.75, 2.0, 0.1)
    assert parse_meeting(met.encode()) == met


@pytest.mark.slow
def test_where_no_start_is_known_a_meeting_is_one() -> None:
    chunks = walk_chunks()
    tracker = Tracker(replace(PLAN, start=None), waits=True)
    half = len(chunks) // 2
    assert tracker.take(portion_of(chunks[:half])) == []
    tracker.feed(Chunk(MEETING, chunks[half].t_arrival_ns, FAR_MESSAGE.encode()))
    estimates = tracker.take(portion_of(chunks[half:]))
    assert math.hypot(estimates[0].x_m - 20.0, estimates[0].y_m - 2.0) < 2.0


@pytest.mark.long
def test_a_replay_has_the_same_meetings_in_any_portions() -> None:
    chunks = list(walk_chunks())
    at = 2 * len(chunks) // 3
    chunks.insert(at, Chunk(MEETING, chunks[at].t_arrival_ns, FAR_MESSAGE.encode()))
    runs = []
    for size in (1, 37, 5000):
        tracker = Tracker(PLAN, Start(), seed=2)
        runs.append([e for k in range(0, len(chunks), size) for e in tracker.take(portion_of(chunks[k : k + size]))])
        assert sum(tracker.state.meetings.values()) == 1
    assert runs[0] == runs[1] == runs[2]
    assert len(runs[0]) > 3
