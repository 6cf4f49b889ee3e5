# SPDX-License-Identifier: MIT
"""Foot and legs together: either falls silent, the track goes on."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from echostep.arrays import Floats
from echostep.legs.strides import BLIND_SD_M
from echostep.legs.trunk_path import GyroBlock, LegPath, WearerSettings, rotated_segment, segment_after
from echostep.localization import Estimate, TrackStatus, digest
from echostep.odometry.foot_legs_handover import ALIGNED_SD, KEPT_S, FootLegsHandover
from echostep.path import PathSegment
from echostep.ports.chunks import BOARD, MTX, Chunk, portion_of
from echostep.tracker import Tracker
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.people.leg_angles import LegDimensions
from echostep_simulation.people.walker import Person, walk
from echostep_simulation.scenario import DEMO_WAYPOINTS, Scenario
from echostep_simulation.stimulus import BoardSensors
from walks import PLAN

pytestmark = pytest.mark.slow

BEGIN_NS = 1_000_000_000


@cache
def walked(seed: int) -> tuple[Scenario, tuple[Chunk, ...]]:
    scenario = Scenario(PLAN, DEMO_WAYPOINTS, seed, PythonBoard(seed))
    return scenario, tuple(scenario.chunks())


def without(chunks: tuple[Chunk, ...], port: str, since_s: float, until_s: float) -> list[Chunk]:
    """The chunks, but for those of a port in some seconds."""
    return [c for c in chunks if c.port != port or not since_s < (c.t_arrival_ns - BEGIN_NS) * 1e-9 < until_s]


def tracked(scenario: Scenario, chunks: list[Chunk], portion: int = 500) -> tuple[list[Estimate], Floats]:
    """Estimates, and how far off they are."""
    tracker = Tracker(PLAN, scenario.start, seed=1)
    estimates = [e for k in range(0, len(chunks), portion) for e in tracker.take(portion_of(chunks[k : k + portion]))]
    truth, t_s = scenario.truth, [e.t_s for e in estimates]
    x, y = (np.interp(t_s, truth[:, 0], truth[:, k]) for k in (1, 2))
    return estimates, np.hypot(x - [e.x_m for e in estimates], y - [e.y_m for e in estimates])


def leg(t0: float, t1: float, dx: float = 1.0, heading: float = 0.0) -> PathSegment:
    return PathSegment(t0, t1, dx, 0.0, heading, heading, 0.02, 0.01, 1)


def lying_block(k: int) -> GyroBlock:
    none = np.zeros(20)
    t_s: Floats = 0.1 * k + np.linspace(0.0, 0.095, 20)
    return GyroBlock(t_s, none, none, none, np.full(20, np.nan))


# Pieces


def test_the_rest_of_a_leg_and_what_went_before_are_the_leg() -> None:
    whole = PathSegment(1.0, 3.0, 1.0, 0.4, 0.0, 0.6, 0.1, 0.02, 1, 0.04, 0.3, 0.01)
    rest = segment_after(whole, 1.5)
    assert (rest.t0_s, rest.t1_s) == (1.5, 3.0)
    assert (rest.dx_m, rest.dy_m, rest.rise_m) == pytest.approx((0.75, 0.3, 0.225))
    assert rest.heading0_rad == pytest.approx(0.15)
    assert segment_after(whole, 0.5) is whole


def test_a_turned_leg_leads_elsewhere() -> None:
    other = rotated_segment(leg(0.0, 1.0), math.pi / 2, 1.1)
    assert (other.dx_m, other.dy_m) == pytest.approx((0.0, 1.1), abs=1e-12)
    assert other.heading1_rad == pytest.approx(math.pi / 2)


def test_a_foot_alone_is_left_as_it_is() -> None:
    handover = FootLegsHandover(WearerSettings())
    legs = [leg(float(k), k + 1.0) for k in range(100)]
    assert [gone for one in legs for gone in handover.add_foot_segments([one])] == legs
    assert len(handover._kept_segments) <= KEPT_S + 2


def test_twenty_metres_of_both_give_the_scale_of_the_legs() -> None:
    class Path:
        remembered_s = 0.0

        def heading_rad(self, _t_s: float) -> float:
            return 0.0

    handover = FootLegsHandover(WearerSettings())
    handover._kept_segments.extend(leg(float(k), k + 1.0) for k in range(-5, 20))
    # The first strides, whose length they do not see, are none of length 0
    blind = [replace(leg(float(k), k + 1.0, 0.0), sd_m=BLIND_SD_M) for k in range(-5, 0)]
    legs = blind + [replace(leg(float(k), k + 1.0, 0.9), scale_sd=0.078) for k in range(20)]
    assert handover._align_legs(Path(), legs)  # type: ignore[arg-type]
    assert handover._as_common(legs[-1]).dx_m == pytest.approx(1.0, abs=0.001)
    assert ALIGNED_SD < handover._as_common(legs[-1]).scale_sd < 0.03
    first = handover._leg_scale
    handover._kept_segments.clear()
    handover._kept_segments.extend(leg(float(k), k + 1.0, 1.1) for k in range(20))
    assert handover._align_legs(Path(), legs)  # type: ignore[arg-type]
    assert first < handover._leg_scale < 1.1 / 0.9  # both dropouts count
    assert FootLegsHandover(WearerSettings())._as_common(legs[-1]) == legs[-1]


def test_nobody_who_lies_still_is_believed_to_stand() -> None:
    """The foot walks, then falls silent; the leg gyros lie in a drawer."""
    handover = FootLegsHandover(WearerSettings())
    for k in range(100):
        handover.add_foot_segments([leg(0.1 * k, 0.1 * k + 0.1, 0.1)])
        handover.add_leg_block(lying_block(k), 0.1 * k + 0.1)
    for k in range(100, 200):
        assert handover.add_leg_block(lying_block(k), 10.0) == []
    assert handover.legs_observed_s == -math.inf


def test_blocks_of_any_size_give_the_same_way() -> None:
    scenario, _ = walked(2)
    w, n = scenario.walk, 20_000
    at = np.arange(0, n, 5)
    columns = [w.t_s[at], w.thigh_rad_s[at], w.calf_rad_s[at], w.belt_rad_s[at], np.full(len(at), np.nan)]

    def way(size: int) -> Floats:
        path = LegPath(WearerSettings())
        legs = [x for k in range(0, len(at), size) for x in path.feed(GyroBlock(*(c[k : k + size] for c in columns)))]
        return np.array([sum(x.dx_m for x in legs), sum(x.dy_m for x in legs)])

    truth = float(np.hypot(*np.diff(w.trunk_m[[0, n]], axis=0)[0]))
    assert np.hypot(*way(20)) == pytest.approx(truth, rel=0.1)
    np.testing.assert_allclose(way(20), way(7), atol=0.02)


@pytest.mark.parametrize("leg_m", [0.37, 0.48])
def test_legs_beside_a_foot_for_twenty_metres_are_good_to_two_percent(leg_m: float) -> None:
    """A short and a tall wearer whose legs were not measured walk 60 m; the foot falls silent after 20."""
    person = Person(stride_m=3.0 * leg_m, leg=LegDimensions(leg_m, leg_m))
    w = walk([(0.0, 0.0), (60.0, 0.0)], person, np.random.default_rng(3))
    at = np.arange(0, len(w.t_s) // 200 * 200, 10)
    silent_s = float(np.interp(20.0, w.trunk_m[:, 0], w.t_s))
    ends = np.arange(0.5, w.t_s[-1], 1.0)
    gone = np.interp(ends, w.t_s, w.trunk_m[:, 0])
    feet = [leg(t0, t0 + 1.0, dx) for t0, dx in zip(ends.tolist(), np.diff(gone).tolist(), strict=False)]
    handover, path = FootLegsHandover(WearerSettings()), list[PathSegment]()
    for rows in at.reshape(-1, 20):
        now_s = float(w.t_s[rows[-1]])
        while feet and feet[0].t1_s < min(now_s, silent_s):
            path += handover.add_foot_segments([feet.pop(0)])
        columns = (w.t_s[rows], w.thigh_rad_s[rows], w.calf_rad_s[rows], w.belt_rad_s[rows], np.full(20, np.nan))
        path += handover.add_leg_block(GyroBlock(*columns), min(now_s, silent_s))
    alone = [s for s in path if s.t0_s > silent_s + 2.0]
    true_m = np.diff(np.interp([alone[0].t0_s, alone[-1].t1_s], w.t_s, w.trunk_m[:, 0]))[0]
    assert true_m > 30.0
    assert sum(s.dx_m for s in alone) == pytest.approx(true_m, rel=0.02)


# Walks, simulated


def test_the_track_goes_on_without_the_foot() -> None:
    """For good, from half a minute on."""
    scenario, chunks = walked(1)
    estimates, error = tracked(scenario, without(chunks, MTX, 30.0, math.inf))
    assert estimates[-1].t_s > scenario.walk.t_s[-1] - 3.0
    assert error.mean() < 0.3
    before = [e.ellipse95.major_m for e in estimates if 20.0 < e.t_s < 29.0]
    after = [e.ellipse95.major_m for e in estimates if 32.0 < e.t_s < 60.0]
    assert np.mean(after) > np.mean(before), "larger uncertainty is shown"
    steps = [e.step for e in estimates]
    assert steps == sorted(steps)


def test_the_foot_takes_over_again() -> None:
    scenario, chunks = walked(1)
    estimates, error = tracked(scenario, without(chunks, MTX, 30.0, 50.0))
    late = np.array([e.t_s for e in estimates]) > 55.0
    assert error[late].mean() < 0.2
    assert max(b.t_s - a.t_s for a, b in zip(estimates, estimates[1:], strict=False)) < 3.5


def test_a_plug_that_is_loose_again_and_again_is_bridged_by_the_legs() -> None:
    """For 1 to 5 s in turn, every 12 s; after a long one the foot has measured one stride before the next."""
    scenario, chunks = walked(1)
    for k in range(5):
        chunks = tuple(without(chunks, MTX, 20.0 + 12.0 * k, 21.0 + 13.0 * k))
    estimates, error = tracked(scenario, list(chunks))
    assert error.max() < 0.5
    assert np.mean([e.status is TrackStatus.TRACKING for e in estimates]) > 0.9


@pytest.mark.parametrize("seed", [1, 6])
def test_both_plugs_are_loose_in_turn(seed: int) -> None:
    """The board's six seconds after the MTx's: what neither has seen is unsure, and what both have seen makes one heading of theirs again."""
    scenario, chunks = walked(seed)
    for port, begin_s in ((MTX, 20.0), (BOARD, 26.0)):
        for k in range(5):
            chunks = tuple(without(chunks, port, begin_s + 12.0 * k, begin_s + 1.0 + 13.0 * k))
    estimates, error = tracked(scenario, list(chunks))
    sure = np.array([e.status is TrackStatus.TRACKING for e in estimates])
    assert error[sure].max() < 1.0
    assert sure.mean() > 0.6
    assert error[-1] < 0.5


@pytest.mark.parametrize("seed", [2, 3, 6, 9])
def test_the_board_alone_is_enough(seed: int) -> None:
    """No MTx at all: one cable. Never a wrong place that is shown as sure."""
    scenario, chunks = walked(seed)
    estimates, error = tracked(scenario, [c for c in chunks if c.port == BOARD])
    assert len(estimates) > 60
    assert error.mean() < 0.15
    covered = [e.holds(x, y) for e, (x, y) in zip(estimates, places(scenario, estimates), strict=True)]
    assert np.mean(covered) > 0.9
    assert not any(
        e.status is TrackStatus.TRACKING and off > 1.0 for e, off in zip(estimates, error.tolist(), strict=True)
    )


def places(scenario: Scenario, estimates: list[Estimate]) -> list[tuple[float, float]]:
    truth, t_s = scenario.truth, [e.t_s for e in estimates]
    return list(zip(*(np.interp(t_s, truth[:, 0], truth[:, k]).tolist() for k in (1, 2)), strict=True))


def test_without_foot_and_legs_he_is_lost() -> None:
    """Gyros that lie still do not tell that he stands."""
    scenario, _ = walked(3)
    w, still = scenario.walk, np.zeros(len(scenario.walk.t_s))
    lying = Scenario(PLAN, DEMO_WAYPOINTS, 3, PythonBoard(3))
    lying.sensors = BoardSensors(
        replace(w, thigh_rad_s=still, calf_rad_s=still, belt_rad_s=still),
        PLAN.levels,
        lying.mtx.t_s,
        np.random.default_rng(1),
    )
    estimates, _ = tracked(lying, without(tuple(lying.chunks()), MTX, 30.0, math.inf))
    assert all(e.status is TrackStatus.LOST for e in estimates if e.t_s > 34.0)
    assert any(e.t_s > 40.0 for e in estimates)


def test_it_does_not_matter_how_many_chunks_come_at_once() -> None:
    scenario, chunks = walked(1)
    some = [c for c in without(chunks, MTX, 20.0, 30.0) if c.t_arrival_ns < BEGIN_NS + 45_000_000_000]
    assert digest(tracked(scenario, some, 100_000)[0]) == digest(tracked(scenario, some, 37)[0])


@pytest.mark.parametrize(
    ("rate_rad_s", "stands", "worn"), [(2.0, True, False), (0.2, True, True), (2.0, False, True), (np.nan, True, True)]
)
def test_a_foot_that_stands_while_the_leg_swings_is_not_worn(rate_rad_s: float, stands: bool, worn: bool) -> None:
    handover = FootLegsHandover(WearerSettings())
    for k in range(20):
        t_s = 0.1 * k + np.arange(20) / 200.0
        swing = rate_rad_s * np.sign(np.sin(2.0 * np.pi * t_s))
        block = GyroBlock(t_s, swing, swing, np.zeros(20), np.full(20, np.nan))
        handover.add_leg_block(block, float(t_s[-1]), foot_stands=stands)
    assert handover.is_foot_worn == worn
