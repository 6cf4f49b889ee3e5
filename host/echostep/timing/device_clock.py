"""Wrapping device counters -> device seconds that never wrap.

In: counter values with their arrival times. Out: seconds since the device's first reset. Owns nothing: the caller keeps the `DeviceClock`.
After a restart of the device, its arrival time sets the new epoch.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from echostep.arrays import record_dtype
from echostep.jit import kernel
from echostep.timing import arrival_envelope as arrival
from echostep.timing.arrival_envelope import KEPT_BUCKETS, ArrivalClock

AHEAD_S = 1.0  # a counter further ahead of its arrival is impossible: a restart or damaged bytes; by reason
BEHIND_S = 1.0  # greatest age of a message relative to the newest one; by reason: a ping is sent after its ranging
JUMPS_TO_RESTART = 3  # impossible values in a row that make a restart; by reason


class DeviceClock(ArrivalClock, Protocol):
    """A counter of `modulus` values, one step each `unit_s`, and its arrival clock."""

    unit_s: float
    modulus: int
    started: int  # whether there was a value
    newest: int  # newest value, unwrapped
    newest_arrival_ns: int
    epoch_s: float  # device seconds of the unwrapped value 0
    jumped: int  # impossible values since the last possible one
    restarts: int
    jumps: int  # impossible values that were dropped
    newest_s: float  # used by the timeline: `t_s` of the newest message, NaN before it


CLOCK = record_dtype(DeviceClock, array_size=KEPT_BUCKETS)


def new_clock(unit_s: float, modulus: int) -> Any:
    """The clock of a counter that has no value yet."""
    clock = np.zeros(1, CLOCK)[0]
    clock["unit_s"], clock["modulus"], clock["newest_s"] = unit_s, modulus, np.nan
    return clock


@kernel
def read(clock: DeviceClock, value: int, t_arrival_ns: int, restarted: bool) -> float:
    """Device seconds of a counter value; NaN for an impossible one (a jump, counted). `restarted`: in the first message after a start."""
    if not clock.started:
        return _begin(clock, value, t_arrival_ns, value * clock.unit_s)
    delta, possible = _delta(clock, value, t_arrival_ns)
    if not possible:
        clock.jumped += 1
        if not restarted and clock.jumped < JUMPS_TO_RESTART:
            clock.jumps += 1
            return np.nan
        clock.restarts += 1
        return _begin(clock, value, t_arrival_ns, arrival.to_device_s(clock, t_arrival_ns * 1e-9))
    clock.jumped = 0
    unwrapped = clock.newest + delta
    seconds = clock.epoch_s + unwrapped * clock.unit_s
    if delta > 0:
        clock.newest, clock.newest_arrival_ns = unwrapped, t_arrival_ns
        arrival.update(clock, seconds, t_arrival_ns)
    return seconds


@kernel
def _delta(clock: DeviceClock, value: int, t_arrival_ns: int) -> tuple[int, bool]:
    """Counts from the newest value to this one, whole wraps by arrival times included, and whether the value is possible."""
    back = min(int(BEHIND_S / clock.unit_s), clock.modulus // 2)
    delta = (value - clock.newest + back) % clock.modulus - back
    elapsed_s = (t_arrival_ns - clock.newest_arrival_ns) * 1e-9
    wraps = round((elapsed_s - delta * clock.unit_s) / (clock.modulus * clock.unit_s))
    delta += max(wraps, 0) * clock.modulus
    return delta, delta * clock.unit_s <= elapsed_s + AHEAD_S


@kernel
def _begin(clock: DeviceClock, value: int, t_arrival_ns: int, seconds: float) -> float:
    """Begin a new epoch: `value` is at device time `seconds`."""
    clock.started = 1
    clock.newest, clock.newest_arrival_ns, clock.jumped = value, t_arrival_ns, 0
    clock.epoch_s = seconds - value * clock.unit_s
    arrival.reset(clock)
    arrival.update(clock, seconds, t_arrival_ns)
    return seconds


@kernel
def now_s(clock: DeviceClock) -> float:
    """Device seconds of the newest value; NaN before the first one."""
    return clock.epoch_s + clock.newest * clock.unit_s if clock.started else np.nan
