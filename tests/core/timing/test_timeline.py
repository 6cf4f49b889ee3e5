# SPDX-License-Identifier: MIT
"""One clock: wraps, restarts, jitter, SyncOut, and values that cannot be true."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from echostep.jit import kernel
from echostep.ports.chunks import BOARD, LATEST_NS, MTX
from echostep.timing import device_clock
from echostep.timing import sync_edges as sync
from echostep.timing.device_clock import DeviceClock, new_clock, now_s
from echostep.timing.timeline import FIRST_MESSAGE, PLAIN, SILENT, MtxTiming, Timeline
from naive import clocks as naive_clocks
from timing.messages import MS, Message, times_of


@kernel
def read(clock: DeviceClock, value: int, t_arrival_ns: int, restarted: bool) -> float:
    return device_clock.read(clock, value, t_arrival_ns, restarted, True)


class Clock:
    """One device's clock, read value by value."""

    def __init__(self, unit_s: float, modulus: int) -> None:
        self.state = new_clock(unit_s, modulus)

    def at(self, value: int, t_arrival_ns: int, *, restarted: bool = False) -> float | None:
        seconds = read(self.state, value, t_arrival_ns, restarted)
        return None if np.isnan(seconds) else seconds


def tell(timeline: Timeline, messages: list[Message]) -> list[float | None]:
    """Times of messages in order of arrival, as one portion; None for those dropped."""
    return [None if np.isnan(t) else t for t in times_of(timeline, messages).tolist()]


def test_older_messages_keep_their_time() -> None:
    clock = Clock(0.5e-6, 1 << 32)
    clock.at(200_000, 0)
    clock.at(400_000, 100 * MS)
    assert clock.at(270_000, 101 * MS) == pytest.approx(0.135)
    assert now_s(clock.state) == pytest.approx(0.2)


def test_one_impossible_value_is_dropped_three_are_a_restart() -> None:
    clock = Clock(0.5e-6, 1 << 32)
    for n in range(100):
        clock.at(n * 20_000, n * 10 * MS)
    assert clock.at(3_000_000_000, 1_000 * MS) is None
    assert clock.at(100 * 20_000, 1_000 * MS) is not None
    assert [clock.at(3_000_000_000 + n, (1_010 + n) * MS) is None for n in range(3)] == [True, True, False]
    assert clock.state["jumps"] == 3


def samples(n: int, drift_ppm: float, latency_ms: float, poll_ms: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """True board times of MTx samples and their arrival (ns), through an adapter that is polled."""
    rng = np.random.default_rng(seed)
    t = 0.5 + 0.01 * (1 + drift_ppm * 1e-6) * np.arange(n)
    late = t + latency_ms * 1e-3 + rng.exponential(0.3e-3, n)
    arrival = np.maximum.accumulate(np.ceil(late * 1e3 / poll_ms) * poll_ms)
    return t, np.rint(arrival * 1e6).astype(np.int64)


def edge(n: int, t_s: float) -> Message:
    return BOARD, round(t_s * 2e6), int(t_s * 1e9) + MS, n & 0xFFFF


def of_mtx(found: list[float | None], messages: list[Message]) -> np.ndarray:
    return np.array([t for t, message in zip(found, messages, strict=True) if message[0] == MTX], float)


def test_lost_edges_are_bridged() -> None:
    timeline = Timeline(MtxTiming())
    t, arrival = samples(1_000, 50.0, 7.1, 1.0, 4)
    messages = []
    for n in range(len(t)):
        seen = n % 7 != 3 and not 500 <= n < 540
        messages.append(edge(n, t[n]) if seen else (BOARD, round(t[n] * 2e6), int(t[n] * 1e9) + MS, PLAIN))
        messages.append((MTX, n & 0xFFFF, int(arrival[n]), PLAIN))
    found = of_mtx(tell(timeline, messages), messages)
    assert np.abs(found[100:] - t[100:]).max() <= 20e-6


@pytest.mark.parametrize(("within", "moved_s"), [(0.1, 20e-6), (0.5, 20e-6), (0.95, 0.6e-3)])
def test_a_stray_edge_moves_no_sample(within: float, moved_s: float) -> None:
    """Interference at a share `within` of a period, which the board counts as an edge; just before an edge it is taken for it."""
    timeline, messages, count = Timeline(MtxTiming()), list[Message](), 0
    t, arrival = samples(1_000, 50.0, 7.1, 1.0, 4)
    for n in range(len(t)):
        messages.append(edge(count, t[n]))
        messages.append((MTX, n & 0xFFFF, int(arrival[n]), PLAIN))
        count += 1
        if n in (300, 301, 500, 800):
            messages.append(edge(count, t[n] + 0.01 * within))
            count += 1
    found = of_mtx(tell(timeline, messages), messages)
    assert np.abs(found[100:] - t[100:]).max() <= moved_s
    assert timeline.stray_edges == 4


def test_without_a_board_the_counter_is_the_clock() -> None:
    found = tell(Timeline(MtxTiming(rate_hz=200.0)), [(MTX, n, n * 5 * MS, PLAIN) for n in range(10)])
    assert np.allclose(np.diff(np.array(found, float)), 0.005)


def naive_times(messages: list[Message]) -> list[float | None]:
    timeline, found = naive_clocks.Timeline(MtxTiming()), []
    for port, value, t_ns, kind in messages:
        if port == MTX:
            found.append(timeline.mtx_time(value, t_ns))
            continue
        t_s = None if kind == SILENT else timeline.board_time(value, t_ns, restarted=kind == FIRST_MESSAGE)
        if kind >= 0 and t_s is not None:
            timeline.sync_edge(kind, t_s)
        found.append(t_s)
    return found


@st.composite
def streams(draw: st.DrawFn) -> list[Message]:
    """A few seconds of both ports, wired or not, with late arrivals, lost messages, restarts and lies."""
    rng = np.random.default_rng(draw(st.integers(0, 1 << 32)))
    wired, first = draw(st.booleans()), draw(st.sampled_from([0, (1 << 32) - 100_000, 1 << 31]))
    late = rng.exponential(draw(st.sampled_from([0.0, 1e-3, 5e-3, 10e-3, 50e-3])), 1_000)
    restart, lies = draw(st.integers(0, 1_500)), draw(st.sampled_from([0.0, 0.02]))
    edges, messages = int(rng.integers(0, 1 << 16)), []
    for n in range(draw(st.integers(0, 500))):
        t_ns = n * 10 * MS
        ticks = (first + n * 20_000 + int(rng.integers(0, 3))) & 0xFFFFFFFF if n < restart else (n - restart) * 20_000
        arrival_ns = t_ns + int(1e9 * late[n]) + MS
        if rng.random() < 0.1 * lies:
            arrival_ns = int(rng.choice([0, LATEST_NS, int(rng.integers(0, LATEST_NS))]))
        if rng.random() < 0.9:
            kind = (
                FIRST_MESSAGE if n == restart else (edges + n) & 0xFFFF if wired else int(rng.choice([PLAIN, SILENT]))
            )
            messages.append((BOARD, ticks, arrival_ns, kind))
        if rng.random() < 0.9:
            messages.append((MTX, (65_300 + n) & 0xFFFF, arrival_ns + 7 * MS, PLAIN))
        if rng.random() < lies:
            messages.append((BOARD, int(rng.integers(0, 1 << 32)), arrival_ns, int(rng.integers(-1, 1 << 16))))
        if rng.random() < lies:
            messages.append((MTX, int(rng.integers(0, 1 << 16)), arrival_ns, PLAIN))
    return messages


@given(streams(), st.lists(st.integers(0, 1_500), max_size=6))
@settings(max_examples=100, deadline=None)
def test_bit_for_bit_like_the_naive_twin_in_any_portions(messages: list[Message], cuts: list[int]) -> None:
    expected = naive_times(messages)
    timeline = Timeline(MtxTiming())
    edges = sorted({0, len(messages), *(min(c, len(messages)) for c in cuts)})
    found = [t for a, b in zip(edges, edges[1:], strict=False) for t in tell(timeline, messages[a:b])]
    assert found == expected


@given(st.integers(0, 1 << 32), st.floats(0.0, 20e-3))
@settings(max_examples=100, deadline=None)
def test_the_vote_is_like_its_naive_twin(seed: int, jitter_s: float) -> None:
    rng = np.random.default_rng(seed)
    edges, naive, first = sync.new_edges(0.01), naive_clocks.SyncEdges(0.01), int(rng.integers(0, 1 << 16))
    for n in range(300):
        if rng.random() < 0.95:
            sync.add(edges, (first + n) & 0xFFFF, 0.01 * n)
            naive.add((first + n) & 0xFFFF, 0.01 * n)
        by_arrival_s = float(0.01 * n + jitter_s * rng.standard_normal())
        expected = naive.time_of(n & 0xFFFF, by_arrival_s)
        found = sync.time_of(edges, n & 0xFFFF, by_arrival_s)
        assert np.isnan(found) if expected is None else found == expected
        assert bool(edges["locked"]) == naive.locked
