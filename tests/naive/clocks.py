# SPDX-License-Identifier: MIT
"""Slow, obviously right twins of the clocks: one value at a time, in plain Python."""

from __future__ import annotations

from collections import Counter, deque

from echostep.timing.arrival_envelope import BUCKET_S, CONFIRMING, DRIFT_SD, EARLY_S, KEPT_BUCKETS, LEAST_DELAY_S
from echostep.timing.device_clock import AHEAD_S, BACKLOG_S, BEHIND_S, RATE_ERROR, SMOOTH_S
from echostep.timing.timeline import BOARD_LATENCY_S, TICK_S, MtxTiming

Point = tuple[float, float]


class ArrivalClock:
    """Ties device seconds to the arrival clock; about 1 us a call."""

    def __init__(self) -> None:
        self._buckets: deque[tuple[int, Point]] = deque(maxlen=KEPT_BUCKETS)
        self._origin_ns: int | None = None
        self._early: list[tuple[int, int, float]] = []  # bucket, arrival, lag
        self._offset_s = 0.0
        self._drift = 0.0
        self._pivot_s = 0.0

    def update(self, device_s: float, t_arrival_ns: int) -> None:
        """One arrival; device seconds need not be in order."""
        if self._origin_ns is None:
            self._origin_ns = t_arrival_ns
        late = (t_arrival_ns - self._origin_ns) * 1e-9 - device_s
        bucket = int(device_s // BUCKET_S)
        if self._buckets and late < self.line(device_s) - EARLY_S:
            if self._early and bucket - self._early[0][0] > KEPT_BUCKETS:
                self._early = []
            self._early.append((bucket, t_arrival_ns, late))
            arrivals = [arrival for _, arrival, _ in self._early]
            if 1 + sum(a != b for a, b in zip(arrivals, arrivals[1:], strict=False)) < CONFIRMING:
                return
            late = max(lag for _, _, lag in self._early)
            self._early = []
        if not self._buckets or bucket > self._buckets[-1][0]:
            self._buckets.append((bucket, (device_s, late)))
            self._fit()
        elif bucket == self._buckets[-1][0] and late < self._buckets[-1][1][1]:
            self._buckets[-1] = (bucket, (device_s, late))
            if late < self.line(device_s):
                self._fit()

    def line(self, device_s: float) -> float:
        """Lag of undelayed bytes."""
        return self._offset_s + self._drift * (device_s - self._pivot_s)

    def elapsed_s(self, device_s: float, t_arrival_ns: int) -> float:
        """From the undelayed arrival of a device time to an arrival."""
        return (t_arrival_ns - (self._origin_ns or 0)) * 1e-9 - device_s - self.line(device_s)

    def shift(self, late_s: float) -> None:
        """The host's clock stepped."""
        self._origin_ns = (self._origin_ns or 0) + round(late_s * 1e9)

    @property
    def young(self) -> bool:
        """Less than two buckets."""
        return len(self._buckets) < 2

    def _fit(self) -> None:
        """The most probable line under all points: exponential delays, and a drift that is a crystal's."""
        points = [point for _, point in self._buckets]
        hull = lower_hull(points)
        total_x = total_y = 0.0
        for x, y in points:
            total_x, total_y = total_x + x, total_y + y
        self._pivot_s = total_x / len(points)
        excess_s = total_y / len(points) - self._height(hull)
        self._drift = most_probable_slope(hull, self._pivot_s, len(points) / max(excess_s, LEAST_DELAY_S))
        self._offset_s = min(y - self._drift * (x - self._pivot_s) for x, y in hull)

    def _height(self, hull: list[Point]) -> float:
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
    """Vertex by vertex."""
    best, found = -float("inf"), 0.0
    slopes = [-1.0, *((b[1] - a[1]) / (b[0] - a[0]) for a, b in zip(hull, hull[1:], strict=False)), 1.0]
    for (x, y), low, high in zip(hull, slopes, slopes[1:], strict=False):
        slope = min(max(-(DRIFT_SD * DRIFT_SD) * weight * (x - pivot), low), high)
        gain = weight * (y - slope * (x - pivot)) - 0.5 * (slope / DRIFT_SD) * (slope / DRIFT_SD)
        if gain > best:
            best, found = gain, slope
    return found


def _turn(a: Point, b: Point, c: Point) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


class DeviceClock:
    """A wrapping device counter -> device seconds that never wrap; follows restarts by arrival times."""

    def __init__(self, unit_s: float, modulus: int) -> None:
        self._unit_s = unit_s
        self._modulus = modulus
        self._newest: int | None = None  # unwrapped
        self._epoch_s = 0.0
        self._arrival = ArrivalClock()
        self._run: list[tuple[int, float]] = []  # arrival and lateness of what contradicts
        self.restarts = self.jumps = self.steps = self.contradicted = 0

    @property
    def newest_s(self) -> float | None:
        """Device time of the newest value."""
        return None if self._newest is None else self._epoch_s + self._newest * self._unit_s

    def at(self, value: int, t_arrival_ns: int, *, restarted: bool = False, leads: bool = True) -> float | None:
        """Device seconds of a counter value; None when it cannot be true (a jump, counted)."""
        if self._newest is None or self.newest_s is None:
            return self._begin(value, t_arrival_ns, value * self._unit_s)
        back = min(int(BEHIND_S / self._unit_s), self._modulus // 2)
        delta = (value - self._newest + back) % self._modulus - back
        ahead_s, smooth = delta * self._unit_s, delta * self._unit_s <= SMOOTH_S
        elapsed_s = self._arrival.elapsed_s(self.newest_s, t_arrival_ns)
        late_s, limit_s = elapsed_s - ahead_s, AHEAD_S + RATE_ERROR * abs(elapsed_s - ahead_s + ahead_s)
        wraps = max(round(late_s / (self._modulus * self._unit_s)), 0)
        beside_s = abs(late_s - wraps * self._modulus * self._unit_s)
        if not (smooth and wraps) and beside_s <= limit_s:
            self._run = []
            return self._advance(delta + wraps * self._modulus, t_arrival_ns)
        self.contradicted += 1
        if self._run and abs(late_s - self._run[0][1]) > AHEAD_S:
            self._run = []
        if not self._run or t_arrival_ns != self._run[-1][0]:
            self._run.append((t_arrival_ns, late_s))
        backlog = not self._arrival.young and t_arrival_ns - self._run[0][0] < BACKLOG_S * 1e9
        if (len(self._run) < CONFIRMING or (smooth and late_s > 0.0 and backlog)) and (smooth or not restarted):
            if smooth:
                return self._advance(delta, None)
            self.jumps += 1
            return None
        if not leads or (not smooth and value * self._unit_s <= elapsed_s + AHEAD_S):
            self.restarts += 1
            return self._begin(value, t_arrival_ns, max(self.to_device_s(t_arrival_ns), self.newest_s))
        self._run = []
        if beside_s > AHEAD_S + RATE_ERROR * abs(elapsed_s):
            self.steps += 1
            self._arrival.shift(late_s)
            wraps = 0
        return self._advance(delta + wraps * self._modulus, t_arrival_ns)

    def _advance(self, delta: int, t_arrival_ns: int | None) -> float:
        assert self._newest is not None
        unwrapped = self._newest + delta
        seconds = self._epoch_s + unwrapped * self._unit_s
        if delta > 0:
            self._newest = unwrapped
            if t_arrival_ns is not None:
                self._arrival.update(seconds, t_arrival_ns)
        return seconds

    def _begin(self, value: int, t_arrival_ns: int, seconds: float) -> float:
        self._newest, self._run = value, []
        self._epoch_s = seconds - value * self._unit_s
        self._arrival = ArrivalClock()
        self._arrival.update(seconds, t_arrival_ns)
        return seconds

    def forget(self) -> None:
        """Begin anew with the next value."""
        self._newest = None

    def to_arrival_s(self, device_s: float) -> float:
        """When bytes of that device time would have arrived at best, seconds of the host's clock."""
        return self._arrival.to_arrival_s(device_s)

    def to_device_s(self, t_arrival_ns: float) -> float:
        """Device time of bytes that arrive now and were not delayed."""
        return self._arrival.to_device_s(t_arrival_ns * 1e-9)


class Timeline:
    """`t_s` for everything that arrives."""

    def __init__(self, timing: MtxTiming) -> None:
        self._timing = timing
        self.board = DeviceClock(TICK_S, 1 << 32)
        self.mtx = DeviceClock(1.0 / timing.rate_hz, 1 << 16)
        self._edges = SyncEdges(1.0 / timing.rate_hz)
        self._mtx_newest_s: float | None = None
        self._behind = 0

    @property
    def board_newest_s(self) -> float | None:
        """Board time of the newest board message."""
        return self.board.newest_s

    @property
    def mtx_newest_s(self) -> float | None:
        """Time of the newest MTx sample."""
        return self._mtx_newest_s

    @property
    def synchronised(self) -> bool:
        """Whether SyncOut edges time the MTx samples."""
        return self._edges.locked

    def board_time(self, ticks: int, t_arrival_ns: int, *, restarted: bool = False) -> float | None:
        """`t_s` of a board message; None when its ticks cannot be true. `restarted`: it is the board's first word."""
        restarts, steps = self.board.restarts, self.board.steps
        t_s = self.board.at(ticks, t_arrival_ns, restarted=restarted)
        if self.board.restarts != restarts:
            self._edges.forget()
        if self.board.steps != steps:
            self.mtx.forget()
        return t_s

    def sync_edge(self, edge: int, t_s: float) -> None:
        """A SyncOut edge that the board saw."""
        self._edges.add(edge, t_s)

    def mtx_time(self, counter: int, t_arrival_ns: int) -> float | None:
        """`t_s` of an MTx sample, always later than the one before; None for a counter that cannot be true."""
        restarts = self.mtx.restarts
        device_s = self.mtx.at(counter, t_arrival_ns, leads=self.board.newest_s is None)
        if device_s is None:
            return None
        if self.mtx.restarts != restarts:
            self._edges.forget()
        t_s = self._on_board_clock(device_s, counter)
        if self._mtx_newest_s is not None and t_s < self._mtx_newest_s - BEHIND_S:
            self._behind += 1
            if self._behind < CONFIRMING:
                return None
        elif self._mtx_newest_s is not None and t_s <= self._mtx_newest_s:
            t_s = self._mtx_newest_s + 1e-6
        self._behind = 0
        self._mtx_newest_s = t_s
        return t_s

    def _on_board_clock(self, device_s: float, counter: int) -> float:
        if self.board.newest_s is None:
            return device_s
        sampled_s = self.mtx.to_arrival_s(device_s) - self._timing.latency_s
        by_arrival_s = self.board.to_device_s((sampled_s + BOARD_LATENCY_S) * 1e9)
        by_edge_s = self._edges.time_of(counter, by_arrival_s)
        return by_arrival_s if by_edge_s is None else by_edge_s


class SyncEdges:
    """SyncOut edges and which sample belongs to which.

    Edges and samples come in equal steps; only the number between them is unknown. Every sample votes for the edge
    nearest to its time by arrival, and the vote of the last `VOTES` samples decides. From there on a sample's time is
    its edge's, or follows from the newest edge and the measured period when that edge has not been seen.
    """

    VOTES = 50
    KEPT = 256

    def __init__(self, period_s: float) -> None:
        self._nominal_s = period_s
        self.forget()

    def forget(self) -> None:
        """Start anew after a restart of either side."""
        self._times: dict[int, float] = {}
        self._order: deque[int] = deque()
        self._votes: deque[int] = deque(maxlen=self.VOTES)
        self._offset: int | None = None
        self._period_s = self._nominal_s
        self._first: tuple[int, float] | None = None
        self._newest: tuple[int, float] | None = None  # unwrapped edge, time
        self._strays = self._strays_in_row = 0  # edges that belong to no sample, although the board has counted them

    @property
    def locked(self) -> bool:
        """Whether the vote has been decided."""
        return self._offset is not None

    def add(self, edge: int, t_s: float) -> None:
        """Keep an edge (u16 count) and its time; one that comes too early is no sample's, and later counts are one less."""
        if self._offset is not None and self._newest is not None and self._first is not None:
            steps = (edge - self._strays - self._newest[0]) & 0xFFFF
            known = self._newest[0] - self._first[0] >= self.VOTES
            if known and 0 < steps < self.VOTES and t_s < self._newest[1] + (steps - 0.2) * self._period_s:
                self._strays, self._strays_in_row = self._strays + 1, self._strays_in_row + 1
                if self._strays_in_row > 3:
                    self.forget()
                return
        self._strays_in_row = 0
        edge = (edge - self._strays) & 0xFFFF
        if self._newest is None or t_s - self._newest[1] > self.KEPT * self._nominal_s:
            unwrapped = edge
            self._first = (unwrapped, t_s)
        else:
            unwrapped = self._newest[0] + ((edge - self._newest[0]) & 0xFFFF)
        self._newest = (unwrapped, t_s)
        self._times[unwrapped & 0xFFFF] = t_s
        self._order.append(unwrapped & 0xFFFF)
        if len(self._order) > self.KEPT:
            self._times.pop(self._order.popleft(), None)
        if self._first is not None and unwrapped - self._first[0] >= self.VOTES:
            self._period_s = (t_s - self._first[1]) / (unwrapped - self._first[0])

    def time_of(self, counter: int, by_arrival_s: float) -> float | None:
        """Time of the sample with this u16 counter; None until the vote is decided or when edges are long gone."""
        if self._newest is None or abs(by_arrival_s - self._newest[1]) > 1e3 * self._nominal_s:
            return None
        self._vote(counter, by_arrival_s)
        if self._offset is None:
            return None
        edge = (counter - self._offset) & 0xFFFF
        if edge in self._times and abs(self._times[edge] - by_arrival_s) < 100 * self._nominal_s:
            return self._times[edge]
        ahead = ((edge - self._newest[0] + 0x8000) & 0xFFFF) - 0x8000
        t_s = self._newest[1] + ahead * self._period_s
        return t_s if abs(t_s - by_arrival_s) < 100 * self._nominal_s else None

    def _vote(self, counter: int, by_arrival_s: float) -> None:
        assert self._newest is not None
        ahead = round((by_arrival_s - self._newest[1]) / self._period_s)
        vote = (counter - self._newest[0] - ahead) & 0xFFFF
        self._votes.append(vote)
        if vote != self._offset and len(self._votes) == self.VOTES:
            offset, support = Counter(self._votes).most_common(1)[0]
            if support > self.VOTES // 2:
                self._offset = offset
