# SPDX-License-Identifier: MIT
"""A device's clock on the host's clock, by the lower envelope of its arrival times.

In: device seconds and arrival times. Out: device seconds -> host seconds, and back. Owns nothing: the caller keeps the `ArrivalClock`.

One point for each message: x = device time, y = lag = arrival time - device time. Bytes are never early, so the true line of offset and drift
lies below all points and touches the least delayed ones. The line is fitted to the lower convex hull of the least delayed point of each second
[Moon, Skelly, Towsley 1999]. Of all lines that touch the hull from below, the most probable one is used: exponential delays, and a
Gaussian prior on the drift. The prior matters while few points are undelayed.

    lag |   .     .
        |  .   .     .      . delayed arrivals
        |      .   . ___o
        |   _o----o~        o vertices of the lower hull, the line touches one of them
        |o~
        +------------------ device time
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.jit import kernel, part

BUCKET_S = 1.0  # device time for which one point is kept, assumed
KEPT_BUCKETS = 60  # buckets in the fit, one minute; assumed
DRIFT_SD = 130e-6  # s/s, standard deviation of the drift between two crystals, assumed
LEAST_DELAY_S = 20e-6  # lower bound of the mean delay in the fit: the resolution of arrival times
EARLY_S = 0.02  # an arrival further below the line needs others like it: half the error that a damaged one may cause
# Different arrival times that are believed together: two damaged ones within a minute are rare
CONFIRMING = 3


class ArrivalClock(Protocol):
    """The fitted line, lag = offset_s + drift * (device time - pivot_s), and its points, one per bucket."""

    kept: int  # buckets in use, the oldest first
    bucket: Ints  # (KEPT_BUCKETS,) number of each bucket
    device_s: Floats  # (KEPT_BUCKETS,) device time of its least delayed message
    lag_s: Floats  # (KEPT_BUCKETS,) lag of that message, on the host's clock from `origin_ns`
    origin_ns: int  # first arrival time
    offset_s: float
    drift: float
    pivot_s: float
    early: int  # arrivals below the line by more than `EARLY_S` that are not believed yet
    early_bucket: int  # of the first of them
    early_newest_ns: int  # the newest of them
    early_lag_s: float  # of the least early one


@kernel
def update(clock: ArrivalClock, device_s: float, t_arrival_ns: int) -> None:
    """Add one arrival and fit the line again if it changes. Device seconds may be out of order."""
    if not clock.kept:
        clock.origin_ns = t_arrival_ns
    lag = (t_arrival_ns - clock.origin_ns) * 1e-9 - device_s
    bucket = int(device_s // BUCKET_S)
    last = clock.kept - 1
    if last >= 0 and lag < line(clock, device_s) - EARLY_S:
        lag = _believed_lag(clock, bucket, lag, t_arrival_ns)
        if lag == np.inf:
            return
    if last < 0 or bucket > clock.bucket[last]:
        if clock.kept == KEPT_BUCKETS:
            for k in range(last):
                clock.bucket[k], clock.device_s[k] = clock.bucket[k + 1], clock.device_s[k + 1]
                clock.lag_s[k] = clock.lag_s[k + 1]
        else:
            clock.kept += 1
            last += 1
        clock.bucket[last], clock.device_s[last], clock.lag_s[last] = bucket, device_s, lag
        _fit(clock)
    elif bucket == clock.bucket[last] and lag < clock.lag_s[last]:
        clock.device_s[last], clock.lag_s[last] = device_s, lag
        if lag < line(clock, device_s):
            _fit(clock)


@part
def line(clock: ArrivalClock, device_s: float) -> float:
    """Lag of undelayed bytes of device time `device_s`."""
    return clock.offset_s + clock.drift * (device_s - clock.pivot_s)


@part
def _believed_lag(clock: ArrivalClock, bucket: int, lag: float, t_arrival_ns: int) -> float:
    """The lag to use for an early arrival: the least early one's when `CONFIRMING` of them came within the kept buckets, else infinite."""
    if clock.early == 0 or bucket - clock.early_bucket > KEPT_BUCKETS:
        clock.early, clock.early_bucket, clock.early_lag_s = 1, bucket, lag
    else:
        clock.early += t_arrival_ns != clock.early_newest_ns
        clock.early_lag_s = max(clock.early_lag_s, lag)
    clock.early_newest_ns = t_arrival_ns
    if clock.early < CONFIRMING:
        return np.inf
    clock.early = 0
    return clock.early_lag_s


@part
def _fit(clock: ArrivalClock) -> None:
    """Fit the most probable line under all points; the mean delay is the mean height of the points above the hull at the pivot."""
    n = clock.kept
    x, y = clock.device_s[:n], clock.lag_s[:n]
    hull = lower_hull(x, y)
    total_x, total_y = 0.0, 0.0
    for k in range(n):
        total_x += x[k]
        total_y += y[k]
    pivot = total_x / n
    excess_s = total_y / n - _height(x, y, hull, pivot)
    slope = most_probable_slope(x, y, hull, pivot, n / max(excess_s, LEAST_DELAY_S))
    clock.pivot_s, clock.drift = pivot, slope
    clock.offset_s = np.inf
    for k in hull:
        clock.offset_s = min(clock.offset_s, y[k] - slope * (x[k] - pivot))


@part
def _height(x: Floats, y: Floats, hull: Ints, pivot: float) -> float:
    """Height of the hull at the pivot, interpolated between two vertices."""
    for k in range(len(hull) - 1):
        a, b = hull[k], hull[k + 1]
        if x[b] >= pivot:
            return y[a] + (y[b] - y[a]) * (pivot - x[a]) / (x[b] - x[a])
    return y[hull[-1]]


@kernel
def most_probable_slope(x: Floats, y: Floats, hull: Ints, pivot: float, weight: float) -> float:
    """Slope that maximises weight * (height at the pivot of the line touching the hull from below) - slope^2 / (2 DRIFT_SD^2).

    The height at the pivot of a line through vertex x is y - slope * (x - pivot). So each vertex has its own best slope, limited to the slopes of
    its two edges; the best vertex wins.
    """
    best_gain, best_slope, low = -np.inf, 0.0, -1.0
    for k in range(len(hull)):
        a = hull[k]
        high = 1.0
        if k + 1 < len(hull):
            b = hull[k + 1]
            high = (y[b] - y[a]) / (x[b] - x[a])
        slope = min(max(-(DRIFT_SD * DRIFT_SD) * weight * (x[a] - pivot), low), high)
        gain = weight * (y[a] - slope * (x[a] - pivot)) - 0.5 * (slope / DRIFT_SD) * (slope / DRIFT_SD)
        if gain > best_gain:
            best_gain, best_slope = gain, slope
        low = high
    return best_slope


@kernel
def to_arrival_s(clock: ArrivalClock, device_s: float) -> float:
    """Host seconds at which undelayed bytes of device time `device_s` arrive; `device_s` itself before the first update."""
    lag = line(clock, device_s)
    return clock.origin_ns * 1e-9 + device_s + lag


@kernel
def to_device_s(clock: ArrivalClock, arrival_s: float) -> float:
    """Device seconds of undelayed bytes that arrive at `arrival_s` on the host's clock."""
    local = arrival_s - clock.origin_ns * 1e-9
    return (local - clock.offset_s + clock.drift * clock.pivot_s) / (1.0 + clock.drift)


@kernel
def lower_hull(x: Floats, y: Floats) -> Ints:
    """Indices of the lower convex hull of points (n,) in order of x (Andrew's monotone chain)."""
    hull = np.empty(len(x), np.int64)
    n = 0
    for k in range(len(x)):
        while n > 1 and _turn(x, y, hull[n - 2], hull[n - 1], k) <= 0.0:
            n -= 1
        hull[n] = k
        n += 1
    return hull[:n]


@part
def _turn(x: Floats, y: Floats, a: int, b: int, c: int) -> float:
    """Twice the signed area of the triangle a, b, c: positive for a left turn."""
    return (x[b] - x[a]) * (y[c] - y[a]) - (y[b] - y[a]) * (x[c] - x[a])
