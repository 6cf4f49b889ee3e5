"""Arrival times -> a device's clock on the host's clock, by a lower envelope.

In: device seconds and arrival times. Out: the mapping between both. Owns nothing: the least delayed arrival of each of the last seconds is in an
`ArrivalClock` that the caller keeps.
Delays only add: the true line lies below all points (device time, arrival - device time) and touches the least delayed ones, so the lower
convex hull of each second's least delayed point holds both the offset and the drift [Moon, Skelly, Towsley 1999].
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

BUCKET_S = 1.0
KEPT_BUCKETS = 60
DRIFT_SPAN_S = 5.0  # below this span the drift is taken as zero
MAX_DRIFT = 500e-6  # no crystal is worse


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


@njit(cache=True, error_model="numpy")
def begin(clock: ArrivalClock) -> None:
    """Forget everything."""
    clock.kept = 0
    clock.begun = 0
    clock.origin_ns = 0
    clock.offset_s = clock.drift = clock.pivot_s = 0.0


@njit(cache=True, error_model="numpy")
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


@njit(cache=True, error_model="numpy")
def _fit(clock: ArrivalClock) -> None:
    """The line through the hull edge in the middle of the window."""
    x, y = clock.device_s, clock.late_s
    hull = lower_hull(x[: clock.kept], y[: clock.kept])
    first, last = x[hull[0]], x[hull[-1]]
    middle = 0.5 * (first + last)
    left, right = hull[0], hull[-1]
    for k in range(len(hull) - 1):
        if x[hull[k]] <= middle <= x[hull[k + 1]]:
            left, right = hull[k], hull[k + 1]
    slope = (y[right] - y[left]) / (x[right] - x[left]) if last - first >= DRIFT_SPAN_S else 0.0
    clock.drift = min(max(slope, -MAX_DRIFT), MAX_DRIFT)
    clock.pivot_s = x[right]
    clock.offset_s = np.inf
    for k in hull:
        clock.offset_s = min(clock.offset_s, y[k] - clock.drift * (x[k] - clock.pivot_s))


@njit(cache=True, error_model="numpy")
def to_arrival_s(clock: ArrivalClock, device_s: float) -> float:
    """Host seconds at which undelayed bytes of that device time arrive; 0 before the first update."""
    late = clock.offset_s + clock.drift * (device_s - clock.pivot_s)
    return clock.origin_ns * 1e-9 + device_s + late


@njit(cache=True, error_model="numpy")
def to_device_s(clock: ArrivalClock, arrival_s: float) -> float:
    """Device seconds of bytes that arrive then and were not delayed."""
    local = arrival_s - clock.origin_ns * 1e-9
    return (local - clock.offset_s + clock.drift * clock.pivot_s) / (1.0 + clock.drift)


@njit(cache=True, error_model="numpy")
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


@njit(cache=True, error_model="numpy")
def _turn(x: Floats, y: Floats, a: int, b: int, c: int) -> float:
    return (x[b] - x[a]) * (y[c] - y[a]) - (y[b] - y[a]) * (x[c] - x[a])
