# SPDX-License-Identifier: MIT
"""Reconstruction of peaks that a gyro has clipped at the end of its range.

In: times and rates of sensors that clip, in blocks. Out: the same, a little later, with each clipped peak replaced by a cubic. Owns the samples
that wait for the end of a peak. A shank swings at 350 to 450 deg/s; the range of an ADIS16100 ends at 300. Without the peaks its angle would lose
some degrees in every stride, and the estimator would take this loss for a bias of the gyro.
"""

from __future__ import annotations

import numpy as np

from echostep.arrays import Bools, Floats, spans

# The source of these values is not recorded.
NEAR = 0.985  # share of the limit from which a rate counts as clipped: a bias may have been subtracted from it
BEYOND = 1.03  # share of the limit above which a rate shows that the sensor's range is wider: 9 deg/s more than a bias of 300 deg/s can explain
EDGE = 2  # samples on either side of a peak, which give the slopes
LONGEST = 100  # samples at the limit; more of them are a broken sensor, not a swing
HIGHEST = 1.8  # largest reconstructed rate, as a multiple of the limit


class ClippingRepair:
    """Takes samples in blocks and returns them in order: `EDGE` samples late, samples of a peak after its end."""

    def __init__(self, low: Floats, high: Floats) -> None:
        """`low`, `high` (k,): the ends of the range of each column; infinite without a limit."""
        self._low, self._high = low, high
        self._waiting = np.empty((0, 1 + len(low)))
        self._returned = 0  # waiting samples that were returned already and are kept for their slopes

    def feed(self, t_s: Floats, rates: Floats) -> tuple[Floats, Floats]:
        """Times (n,) and rates (n, k) of the samples that no later sample can change."""
        rows = np.vstack([self._waiting, np.column_stack([t_s, rates])])
        at_limit: Bools = _at_limit(rows[:, 1:], self._high) | _at_limit(-rows[:, 1:], -self._low)
        clipped = np.logical_or.reduce(at_limit, axis=1)
        until = len(rows) - EDGE
        while until > self._returned and clipped[until : until + EDGE].any() and len(rows) - until < LONGEST:
            until -= 1
        return self._release(rows, until)

    def finish(self) -> tuple[Floats, Floats]:
        """The samples that still wait; no more may follow."""
        return self._release(self._waiting, len(self._waiting))

    def _release(self, rows: Floats, until: int) -> tuple[Floats, Floats]:
        """Times and repaired rates of the rows (n, 1 + k) up to `until`; the others wait."""
        until = max(until, self._returned)
        repaired = self._repaired(rows)[self._returned : until]
        keep = max(until - EDGE, 0)
        self._waiting, self._returned = rows[keep:], until - keep
        return repaired[:, 0], repaired[:, 1:]

    def _repaired(self, rows: Floats) -> Floats:
        """The rows (n, 1 + k), time first, with the peaks of all columns reconstructed."""
        repaired = rows.copy()
        for k, (low, high) in enumerate(zip(self._low.tolist(), self._high.tolist(), strict=True), start=1):
            for limit, clipped in ((high, _at_limit(rows[:, k], high)), (low, _at_limit(-rows[:, k], -low))):
                if clipped.any():
                    _reconstruct_peaks(repaired[:, 0], repaired[:, k], clipped, limit)
        return repaired


def _at_limit(rate: Floats, limit: float | Floats) -> Bools:
    """Whether rates are at the upper limit: not below it, and not beyond it, where only a sensor with a wider range reads."""
    return (rate >= NEAR * limit) & (rate <= BEYOND * limit)


def _reconstruct_peaks(t_s: Floats, rate: Floats, clipped: Bools, limit: float) -> None:
    """Replace each clipped stretch of `rate` (n,) in place by a cubic Hermite spline through the samples beside it, with their slopes.

    A stretch stays as it is if it has one sample only, is too long, or has no unclipped samples on both sides.
    """
    for begin, end in spans(clipped).tolist():
        a, b = begin - 1, end
        if a < 1 or b + 1 >= len(rate) or end - begin < 2 or end - begin > LONGEST or clipped[a - 1] or clipped[b + 1]:
            continue
        span = float(t_s[b] - t_s[a])
        before, after = t_s[a] - t_s[a - 1], t_s[b + 1] - t_s[b]
        if min(span, before, after) <= 0.0:
            continue
        m0, m1 = (rate[a] - rate[a - 1]) / before * span, (rate[b + 1] - rate[b]) / after * span
        u = (t_s[begin:end] - t_s[a]) / span
        u2, u3 = u * u, u * u * u
        cubic = (2 * u3 - 3 * u2 + 1) * rate[a] + (u3 - 2 * u2 + u) * m0 + (3 * u2 - 2 * u3) * rate[b] + (u3 - u2) * m1
        side = np.sign(limit)
        rate[begin:end] = side * np.clip(side * cubic, side * rate[begin:end], HIGHEST * abs(limit))
