"""Arrival times -> a device's clock on the host's clock, by a lower envelope.

In: device seconds and arrival times. Out: the mapping between both. Owns the least delayed arrival of each of the last seconds.
Delays only add: the true line lies below all points (device time, arrival - device time) and touches the least delayed ones, so the lower
convex hull of each second's least delayed point holds both the offset and the drift [Moon, Skelly, Towsley 1999].
"""

from __future__ import annotations

from collections import deque

BUCKET_S = 1.0
KEPT_BUCKETS = 60
DRIFT_SPAN_S = 5.0  # below this span the drift is taken as zero
MAX_DRIFT = 500e-6  # no crystal is worse

Point = tuple[float, float]


class ArrivalClock:
    """Ties device seconds to the arrival clock; about 1 us a call."""

    def __init__(self) -> None:
        self._buckets: deque[tuple[int, Point]] = deque(maxlen=KEPT_BUCKETS)
        self._origin_ns: int | None = None
        self._offset_s = 0.0
        self._drift = 0.0
        self._pivot_s = 0.0

    def update(self, device_s: float, t_arrival_ns: int) -> None:
        """One arrival; device seconds need not be in order."""
        if self._origin_ns is None:
            self._origin_ns = t_arrival_ns
        late = (t_arrival_ns - self._origin_ns) * 1e-9 - device_s
        bucket = int(device_s // BUCKET_S)
        if not self._buckets or bucket > self._buckets[-1][0]:
            self._buckets.append((bucket, (device_s, late)))
            self._fit()
        elif bucket == self._buckets[-1][0] and late < self._buckets[-1][1][1]:
            self._buckets[-1] = (bucket, (device_s, late))
            if late < self._offset_s + self._drift * (device_s - self._pivot_s):
                self._fit()

    def _fit(self) -> None:
        """The line through the hull edge in the middle of the window."""
        hull = lower_hull([point for _, point in self._buckets])
        first, last = hull[0][0], hull[-1][0]
        middle = 0.5 * (first + last)
        left, right = hull[0], hull[-1]
        for a, b in zip(hull, hull[1:], strict=False):
            if a[0] <= middle <= b[0]:
                left, right = a, b
        slope = (right[1] - left[1]) / (right[0] - left[0]) if last - first >= DRIFT_SPAN_S else 0.0
        self._drift = min(max(slope, -MAX_DRIFT), MAX_DRIFT)
        self._pivot_s = right[0]
        self._offset_s = min(y - self._drift * (x - self._pivot_s) for x, y in hull)

    def to_arrival_s(self, device_s: float) -> float:
        """Host seconds at which undelayed bytes of that device time arrive; 0 before the first update."""
        late = self._offset_s + self._drift * (device_s - self._pivot_s)
        return (self._origin_ns or 0) * 1e-9 + device_s + late

    def to_device_s(self, arrival_s: float) -> float:
        """Device seconds of bytes that arrive then and were not delayed."""
        local = arrival_s - (self._origin_ns or 0) * 1e-9
        return (local - self._offset_s + self._drift * self._pivot_s) / (1.0 + self._drift)


def lower_hull(points: list[Point]) -> list[Point]:
    """Lower convex hull of points in order of x (Andrew's monotone chain)."""
    hull: list[Point] = []
    for point in points:
        while len(hull) > 1 and _turn(hull[-2], hull[-1], point) <= 0.0:
            hull.pop()
        hull.append(point)
    return hull


def _turn(a: Point, b: Point, c: Point) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
