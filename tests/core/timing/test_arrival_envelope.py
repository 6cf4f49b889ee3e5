# SPDX-License-Identifier: MIT
"""The arrival clock: offset and drift through latency, bursts and stalls."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from echostep.timing import arrival_envelope as line
from echostep.timing.arrival_envelope import lower_hull, most_probable_slope
from echostep.timing.device_clock import new_clock
from echostep_simulation.devices.serial_delivery import deliver
from naive.clocks import ArrivalClock as NaiveClock

FRAME_S = 59 * 10 / 115_200  # on the line
COMPUTING_S = 0.002


def through_an_adapter(drift_ppm: float, late_share: float, stalls: bool, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Arrival of 40 s of MTx frames through an FTDI adapter with its 16 ms timer, read by a host that is late now and then and stalls for 200 ms;
    and when they would have arrived undelayed.
    """
    rng = np.random.default_rng(seed)
    t = 0.05 + 0.01 * rng.random() + np.arange(4_000) * 0.01 * (1 + drift_ppm * 1e-6)
    begin = t + COMPUTING_S + 0.0003 * rng.exponential(size=len(t))
    _, _, arrival = deliver([bytes(59)] * len(t), begin, 115_200, 0.016, rng)
    arrival = arrival + np.where(rng.random(len(t)) < late_share, rng.exponential(0.03, len(t)), 0.0)
    for start in np.arange(3.0 + rng.random(), 40.0, 1.3) if stalls else ():
        arrival = np.where((arrival > start) & (arrival < start + 0.2), start + 0.2, arrival)
    return np.maximum.accumulate(arrival), t + COMPUTING_S + FRAME_S


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("drift_ppm", [-100.0, -30.0, 0.0, 100.0])
@pytest.mark.parametrize(("late_share", "stalls"), [(0.0, False), (0.0, True), (0.05, True)])
def test_within_a_millisecond_behind_a_16_ms_adapter(
    drift_ppm: float, late_share: float, stalls: bool, seed: int
) -> None:
    arrival, undelayed = through_an_adapter(drift_ppm, late_share, stalls, seed)
    clock = new_clock(1.0, 1 << 16)
    error = []
    for n, (a, true) in enumerate(zip(arrival, undelayed, strict=True)):
        line.update(clock, 0.01 * n, round((a + 100.0) * 1e9))
        error.append(line.to_arrival_s(clock, 0.01 * n) - 100.0 - true)
    assert np.max(arrival - undelayed) > 0.012
    assert np.abs(error[1_000:]).max() <= 1.0e-3


def test_the_slope_is_the_most_probable_one() -> None:
    """Against a search over slopes."""
    rng = np.random.default_rng(5)
    for weight in (1e2, 1e4, 1e6):
        x, y = np.arange(30.0), 1e-3 * rng.random(30)
        slopes = np.linspace(-400e-6, 400e-6, 80_001)
        height = np.min(y[:, None] - slopes * (x[:, None] - 14.5), axis=0)
        best = slopes[np.argmax(weight * height - 0.5 * (slopes / 130e-6) ** 2)]
        found = most_probable_slope(x, y, lower_hull(x, y), 14.5, weight)
        assert found == pytest.approx(best, abs=2e-8)


@given(st.lists(st.tuples(st.floats(-5, 200), st.floats(0, 0.5)), max_size=150))
def test_bit_for_bit_like_the_naive_twin(points: list[tuple[float, float]]) -> None:
    clock, naive = new_clock(1.0, 1 << 16), NaiveClock()
    for device_s, late_s in points:
        t_arrival_ns = round((device_s + 10.0 + late_s) * 1e9)
        line.update(clock, device_s, t_arrival_ns)
        naive.update(device_s, t_arrival_ns)
        assert line.to_arrival_s(clock, 3.3) == naive.to_arrival_s(3.3)
        assert line.to_device_s(clock, 3.3) == naive.to_device_s(3.3)
