# SPDX-License-Identifier: MIT
"""The whole pipeline on a simulated walk: accuracy, honest uncertainty, and what happens when streams fail."""

from __future__ import annotations

import math
import random
from dataclasses import replace

import numpy as np
import pytest

from board_runs import ELF, TWIN, needs_twin
from echostep.localization import Estimate, TrackStatus, digest
from echostep.plan import Plan, Pose
from echostep.ports.chunks import BOARD, MTX, Chunk, portion_of
from echostep.tracker import Tracker
from echostep_simulation.devices.board import BoardProcess, PythonBoard
from echostep_simulation.scenario import Scenario, demo_scenario
from walks import PLAN, errors_of

WAYPOINTS = ((2.0, 7.5), (9.5, 7.5), (9.5, 10.8), (9.5, 7.5), (18.0, 7.5))


def walk(plan: Plan = PLAN, seed: int = 5) -> tuple[list[Chunk], Scenario]:
    scenario = Scenario(plan, WAYPOINTS, seed, PythonBoard(seed))
    return list(scenario.chunks()), scenario


CHUNKS, SCENARIO = walk()
END_S = SCENARIO.walk.t_s[-1]


def track(chunks: list[Chunk], seed: int = 0) -> tuple[Tracker, list[Estimate]]:
    tracker = Tracker(PLAN, SCENARIO.start, seed=seed)
    return tracker, tracker.take(portion_of(chunks))


def test_the_walk_is_tracked() -> None:
    tracker, found = track(CHUNKS)
    off = errors_of(found, SCENARIO)
    assert off.horizontal_m.mean() < 0.2
    assert off.horizontal_m.max() < 0.6
    assert off.in_ellipse95 > 0.8
    assert tracker.front_end.timeline.synchronised
    assert tracker.front_end.counts.late_pings == tracker.front_end.counts.bad_times == 0
    assert {e.status for e in found} == {TrackStatus.TRACKING}


def test_estimates_are_in_order_and_finite() -> None:
    _, found = track(CHUNKS)
    assert all(b.t_s >= a.t_s for a, b in zip(found, found[1:], strict=False))
    assert np.isfinite([(e.x_m, e.y_m, e.xx_m2, e.yy_m2, e.heading_rad) for e in found]).all()
    assert all(e.xx_m2 * e.yy_m2 >= e.xy_m2**2 for e in found)


def test_the_same_chunks_give_the_same_bits_and_other_seeds_others() -> None:
    assert digest(track(CHUNKS)[1]) == digest(track(CHUNKS)[1])
    assert digest(track(CHUNKS)[1]) != digest(track(CHUNKS, seed=1)[1])


@pytest.mark.long
def test_chunks_may_be_cut_anywhere() -> None:
    rng = random.Random(1)
    cut, beginning = [], CHUNKS[: len(CHUNKS) // 3]
    for chunk in beginning:
        at = rng.randrange(len(chunk.data) + 1)
        cut += [replace(chunk, data=part) for part in (chunk.data[:at], chunk.data[at:]) if part]
    tracker, whole = Tracker(PLAN, SCENARIO.start), track(beginning)[1]
    assert len(whole) > 3
    assert digest(e for chunk in cut for e in tracker.feed(chunk)) == digest(whole)


def test_without_the_board_the_foot_goes_on_and_grows_less_sure() -> None:
    half = END_S / 2
    silent = [c for c in CHUNKS if c.port == MTX or c.t_arrival_ns < (1.0 + half) * 1e9]
    _, found = track(silent)
    _, whole = track(CHUNKS)
    assert found[-1].t_s == pytest.approx(whole[-1].t_s, abs=1.5)
    assert found[-1].ellipse95.major_m > whole[-1].ellipse95.major_m
    assert errors_of(found, SCENARIO).horizontal_m.max() < 1.5


def test_without_a_board_at_all_the_plan_and_the_foot_remain() -> None:
    _, found = track([c for c in CHUNKS if c.port == MTX])
    assert len(found) > 10
    assert abs(found[-1].x_m - 18.0) < 1.5


def test_a_foot_that_falls_silent_is_never_shown_as_sure() -> None:
    half_ns = int((1.0 + END_S / 2) * 1e9)
    tracker, found = track([c for c in CHUNKS if c.port == BOARD or c.t_arrival_ns < half_ns])
    assert not sure_but_wrong(found, SCENARIO)
    assert found[-1].t_s > END_S - 3.0
    assert tracker.front_end.reports.status is not None


def sure_but_wrong(found: list[Estimate], scenario: Scenario) -> list[Estimate]:
    truth = scenario.walk
    off = np.array([(e.x_m, e.y_m) for e in found]) - np.column_stack(
        [np.interp([e.t_s for e in found], truth.t_s, column) for column in truth.trunk_m.T]
    )
    return [e for e, d in zip(found, np.hypot(*off.T), strict=True) if e.status == TrackStatus.TRACKING and d > 1.0]


@pytest.fixture(scope="module")
def long_walk() -> tuple[list[Chunk], Scenario]:
    scenario = demo_scenario(PLAN, 7, PythonBoard(7))
    return list(scenario.chunks()), scenario


@pytest.mark.slow
@pytest.mark.parametrize(("start_s", "gap_s"), [(12, 1.5), (12, 4), (20, 6), (30, 4), (30, 8)])
def test_after_a_silent_foot_no_wrong_place_is_shown_as_sure(
    long_walk: tuple[list[Chunk], Scenario], start_s: float, gap_s: float
) -> None:
    chunks, scenario = long_walk
    tracker = Tracker(PLAN, scenario.start, seed=1)
    silent = range(int((1 + start_s) * 1e9), int((1 + start_s + gap_s) * 1e9))
    found = tracker.take(portion_of([c for c in chunks if c.port == BOARD or c.t_arrival_ns not in silent]))
    assert not sure_but_wrong(found, scenario)
    assert found[-1].t_s > 55.0


@pytest.mark.slow
@pytest.mark.parametrize(("dx", "dy", "degrees"), [(0.0, 3.5, 0.0), (6.0, -4.0, 90.0), (0.0, 0.0, 180.0)])
def test_a_wrong_start_is_noticed(
    long_walk: tuple[list[Chunk], Scenario], dx: float, dy: float, degrees: float
) -> None:
    chunks, scenario = long_walk
    there = scenario.start
    tracker = Tracker(PLAN, Pose(there.x_m + dx, there.y_m + dy, there.heading_rad + math.radians(degrees)), seed=1)
    found = tracker.take(portion_of(chunks))
    sure = sure_but_wrong(found, scenario)
    assert not [e for e in sure if e.t_s > 15.0]


def test_noise_on_both_ports_is_survived() -> None:
    rng = random.Random(3)
    noisy = []
    for chunk in CHUNKS:
        body = bytearray(chunk.data)
        if rng.random() < 0.02:
            body[rng.randrange(len(body))] ^= 1 << rng.randrange(8)
        noisy.append(replace(chunk, data=bytes(body)))
    tracker, found = track(noisy)
    assert errors_of(found, SCENARIO).horizontal_m.max() < 1.5
    assert tracker.front_end.board.counts.rejected > 50
    assert tracker.front_end.foot_source.counts.bad_checksum > 10


def test_strange_ports_and_pure_noise_are_counted() -> None:
    rng = random.Random(4)
    tracker = Tracker(PLAN, SCENARIO.start)
    for n in range(2_000):
        port = rng.choice([BOARD, MTX, "kettle"])
        assert tracker.feed(Chunk(port, n * 1_000_000, rng.randbytes(rng.randrange(200)))) == []
    assert tracker.front_end.counts.unknown_ports > 500
    assert tracker.front_end.board.counts.rejected > 100


@pytest.mark.long
@needs_twin
@pytest.mark.parametrize("fault", ["reset=watchdog", "usb=reset", "srf_left=absent", "sda=stuck", "thigh=absent"])
def test_faults_of_the_real_board_in_mid_walk(fault: str) -> None:
    board = BoardProcess([str(TWIN), "--elf", str(ELF)])
    scenario = Scenario(PLAN, WAYPOINTS, 5, board)
    chunks: list[Chunk] = []
    for chunk in scenario.chunks():
        if chunk.t_arrival_ns > 9e9 and chunks[-1].t_arrival_ns <= 9e9:
            board.fault(fault)
        chunks.append(chunk)
    scenario.close()
    tracker = Tracker(PLAN, scenario.start)
    found = tracker.take(portion_of(chunks))
    assert errors_of(found, SCENARIO).horizontal_m.max() < 0.8
    assert found[-1].t_s > END_S - 3.0
    assert tracker.front_end.timeline.board_restarts == (1 if fault == "reset=watchdog" else 0)


@pytest.mark.long
@needs_twin
def test_the_demo_runs_through_the_real_firmware() -> None:
    scenario = demo_scenario(PLAN, 1, BoardProcess([str(TWIN), "--elf", str(ELF)]))
    tracker = Tracker(PLAN, scenario.start, seed=1)
    found = tracker.take(portion_of(list(scenario.chunks())))
    scenario.close()
    assert errors_of(found, scenario).horizontal_m.mean() < 0.2
