# SPDX-License-Identifier: MIT
"""The clock of arrivals while the computer sleeps."""

from __future__ import annotations

import pytest

from echostep_app.ports.arrival_clock import SleepWatch, now_ns

SECOND_NS = 1_000_000_000


def test_sleep_is_noticed() -> None:
    arrival, awake = iter([100, 100, 60 * SECOND_NS, 60 * SECOND_NS, 60 * SECOND_NS]), iter([50, 50, 50, 50, 50])
    watch = SleepWatch(lambda: next(arrival), lambda: next(awake))
    assert watch.slept_s() == 0.0
    assert watch.slept_s() == pytest.approx(60.0, abs=0.1)
    assert watch.slept_s() == 0.0
    assert now_ns() <= now_ns()
