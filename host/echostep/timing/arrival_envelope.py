"""Arrival times -> a device's clock on the host's clock, by a lower envelope.

In: device seconds and arrival times. Out: the mapping between both. Owns nothing: the least delayed arrival of each of the last seconds is in an
`ArrivalClock` that the caller keeps.
Delays only add: the true line lies below all points (device time, arrival - device time) and touches the least delayed ones, so the lower
convex hull of each second's least delayed point holds both the offset and the drift [Moon, Skelly, Towsley 1999]. Among the lines that touch
it, the one of the most probable drift is taken: few undelayed points say little about a drift, and what crystals do is known.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.jit import kernel

BUCKET_S = 1.0
KEPT_BUCKETS = 60
DRIFT_SD = 130e-6  # between two crystals
LEAST_DELAY_S = 20e-6  # no delay is known better


class ArrivalClock(Protocol):
    """The line and what it is drawn through: of each of the last seconds (`bucket`) the device time and how late its bytes came."""

    kept: int
    bucket: Ints
    device_s: Floats
    late_s: Floats
    begun: int
    origin_ns: int
    offset_s: float
    drift: float
    pivot_s: float


FIELDS = [
    ("kept", "i8"), ("bucket", "i8", KEPT_BUCKETS), ("device_s", "f8", KEPT_BUCKETS), ("late_s", "f8", KEPT_BUCKETS),
    ("begun", "i8"), ("origin_ns", "i8"), ("offset_s", "f8"), ("drift", "f8"), ("pivot_s", "f8"),
]  # fmt: skip


@kernel
def begin(clock: ArrivalClock) -> None:
    """Forget everything."""
    clock.kept = 0
    clock.begun = 0
    clock.origin_ns = 0
    clock.offset_s = clock.drift = clock.pivot_s = 0.0


@kernel
def update(clock: ArrivalClock, device_s: float, t_arrival_ns: int) -> None:
    """One arrival; device seconds need not be in order."""
    if not clock.begun:
        clock.begun = 1
        clock.origin_ns = t_arrival_ns
    late = (t_arrival_ns - clock.origin_ns) * 1e-9 - device_s
    bucket = int(device_s // BUCKET_S)
    last = clock.kept - 1
    if last < 0 or bucket > clock.bucket[last]:
        if clock.kept == KEPT_BUCKETS:
            clock.bucket[:-1] = clock.bucket[1:].copy()
            clock.device_s[:-1] = clock.device_s[1:].copy()
            clock.late_s[:-1] = clock.late_s[1:].copy()
        else:
            clock.kept += 1
            last += 1
        clock.bucket[last], clock.device_s[last], clock.late_s[last] = bucket, device_s, late
        _fit(clock)
    elif bucket == clock.bucket[last] and late < clock.late_s[last]:
        clock.device_s[last], clock.late_s[last] = device_s, late
        if late < clock.offset_s + clock.drift * (device_s - clock.pivot_s):
            _fit(clock)


@kernel
def _fit(clock: ArrivalClock) -> None:
    """The most probable line under all points: exponential delays, and a drift that is a crystal's."""
    n = clock.kept
    x, y = clock.device_s[:n], clock.late_s[:n]
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


@kernel
def _height(x: Floats, y: Floats, hull: Ints, pivot: float) -> float:
    """Of the hull at the pivot."""
    for k in range(len(hull) - 1):
        a, b = hull[k], hull[k + 1]
        if x[b] >= pivot:
            return y[a] + (y[b] - y[a]) * (pivot - x[a]) / (x[b] - x[a])
    return y[hull[-1]]


@kernel
def most_probable_slope(x: Floats, y: Floats, hull: Ints, pivot: float, weight: float) -> float:
    """Slope that maximises weight * (height at the pivot of the line touching the hull from below) - slope^2 / (2 DRIFT_SD^2).

    Under a line through the vertex x the height falls by slope * (x - pivot), so each vertex has its own best slope, within those of its edges.
    """
    best, found, low = -np.inf, 0.0, -1.0
    for k in range(len(hull)):
        a = hull[k]
        high = 1.0
        if k + 1 < len(hull):
            b = hull[k + 1]
            high = (y[b] - y[a]) / (x[b] - x[a])
        slope = min(max(-(DRIFT_SD * DRIFT_SD) * weight * (x[a] - pivot), low), high)
        gain = weight * (y[a] - slope * (x[a] - pivot)) - 0.5 * (slope / DRIFT_SD) * (slope / DRIFT_SD)
        if gain > best:
            best, found = gain, slope
        low = high
    return found


@kernel
def to_arrival_s(clock: ArrivalClock, device_s: float) -> float:
    """Host seconds at which undelayed bytes of that device time arrive; 0 before the first update."""
    late = clock.offset_s + clock.drift * (device_s - clock.pivot_s)
    return clock.origin_ns * 1e-9 + device_s + late


@kernel
def to_device_s(clock: ArrivalClock, arrival_s: float) -> float:
    """Device seconds of bytes that arrive then and were not delayed."""
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


@kernel
def _turn(x: Floats, y: Floats, a: int, b: int, c: int) -> float:
    return (x[b] - x[a]) * (y[c] - y[a]) - (y[b] - y[a]) * (x[c] - x[a])
