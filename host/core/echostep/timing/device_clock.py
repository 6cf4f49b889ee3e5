# SPDX-License-Identifier: MIT
"""Wrapping device counters -> device seconds that never wrap.

In: counter values with their arrival times. Out: seconds since the device's first reset. Owns nothing: the caller keeps the `DeviceClock`.

Counters are protected by checksums, arrival times are not: a recording may have flipped bits, and a host that slept may have a clock that stood
still. So a message whose counter goes on from the newest one keeps its time by the counter, whatever its arrival time; a message whose counter jumps
needs an arrival time that agrees. A message whose counter and arrival both belong to a past time is dropped: a block of the recording was
written twice, or in another's place. Contradictions are counted. Only several arrival times that contradict in the same way are believed:

    the counter fits a device that started since the newest message    a restart: the arrival time sets the new epoch
    the arrival is whole wraps of the counter later                    a gap
    else                                                               the host's clock stepped or stood still: the counter is right
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from echostep.arrays import record_dtype
from echostep.jit import kernel, part
from echostep.timing import arrival_envelope as arrival
from echostep.timing.arrival_envelope import CONFIRMING, KEPT_BUCKETS, ArrivalClock

# Assumed, not measured.
AHEAD_S = 1.0  # a counter further ahead of its arrival contradicts it; the arrivals of a run agree to this
BEHIND_S = 1.0  # greatest age of a message relative to the newest one: a ping is sent after its ranging
SMOOTH_S = 1.0  # a counter that is at most this far from the newest continues it
RATE_ERROR = 400e-6  # s/s, greatest difference of two crystals over a gap
MOST_OF_A_WRAP = 0.125  # of the tolerance: beyond it, after a week, any arrival would agree with some number of wraps
BACKLOG_S = 1.0  # late arrivals of a continuous counter are accepted after this time: a process that was stopped reads its backlog in less


class DeviceClock(ArrivalClock, Protocol):
    """A counter of `modulus` values, one step each `unit_s`, and its arrival clock."""

    unit_s: float
    modulus: int
    started: int  # whether there was a value
    newest: int  # newest value, unwrapped
    epoch_s: float  # device seconds of the unwrapped value 0
    run: int  # different arrival times that contradicted since the last one that agreed
    run_begin_ns: int  # the first of them
    run_newest_ns: int
    run_late_s: float  # delay of the first of them against its counter
    contradicted: int  # messages whose arrival time contradicts their counter
    jumps: int  # contradicting messages that were dropped
    restarts: int
    steps: int  # of the host's clock
    newest_s: float  # used by the timeline: `t_s` of the newest message, NaN before it
    behind: int  # used by the timeline: messages far behind it, in a row


CLOCK = record_dtype(DeviceClock, array_size=KEPT_BUCKETS)


def new_clock(unit_s: float, modulus: int) -> Any:
    """The clock of a counter that has no value yet."""
    clock = np.zeros(1, CLOCK)[0]
    clock["unit_s"], clock["modulus"], clock["newest_s"] = unit_s, modulus, np.nan
    return clock


@part
def read(clock: DeviceClock, value: int, t_arrival_ns: int, restarted: bool, leads: bool) -> float:
    """Device seconds of a counter value; NaN if it is dropped (a jump, counted).

    `restarted`: in the first message after a start. `leads`: no other clock is above this one; else a contradiction is settled by a new epoch.
    """
    if not clock.started:
        return _begin(clock, value, t_arrival_ns, value * clock.unit_s)
    back = min(int(BEHIND_S / clock.unit_s), clock.modulus // 2)
    delta = (value - clock.newest + back) % clock.modulus - back
    late_s = _elapsed_s(clock, t_arrival_ns) - delta * clock.unit_s
    wraps = max(round(late_s / (clock.modulus * clock.unit_s)), 0)
    if _is_old(clock, delta, late_s):
        return np.nan
    if not _agrees(clock, delta, late_s, wraps):
        return _contradiction(clock, value, delta, t_arrival_ns, restarted, leads)
    clock.run = 0
    return _advance(clock, delta + wraps * clock.modulus, t_arrival_ns)


@part
def _elapsed_s(clock: DeviceClock, t_arrival_ns: int) -> float:
    """Time from the arrival of the newest value, had it not been delayed, to this arrival."""
    newest_s = clock.epoch_s + clock.newest * clock.unit_s
    return (t_arrival_ns - clock.origin_ns) * 1e-9 - newest_s - arrival.line(clock, newest_s)


@part
def _agrees(clock: DeviceClock, delta: int, late_s: float, wraps: int) -> bool:
    """Whether an arrival agrees with a counter `delta` counts from the newest one.

    Whole wraps need confirmation where the counter is continuous, and where there are so many that any arrival would agree.
    """
    if wraps > 0 and delta * clock.unit_s <= SMOOTH_S:
        return False
    limit_s, wrap_s = AHEAD_S + RATE_ERROR * abs(late_s + delta * clock.unit_s), clock.modulus * clock.unit_s
    if wraps > 0 and limit_s > MOST_OF_A_WRAP * wrap_s:
        return False
    return abs(late_s - wraps * wrap_s) <= limit_s


@part
def _is_old(clock: DeviceClock, delta: int, late_s: float) -> bool:
    """Whether counter and arrival both belong to a time before the newest message: it is duplicated or displaced in a recording.

    A counter that seems to be `delta` ahead is then behind by whole wraps less `delta`, and its arrival is as much earlier.
    """
    before_s = -(late_s + delta * clock.unit_s)
    wrap_s = clock.modulus * clock.unit_s
    wraps = round(-late_s / wrap_s)
    if wraps < 1 or before_s <= AHEAD_S or delta * clock.unit_s <= SMOOTH_S:
        return False
    return abs(late_s + wraps * wrap_s) <= AHEAD_S + RATE_ERROR * before_s


@part
def _contradiction(
    clock: DeviceClock, value: int, delta: int, t_arrival_ns: int, restarted: bool, leads: bool
) -> float:
    """Device seconds of a value whose arrival contradicts it; NaN while it may be damaged."""
    clock.contradicted += 1
    elapsed_s, smooth = _elapsed_s(clock, t_arrival_ns), delta * clock.unit_s <= SMOOTH_S
    late_s = elapsed_s - delta * clock.unit_s
    _extend_run(clock, late_s, t_arrival_ns)
    backlog = clock.kept > 1 and clock.run_newest_ns - clock.run_begin_ns < BACKLOG_S * 1e9
    unsettled = clock.run < CONFIRMING or (smooth and late_s > 0.0 and backlog)
    if unsettled and (smooth or not restarted):
        if smooth:
            return _advance(clock, delta, -1)
        clock.jumps += 1
        return np.nan
    if not leads or (not smooth and value * clock.unit_s <= elapsed_s + AHEAD_S):
        clock.restarts += 1
        return _begin(clock, value, t_arrival_ns, max(arrival.to_device_s(clock, t_arrival_ns * 1e-9), now_s(clock)))
    clock.run = 0
    wraps = max(round(late_s / (clock.modulus * clock.unit_s)), 0)
    if abs(late_s - wraps * clock.modulus * clock.unit_s) > AHEAD_S + RATE_ERROR * abs(elapsed_s):
        clock.steps += 1
        clock.origin_ns += round(late_s * 1e9)
        wraps = 0
    return _advance(clock, delta + wraps * clock.modulus, t_arrival_ns)


@part
def _extend_run(clock: DeviceClock, late_s: float, t_arrival_ns: int) -> None:
    """Count one more arrival time that contradicts; one that differs from those before begins a new run. Messages of one chunk count once."""
    if clock.run == 0 or abs(late_s - clock.run_late_s) > AHEAD_S:
        clock.run, clock.run_begin_ns, clock.run_late_s = 1, t_arrival_ns, late_s
    elif t_arrival_ns != clock.run_newest_ns:
        clock.run += 1
    clock.run_newest_ns = t_arrival_ns


@part
def _advance(clock: DeviceClock, delta: int, t_arrival_ns: int) -> float:
    """Device seconds of the value `delta` counts from the newest one; a newer value becomes the newest one. -1: no arrival time to use."""
    unwrapped = clock.newest + delta
    seconds = clock.epoch_s + unwrapped * clock.unit_s
    if delta > 0:
        clock.newest = unwrapped
        if t_arrival_ns >= 0:
            arrival.update(clock, seconds, t_arrival_ns)
    return seconds


@part
def _begin(clock: DeviceClock, value: int, t_arrival_ns: int, seconds: float) -> float:
    """Begin a new epoch: `value` is at device time `seconds`."""
    clock.started = 1
    clock.newest, clock.run = value, 0
    clock.epoch_s = seconds - value * clock.unit_s
    clock.kept = clock.early = 0  # all points and the line are discarded
    arrival.update(clock, seconds, t_arrival_ns)
    return seconds


@kernel
def now_s(clock: DeviceClock) -> float:
    """Device seconds of the newest value; NaN before the first one."""
    return clock.epoch_s + clock.newest * clock.unit_s if clock.started else np.nan
