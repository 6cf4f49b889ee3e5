"""Rates of gyros that were cut off at the end of their range: what they left out is drawn in.

In: times and rates of sensors that clip, in blocks. Out: the same, a little later, with each cut-off top replaced by a smooth one. Owns the samples
that wait for the end of a top. A shank swings at 350 to 450 deg/s, an ADIS16100 ends at 300: without the top its angle would be short by some degrees
in every stride, and a bias would be made of that.
"""

from __future__ import annotations

import numpy as np

from echostep.arrays import Bools, Floats

NEAR = 0.985  # of the limit: a bias may have been taken away
EDGE = 2  # samples on either side that tell the slopes
LONGEST = 100  # samples at the limit: no swing, a broken sensor
HIGHEST = 1.8  # of the limit
SAME_PAIRS = 3  # of equal neighbours at an extreme, which a sensor within its range does not show
FASTEST_WITHIN_RAD_S = 2.0


class ClippingRepair:
    """Feed it blocks; the samples come back in order, `EDGE` samples late, those of a top when it is over."""

    def __init__(self, low: Floats, high: Floats) -> None:
        """`low`, `high` (k,): the ends of the range of each column; infinite where there is none."""
        self._low, self._high = NEAR * low, NEAR * high
        self._waiting = np.empty((0, 1 + len(low)))
        self._ready = 0  # of those that wait: gone already, kept for their slopes

    def feed(self, t_s: Floats, rates: Floats) -> tuple[Floats, Floats]:
        """Times (n,) and rates (n, k) that are certain now."""
        rows = np.vstack([self._waiting, np.column_stack([t_s, rates])])
        at_end: Bools = (rows[:, 1:] >= self._high) | (rows[:, 1:] <= self._low)
        clipped = np.logical_or.reduce(at_end, axis=1)
        until = len(rows) - EDGE
        while until > self._ready and clipped[until : until + EDGE].any() and len(rows) - until < LONGEST:
            until -= 1
        return self._release(rows, until)

    def finish(self) -> tuple[Floats, Floats]:
        """No more samples: those that wait."""
        return self._release(self._waiting, len(self._waiting))

    def _release(self, rows: Floats, until: int) -> tuple[Floats, Floats]:
        until = max(until, self._ready)
        mended = self._mended(rows)[self._ready : until]
        keep = max(until - EDGE, 0)
        self._waiting, self._ready = rows[keep:], until - keep
        return mended[:, 0], mended[:, 1:]

    def _mended(self, rows: Floats) -> Floats:
        found = rows.copy()
        for k, (low, high) in enumerate(zip(self._low.tolist(), self._high.tolist(), strict=True), start=1):
            for limit, at in ((high, rows[:, k] >= high), (low, rows[:, k] <= low)):
                if at.any():
                    _draw_tops(found[:, 0], found[:, k], at, limit / NEAR)
        return found


def _draw_tops(t_s: Floats, rate: Floats, at: Bools, limit: float) -> None:
    """Replace each stretch at the limit by the cubic that goes on from the slopes beside it, in place."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], at, [False]]).astype(np.int8)))
    for begin, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        a, b = begin - 1, end
        if a < 1 or b + 1 >= len(rate) or end - begin < 2 or end - begin > LONGEST or at[a - 1] or at[b + 1]:
            continue
        span = float(t_s[b] - t_s[a])
        before, after = t_s[a] - t_s[a - 1], t_s[b + 1] - t_s[b]
        if min(span, before, after) <= 0.0:
            continue
        m0, m1 = (rate[a] - rate[a - 1]) / before * span, (rate[b + 1] - rate[b]) / after * span
        u = (t_s[begin:end] - t_s[a]) / span
        cubic = (
            (2 * u**3 - 3 * u**2 + 1) * rate[a]
            + (u**3 - 2 * u**2 + u) * m0
            + (3 * u**2 - 2 * u**3) * rate[b]
            + (u**3 - u**2) * m1
        )
        way = np.sign(limit)
        rate[begin:end] = way * np.clip(way * cubic, way * rate[begin:end], HIGHEST * abs(limit))


def find_clipping_limits(rates: Floats) -> tuple[Floats, Floats]:
    """Where the sensors (n, k) end, by stretches of equal readings at their extremes; infinite for those that do not show it."""
    low, high = np.full(rates.shape[1], -np.inf), np.full(rates.shape[1], np.inf)
    for k, column in enumerate(rates.T):
        for ends, extreme in ((low, float(column.min())), (high, float(column.max()))):
            cut = column == extreme
            if abs(extreme) > FASTEST_WITHIN_RAD_S and (cut[1:] & cut[:-1]).sum() >= SAME_PAIRS:
                ends[k] = extreme
    return low, high


def repair_clipping(t_s: Floats, rates: Floats) -> Floats:
    """A whole record (n, k), mended."""
    whole = ClippingRepair(*find_clipping_limits(rates))
    _, first = whole.feed(t_s, rates)
    _, rest = whole.finish()
    return np.vstack([first, rest])
