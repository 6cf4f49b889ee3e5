"""The arrival clock: offset and drift through latency, bursts and stalls."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from echostep import arrival as line
from echostep.arrival import lower_hull
from echostep.clocks import new_clock
from naive_clocks import ArrivalClock as NaiveClock


def arrivals(
    rate_hz: float, seconds: float, drift_ppm: float, poll_s: float, stalls: bool, seed: int
) -> tuple[np.ndarray, np.ndarray]:
    """Device seconds, and arrival seconds: 5 ms of transmission, exponential delays, an adapter that is polled, a host that stalls."""
    rng = np.random.default_rng(seed)
    device = np.arange(int(seconds * rate_hz)) / rate_hz
    late = device * (1 + drift_ppm * 1e-6) + 0.005 + rng.exponential(0.0004, len(device))
    if poll_s:
        late = np.ceil((late + rng.random() * poll_s) / poll_s) * poll_s
    if stalls:
        for start in np.arange(3.0, seconds, 7.3):
            late = np.where((late > start) & (late < start + 0.5), start + 0.5, late)
    return device, np.maximum.accumulate(late) + 100.0


@pytest.mark.parametrize("drift_ppm", [-100.0, 0.0, 100.0])
@pytest.mark.parametrize(("poll_s", "stalls"), [(0.0, False), (0.001, False), (0.001, True), (0.0, True)])
def test_within_a_millisecond_after_ten_seconds(drift_ppm: float, poll_s: float, stalls: bool) -> None:
    device, arrival = arrivals(100.0, 60.0, drift_ppm, poll_s, stalls, 1)
    clock = new_clock(1.0, 1 << 16)
    error = []
    for d, a in zip(device, arrival, strict=True):
        line.update(clock, float(d), round(a * 1e9))
        error.append(line.to_arrival_s(clock, float(d)) - (100.0 + d * (1 + drift_ppm * 1e-6) + 0.005))
    settled = np.array(error)[1_000:]
    settled -= np.median(settled)  # the adapter's own constant delay cannot be seen
    assert np.abs(settled).max() <= 1.0e-3


def test_there_and_back() -> None:
    device, arrival = arrivals(100.0, 30.0, 80.0, 0.001, False, 2)
    clock = new_clock(1.0, 1 << 16)
    for d, a in zip(device, arrival, strict=True):
        line.update(clock, float(d), round(a * 1e9))
    for d in (0.0, 12.3, 29.0, 40.0):
        assert line.to_device_s(clock, line.to_arrival_s(clock, d)) == pytest.approx(d, abs=1e-9)


def test_the_lower_hull_lies_below_all_points() -> None:
    rng = np.random.default_rng(3)
    x, y = np.arange(40.0), rng.random(40)
    hull = lower_hull(x, y)
    assert (np.interp(x, x[hull], y[hull]) <= y + 1e-12).all()
    assert (hull[0], hull[-1]) == (0, 39)


@given(st.lists(st.tuples(st.floats(-5, 200), st.floats(0, 0.5)), max_size=150))
def test_bit_for_bit_like_the_naive_twin(points: list[tuple[float, float]]) -> None:
    clock, naive = new_clock(1.0, 1 << 16), NaiveClock()
    for device_s, late_s in points:
        t_arrival_ns = round((device_s + 10.0 + late_s) * 1e9)
        line.update(clock, device_s, t_arrival_ns)
        naive.update(device_s, t_arrival_ns)
        assert line.to_arrival_s(clock, 3.3) == naive.to_arrival_s(3.3)
        assert line.to_device_s(clock, 3.3) == naive.to_device_s(3.3)
