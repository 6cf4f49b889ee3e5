# SPDX-License-Identifier: MIT
"""Computers that sleep, processes that are stopped, boards that restart, crystals that drift: times stay true or become a gap, and never go back."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from echostep.board.frames import BoardReader, encode
from echostep.board.messages import Gyros
from echostep.localization import Estimate, TrackStatus
from echostep.ports.chunks import BOARD, MTX, Chunk, portion_of
from echostep.timing.timeline import FIRST_MESSAGE, PLAIN, MtxTiming, Timeline
from echostep.tracker import Tracker
from timing.messages import MS, Message, times_of
from walks import PLAN, walk_chunks

SECOND = 1_000 * MS


def ticks(t_s: float) -> int:
    return round(t_s * 2e6) & 0xFFFFFFFF


def both(t_s: float, host_s: float, kind: int = PLAIN) -> list[Message]:
    """A board message and an MTx sample of one moment; the MTx takes 8 ms, the board 1 ms."""
    at_ns = round(host_s * 1e9)
    return [(BOARD, ticks(t_s), at_ns + MS, kind), (MTX, round(t_s * 100) & 0xFFFF, at_ns + 8 * MS, PLAIN)]


def moments(begin_s: float, end_s: float) -> np.ndarray:
    return np.arange(round(begin_s * 100), round(end_s * 100)) * 0.01


def never_back(found: np.ndarray) -> bool:
    return bool((np.diff(found[~np.isnan(found)]) > -0.05).all())  # board and MTx alternate


@pytest.mark.parametrize("asleep_s", [2.0, 64.0, 700.0, 2000.0])
@pytest.mark.parametrize("counted", [True, False])
def test_sleep_is_a_gap(asleep_s: float, counted: bool) -> None:
    """Whether the host's clock counted the sleep or stood still."""
    timeline = Timeline(MtxTiming())
    before = [m for t in moments(0.0, 20.0) for m in both(t, 50.0 + t)]
    host_s = 50.0 if counted else 50.0 - asleep_s
    after = [m for t in moments(20.0 + asleep_s, 40.0 + asleep_s) for m in both(t, host_s + t)]
    found = times_of(timeline, before + after)
    assert never_back(found)
    assert np.abs(found[-1000:-1:2] - moments(35.0 + asleep_s, 40.0 + asleep_s)).max() < 1e-6  # the board
    assert np.abs(found[-999::2] - moments(35.0 + asleep_s, 40.0 + asleep_s)).max() < 2e-3  # the MTx
    assert np.isnan(found).sum() <= 6
    assert timeline.board_restarts == 0
    assert timeline.clock_steps == (0 if counted else 1)


def test_a_stopped_process_reads_its_backlog_late_and_then_goes_on() -> None:
    """Ten minutes: more than half a wrap of the MTx's counter."""
    timeline = Timeline(MtxTiming())
    before = [m for t in moments(0.0, 20.0) for m in both(t, t)]
    backlog = [(port, value, 620 * SECOND, kind) for t in moments(20.0, 20.7) for port, value, _, kind in both(t, t)]
    after = [m for t in moments(620.0, 640.0) for m in both(t, t)]
    found = times_of(timeline, before + backlog + after)
    assert never_back(found)
    assert np.abs(found[len(before) : len(before + backlog) : 2] - moments(20.0, 20.7)).max() < 1e-6
    assert np.abs(found[-1000:-1:2] - moments(635.0, 640.0)).max() < 1e-6
    assert np.abs(found[-999::2] - moments(635.0, 640.0)).max() < 2e-3
    assert (timeline.board_restarts, timeline.clock_steps) == (0, 0)


@pytest.mark.parametrize("step_s", [-3600.0, -5.0])
def test_a_host_clock_that_steps_changes_no_time(step_s: float) -> None:
    timeline = Timeline(MtxTiming())
    first = [m for t in moments(0.0, 20.0) for m in both(t, 5000.0 + t)]
    second = [m for t in moments(20.0, 40.0) for m in both(t, 5000.0 + step_s + t)]
    found = times_of(timeline, first + second)
    assert never_back(found)
    assert timeline.clock_steps == 1
    assert np.abs(found[0::2] - moments(0.0, 40.0)).max() < 1e-6
    assert np.abs(found[-999::2] - moments(35.0, 40.0)).max() < 2e-3


@pytest.mark.parametrize("ran_s", [30.0, 2000.0])
@pytest.mark.parametrize("away_s", [1.5, 300.0])
@pytest.mark.parametrize("kind", [PLAIN, FIRST_MESSAGE])
def test_a_board_that_restarts_goes_on_by_arrival(ran_s: float, away_s: float, kind: int) -> None:
    """Ticks are less than before, or by chance a little more."""
    timeline = Timeline(MtxTiming())
    begin = ran_s - 20.0
    before = [m for t in moments(begin, ran_s) for m in both(t, t)]
    after = []
    for k, t in enumerate(moments(0.0, 20.0)):
        board, mtx = both(t + ran_s + away_s, t + ran_s + away_s)
        after += [(BOARD, ticks(0.6 + t), board[2], PLAIN if k else kind), mtx]
    found = times_of(timeline, before + after)
    assert never_back(found)
    assert timeline.board_restarts == 1
    assert np.isnan(found).sum() <= 6
    assert np.abs(found[-1000:-1:2] - (ran_s + away_s + moments(15.0, 20.0))).max() < 5e-3


@pytest.mark.parametrize("ran_s", [30, 1200])
@pytest.mark.parametrize("last", [100, 40_000, 60_000])
def test_a_restart_loses_no_frames(ran_s: int, last: int) -> None:
    reader = BoardReader()
    for k in range(5):
        reader.feed(encode(Gyros(ran_s * 2_000_000 + 4_000 * k, 1, 1, 1), last - 4 + k))
    reader.feed(encode(Gyros(1_000_000, 1, 1, 1), 7))
    reader.feed(encode(Gyros(1_008_000, 1, 1, 1), 9))
    assert reader.counts.lost == 1


@pytest.mark.parametrize("ppm", [-200.0, 200.0])
@pytest.mark.parametrize("wired", [True, False])
def test_crystals_200_ppm_apart_that_drift_with_temperature(ppm: float, wired: bool) -> None:
    """The MTx's crystal is 200 ppm off and drifts by 20 ppm in four minutes, the host's is 30 ppm off."""
    rng = np.random.default_rng(5)
    timeline, rate = Timeline(MtxTiming()), 1.0 + (ppm + 20.0 * np.linspace(-0.5, 0.5, 24_000)) * 1e-6
    t = 0.5 + np.cumsum(0.01 / rate)  # of the samples, on the board's clock
    messages: list[Message] = []
    for n, t_s in enumerate(t.tolist()):
        host_ns = round(t_s * (1.0 + 30e-6) * 1e9)
        messages.append((BOARD, ticks(t_s), host_ns + MS, n & 0xFFFF if wired else PLAIN))
        messages.append((MTX, n & 0xFFFF, host_ns + round((7.1 + rng.exponential(0.3)) * MS), PLAIN))
    found = times_of(timeline, messages)
    assert not np.isnan(found).any()
    assert never_back(found)
    assert np.abs(found[1::2] - t)[3_000:].max() < (1e-5 if wired else 1.5e-3)


def track(chunks: Sequence[Chunk]) -> tuple[list[Estimate], Tracker]:
    tracker = Tracker(PLAN, None, None, 1)
    return tracker.take(portion_of(chunks)), tracker


@cache
def undisturbed() -> list[Estimate]:
    return track(list(walk_chunks(15.0)))[0]


@pytest.mark.slow
@pytest.mark.parametrize("counted", [True, False])
def test_a_computer_that_slept_in_mid_walk_claims_no_position(counted: bool) -> None:
    """Four seconds of the walk are missing: the track is not sure until it has found its place."""
    chunks = list(walk_chunks(15.0))
    begin = chunks[0].t_arrival_ns + 7 * SECOND
    end = begin + 4 * SECOND
    shift = 0 if counted else end - begin
    slept = [c for c in chunks if c.t_arrival_ns < begin]
    slept += [replace(c, t_arrival_ns=c.t_arrival_ns - shift) for c in chunks if c.t_arrival_ns >= end]
    estimates, tracker = track(slept)
    times = [e.t_s for e in estimates]
    assert times == sorted(times)
    assert times[-1] == pytest.approx(undisturbed()[-1].t_s, abs=0.6)
    assert tracker.streams.front_end.clock_steps == (not counted)
    ends = {round(e.t_s, 1): e for e in undisturbed()}
    for e in estimates:
        if e.status is TrackStatus.TRACKING and (true := ends.get(round(e.t_s, 1))):
            assert math.hypot(e.x_m - true.x_m, e.y_m - true.y_m) < 1.0
    assert any(e.status is not TrackStatus.TRACKING for e in estimates if e.t_s > times[0] + 5.0)


@pytest.mark.parametrize("wrapped", [False, True])
@pytest.mark.parametrize("block_s", [1.5, 8.0])
def test_messages_that_stand_twice_in_a_recording_move_no_time(block_s: float, wrapped: bool) -> None:
    """Counter and arrival both are of a time that has passed: not a step of the host's clock by the 2,147 s after which the ticks come again."""
    timeline = Timeline(MtxTiming())
    since_s = 2147.48 - 12.0 if wrapped else 0.0
    messages = [m for t in moments(since_s, since_s + 30.0) for m in both(t, 50.0 + t)]
    again = messages[4000 - round(200 * block_s) : 4000]
    found = times_of(timeline, messages[:4000] + again + messages[4000:])
    second = found[4000 : 4000 + len(again)]
    assert np.isnan(second[:-210]).all()
    assert (second[~np.isnan(second)] > since_s + 20.0 - 1.1).all()  # of the last second it cannot be told
    expected = times_of(Timeline(MtxTiming()), messages)
    assert np.abs(np.delete(found, np.s_[4000 : 4000 + len(again)]) - expected).max() < 2e-3
    assert (timeline.board_restarts, timeline.clock_steps) == (0, 0)


@pytest.mark.parametrize("arrival_ns", [1 << 62, 1 << 58, 1 << 53])
def test_one_impossible_arrival_beside_a_counter_that_jumps_moves_no_time(arrival_ns: int) -> None:
    """Of a block from elsewhere: so late that whole wraps of the counter, at the rate of some crystal, would reach any arrival."""
    timeline = Timeline(MtxTiming())
    messages = [m for t in moments(0.0, 40.0) for m in both(t, 50.0 + t)]
    found = times_of(timeline, [*messages[:4000], (BOARD, ticks(31.0), arrival_ns, PLAIN), *messages[4000:]])
    assert np.isnan(found[4000])
    expected = times_of(Timeline(MtxTiming()), messages)
    assert np.abs(np.delete(found, 4000) - expected).max() < 2e-3
