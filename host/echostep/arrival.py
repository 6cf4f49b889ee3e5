"""Arrival times -> a device's clock on the host's clock, by a lower envelope.

In: device seconds and arrival times. Out: the mapping between both. Owns the least delayed arrival of each of the last seconds.
Delays only add: the true line lies below all points (device time, arrival - device time) and touches the least delayed ones, so the lower
convex hull of each second's least delayed point holds both the offset and the drift [Moon, Skelly, Towsley 1999]. Among the lines that touch
it, the one of the most probable drift is taken: few undelayed points say little about a drift, and what crystals do is known.
"""

from __future__ import annotations

from collections import deque

BUCKET_S = 1.0
KEPT_BUCKETS = 60
DRIFT_SD = 130e-6  # between two crystals
LEAST_DELAY_S = 20e-6  # no delay is known better

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
        """The most probable line under all points: exponential delays, and a drift that is a crystal's."""
        points = [point for _, point in self._buckets]
        hull = lower_hull(points)
        self._pivot_s = sum(x for x, _ in points) / len(points)
        excess_s = sum(y for _, y in points) / len(points) - self._height(hull)
        weight = len(points) / max(excess_s, LEAST_DELAY_S)
        self._drift = most_probable_slope(hull, self._pivot_s, weight)
        self._offset_s = min(y - self._drift * (x - self._pivot_s) for x, y in hull)

    def _height(self, hull: list[Point]) -> float:
        """Of the hull at the pivot."""
        for a, b in zip(hull, hull[1:], strict=False):
            if b[0] >= self._pivot_s:
                return a[1] + (b[1] - a[1]) * (self._pivot_s - a[0]) / (b[0] - a[0])
        return hull[-1][1]

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


def most_probable_slope(hull: list[Point], pivot: float, weight: float) -> float:
    """Slope that maximises weight * (height at the pivot of the line touching the hull from below) - slope^2 / (2 DRIFT_SD^2).

    Under a line through the vertex x the height falls by slope * (x - pivot), so each vertex has its own best slope, within those of its edges.
    """
    best, found = -float("inf"), 0.0
    slopes = [-1.0, *((b[1] - a[1]) / (b[0] - a[0]) for a, b in zip(hull, hull[1:], strict=False)), 1.0]
    for (x, y), low, high in zip(hull, slopes, slopes[1:], strict=False):
        slope = min(max(-(DRIFT_SD**2) * weight * (x - pivot), low), high)
        gain = weight * (y - slope * (x - pivot)) - 0.5 * (slope / DRIFT_SD) ** 2
        if gain > best:
            best, found = gain, slope
    return found


def _turn(a: Point, b: Point, c: Point) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
