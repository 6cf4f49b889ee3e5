# SPDX-License-Identifier: MIT
"""The host's clock for arrival times: it never steps, and it goes on while the computer sleeps.

In: the operating system's clocks. Out: nanoseconds, and how long the computer slept. Owns the choice of the clock.

    Linux     CLOCK_BOOTTIME counts sleep, CLOCK_MONOTONIC does not [clock_gettime(2)]
    macOS     CLOCK_MONOTONIC counts sleep, `time.monotonic` does not [clock_gettime(3)]
    Windows   `time.monotonic` counts sleep [QueryPerformanceCounter, GetTickCount64]
"""

from __future__ import annotations

import time
from collections.abc import Callable

SLEPT_S = 1.0  # a shorter difference of the clocks is not sleep: they are not read at one moment


def _choose() -> Callable[[], int]:
    clock = getattr(time, "CLOCK_BOOTTIME", getattr(time, "CLOCK_MONOTONIC", None))
    if clock is None:
        return time.monotonic_ns
    return lambda: time.clock_gettime_ns(clock)


now_ns: Callable[[], int] = _choose()


def now_s() -> float:
    """The same clock in seconds."""
    return now_ns() * 1e-9


class SleepWatch:
    """Detects that the computer slept: the arrival clock has advanced by more than the clock that stops in sleep."""

    def __init__(self, arrival_ns: Callable[[], int] = now_ns, awake_ns: Callable[[], int] = time.monotonic_ns) -> None:
        self._arrival_ns, self._awake_ns = arrival_ns, awake_ns
        self._asleep_ns = arrival_ns() - awake_ns()

    def slept_s(self) -> float:
        """Seconds of sleep since the last call that returned some; 0 for none."""
        asleep_ns = self._arrival_ns() - self._awake_ns()
        slept_s = (asleep_ns - self._asleep_ns) * 1e-9
        if slept_s < SLEPT_S:
            return 0.0
        self._asleep_ns = asleep_ns
        return slept_s
