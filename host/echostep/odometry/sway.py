# SPDX-License-Identifier: MIT
"""Sway: the small slow turning of a foot or a leg that carries a living wearer, told from the noise of its gyros.

In: samples of the gyros' channels, by windows of half a second. Out: for each window whether it sways. Owns the sums of the unfinished window.

Noise is white: means over 0.1 s have a fifth of the variance of means over 0.02 s. Sway is slow (below 3 Hz), so it adds to the former alone;
shivering, machines and engines add to the latter as well. No level of noise has to be known or learnt.
"""

from __future__ import annotations

import numpy as np

from echostep.arrays import Bools, Floats, Ints

SHORT, GROUPS = 25, 5  # short means of 0.02 s in a window of half a second, long means of 0.1 s
# Ratio of the long means' variance to that of white noise. By reason: a pair of leg gyros, the least that is judged, exceeds 2.5 by chance in 3 % of
# all windows, hence never in most of ten. Where recorded feet are stillest it is 0.6 to 2.
LEAST_RATIO = 2.5
# rad/s, standard deviation of the long means, all channels: in public recordings of quiet standing 40-100 % of the half seconds of shanks and
# thighs exceed it, 0-80 % of those of feet; breathing turns neither.
LEAST_RAD_S = 0.004


class SwayWindows:
    """`add` takes samples; `restart` tells of the last window when the next sample is of a later one."""

    def __init__(self, channels: int) -> None:
        self.channels = channels
        self._sums: Floats = np.zeros((SHORT, channels))
        self._counts: Floats = np.zeros(SHORT)

    def add(self, index: Ints, part: Ints, values: Floats) -> Bools:
        """Whether the windows sway that these samples touch, in ascending order; the last one is not finished.

        `index` (n,), ascending: window of each sample. `part` (n,): its short mean, 0 to 24. `values` (n, c) in rad/s. The first window is the last
        one of the previous call when nothing came in between (`restart` otherwise).
        """
        windows = np.r_[True, index[1:] != index[:-1]].cumsum() - 1
        flat, total = windows * SHORT + part, int(windows[-1] + 1) * SHORT
        counts = np.bincount(flat, minlength=total).astype(np.float64)
        sums: Floats = np.column_stack([np.bincount(flat, column, total) for column in values.T])
        counts[:SHORT] += self._counts
        sums[:SHORT] += self._sums
        self._counts, self._sums = counts[-SHORT:], sums[-SHORT:]
        with np.errstate(divide="ignore", invalid="ignore"):
            short = (sums / counts[:, None]).reshape(-1, SHORT, values.shape[1])
        return sways(short)

    def restart(self) -> Bools:
        """Whether the last window sways; the next samples are of a later one."""
        with np.errstate(divide="ignore", invalid="ignore"):
            short = (self._sums / self._counts[:, None])[None]
        self._sums, self._counts = np.zeros_like(self._sums), np.zeros(SHORT)
        return sways(short)


def sways(short: Floats) -> Bools:
    """Whether windows of short means (w, 25, c) in rad/s sway (w,); one with a missing mean does not."""
    long = short.reshape(len(short), GROUPS, SHORT // GROUPS, -1).mean(axis=2)
    slow = long.var(axis=1, ddof=1).sum(axis=1)
    noise = 0.5 * (np.diff(short, axis=1) ** 2).mean(axis=1).sum(axis=1) / (SHORT // GROUPS)
    found: Bools = (slow > LEAST_RATIO * noise) & (slow > LEAST_RAD_S**2)
    return found
