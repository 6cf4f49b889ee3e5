"""One clock: wraps, restarts, jitter, SyncOut, and values that cannot be true."""

from __future__ import annotations

import numpy as np
import pytest

from echostep.timeline import DeviceClock, MtxTiming, Timeline

MS = 1_000_000


def test_board_ticks_wrap() -> None:
    clock = DeviceClock(0.5e-6, 1 << 32)
    first = (1 << 32) - 20_000
    times = [clock.at((first + n * 2_000) % (1 << 32), n * MS) for n in range(30)]
    assert all(t is not None for t in times)
    assert np.allclose(np.diff(np.array(times, float)), 1e-3, atol=1e-9)


def test_the_mtx_counter_wraps() -> None:
    clock = DeviceClock(0.01, 1 << 16)
    times = [clock.at((65_500 + n) % 65_536, n * 10 * MS) for n in range(100)]
    assert np.allclose(np.diff(np.array(times, float)), 0.01, atol=1e-9)


def test_a_gap_longer_than_a_wrap_is_counted_by_arrival() -> None:
    clock = DeviceClock(0.01, 1 << 16)
    clock.at(100, 0)
    assert clock.at(200, 656_360 * MS) == pytest.approx(1.0 + 1.0 + 655.36)


def test_older_messages_keep_their_time() -> None:
    clock = DeviceClock(0.5e-6, 1 << 32)
    clock.at(200_000, 0)
    clock.at(400_000, 100 * MS)
    assert clock.at(270_000, 101 * MS) == pytest.approx(0.135)
    assert clock.newest_s == pytest.approx(0.2)


def test_a_restart_goes_on_by_arrival_time() -> None:
    clock = DeviceClock(0.5e-6, 1 << 32)
    for n in range(2_000):
        clock.at(n * 20_000, n * 10 * MS)
    after = clock.at(4_000, 25_000 * MS, restarted=True)
    assert after is not None
    assert after == pytest.approx(25.0, abs=0.02)
    assert clock.at(24_000, 25_010 * MS) == pytest.approx(after + 0.01)
    assert clock.restarts == 1


def test_one_impossible_value_is_dropped_three_are_a_restart() -> None:
    clock = DeviceClock(0.5e-6, 1 << 32)
    for n in range(100):
        clock.at(n * 20_000, n * 10 * MS)
    assert clock.at(3_000_000_000, 1_000 * MS) is None
    assert clock.at(100 * 20_000, 1_000 * MS) is not None
    assert [clock.at(3_000_000_000 + n, (1_010 + n) * MS) is None for n in range(3)] == [True, True, False]
    assert clock.jumps == 3


def samples(n: int, drift_ppm: float, latency_ms: float, poll_ms: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """True board times of MTx samples and their arrival (ns), through an adapter that is polled."""
    rng = np.random.default_rng(seed)
    t = 0.5 + 0.01 * (1 + drift_ppm * 1e-6) * np.arange(n)
    late = t + latency_ms * 1e-3 + rng.exponential(0.3e-3, n)
    arrival = np.maximum.accumulate(np.ceil(late * 1e3 / poll_ms) * poll_ms)
    return t, np.rint(arrival * 1e6).astype(np.int64)


def feed_board(timeline: Timeline, t_ns: int) -> None:
    timeline.board_time(t_ns // 500 % (1 << 32), t_ns + MS)


@pytest.mark.parametrize("drift_ppm", [-100.0, 0.0, 100.0])
@pytest.mark.parametrize("wired", [True, False])
def test_mtx_samples_on_the_board_clock(drift_ppm: float, wired: bool) -> None:
    timeline = Timeline(MtxTiming())
    t, arrival = samples(3_000, drift_ppm, 7.1, 1.0, 3)
    found = []
    board_ns = 0
    for n in range(len(t)):
        while board_ns + MS <= arrival[n]:
            feed_board(timeline, board_ns)
            board_ns += 5 * MS
        if wired:
            at = timeline.board_time(round(t[n] * 2e6), int(t[n] * 1e9) + MS)
            assert at is not None
            timeline.sync_edge(n & 0xFFFF, at)
        found.append(timeline.mtx_time((65_000 + n) & 0xFFFF, int(arrival[n])))
    error = np.array(found, float) - t
    assert timeline.synchronised == wired
    assert np.abs(error[1_000:]).max() <= (1e-6 if wired else 1.5e-3)
    assert (np.diff(np.array(found, float)) > 0).all()


def test_lost_edges_are_bridged() -> None:
    timeline = Timeline(MtxTiming())
    t, arrival = samples(1_000, 50.0, 7.1, 1.0, 4)
    found = []
    for n in range(len(t)):
        at = timeline.board_time(round(t[n] * 2e6), int(t[n] * 1e9) + MS)
        assert at is not None
        if n % 7 != 3 and not 500 <= n < 540:
            timeline.sync_edge(n & 0xFFFF, at)
        found.append(timeline.mtx_time(n & 0xFFFF, int(arrival[n])))
    assert np.abs(np.array(found, float)[100:] - t[100:]).max() <= 20e-6


def test_without_a_board_the_counter_is_the_clock() -> None:
    timeline = Timeline(MtxTiming(rate_hz=200.0))
    times = [timeline.mtx_time(n, n * 5 * MS) for n in range(10)]
    assert np.allclose(np.diff(np.array(times, float)), 0.005)


def test_equal_input_gives_equal_bits() -> None:
    def run() -> list[float | None]:
        timeline = Timeline(MtxTiming())
        t, arrival = samples(500, 20.0, 7.1, 16.0, 9)
        out = []
        for n in range(len(t)):
            feed_board(timeline, int(t[n] * 1e9))
            out.append(timeline.mtx_time(n, int(arrival[n])))
        return out

    assert run() == run()
