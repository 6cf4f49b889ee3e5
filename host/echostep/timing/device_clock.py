"""Wrapping device counters -> device seconds that never wrap.

In: counter values with their time of arrival. Out: seconds since the device's first reset. Owns nothing: the state is a `DeviceClock` that the
caller keeps. Restarts are followed by arrival times.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from echostep.jit import kernel
from echostep.timing import arrival_envelope as arrival
from echostep.timing.arrival_envelope import ArrivalClock

AHEAD_S = 1.0  # a device cannot be further ahead of the arrival of its bytes than this: it restarted, or the bytes lie
BEHIND_S = 1.0  # messages may be this much older than the newest one (a ping is sent when its ranging is over)
JUMPS_TO_RESTART = 3


class DeviceClock(ArrivalClock, Protocol):
    """A counter of `modulus` values, one each `unit_s`; `newest` is unwrapped and counts from `epoch_s`.

    `jumps` are values that could not be true, `jumped` those since the last that could. `newest_s` belongs to the timeline: `t_s` of the newest
    message, NaN before it.
    """

    unit_s: float
    modulus: int
    started: int
    newest: int
    newest_arrival_ns: int
    epoch_s: float
    jumped: int
    restarts: int
    jumps: int
    newest_s: float


_NUMPY = {"float": "f8", "int": "i8"}
CLOCK = np.dtype([*arrival.FIELDS, *((name, _NUMPY[kind]) for name, kind in DeviceClock.__annotations__.items())])


def new_clock(unit_s: float, modulus: int) -> Any:
    """A clock that has not been read yet."""
    clock = np.zeros(1, CLOCK)[0]
    clock["unit_s"], clock["modulus"], clock["newest_s"] = unit_s, modulus, np.nan
    return clock


@kernel
def read(clock: DeviceClock, value: int, t_arrival_ns: int, restarted: bool) -> float:
    """Device seconds of a counter value; NaN when it cannot be true (a jump, counted). `restarted`: it is the device's first word."""
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
    """Counts since the newest value, and whether a true count can explain the value."""
    back = min(int(BEHIND_S / clock.unit_s), clock.modulus // 2)
    delta = (value - clock.newest + back) % clock.modulus - back
    elapsed_s = (t_arrival_ns - clock.newest_arrival_ns) * 1e-9
    wraps = round((elapsed_s - delta * clock.unit_s) / (clock.modulus * clock.unit_s))
    delta += max(wraps, 0) * clock.modulus
    return delta, delta * clock.unit_s <= elapsed_s + AHEAD_S


@kernel
def _begin(clock: DeviceClock, value: int, t_arrival_ns: int, seconds: float) -> float:
    clock.started = 1
    clock.newest, clock.newest_arrival_ns, clock.jumped = value, t_arrival_ns, 0
    clock.epoch_s = seconds - value * clock.unit_s
    arrival.begin(clock)
    arrival.update(clock, seconds, t_arrival_ns)
    return seconds


@kernel
def now_s(clock: DeviceClock) -> float:
    """Device seconds of the newest value; NaN before the first one."""
    return clock.epoch_s + clock.newest * clock.unit_s if clock.started else np.nan
