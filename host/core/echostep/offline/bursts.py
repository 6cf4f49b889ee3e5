# SPDX-License-Identifier: MIT
"""Times that come in bursts, spread evenly.

In: times of samples (n,), s, ascending, as hosts stamp them: a driver that empties its queue gives all waiting samples one time, or times a fraction
of a millisecond apart. Out: the same samples' times, evenly spaced from burst to burst, and a note. Owns nothing.

The stamp of a burst is the time of its last sample; the samples before it were measured since the burst before.
"""

from __future__ import annotations

import numpy as np

from echostep.arrays import Floats

WITHIN = 0.25  # largest step within a burst, as a share of the time between bursts; assumed
ALIKE_SHARE = 0.8  # least share of the bursts that have the usual size; assumed
BETWEEN_QUANTILE = 0.9  # quantile of the steps that lies between two bursts, for bursts of up to ten samples
PAUSE = 1.5  # times the usual time between bursts; after a longer pause samples are missing, and the usual period is assumed
FEWEST = 8  # bursts


def spread(t_s: Floats) -> tuple[Floats, tuple[str, ...]]:
    """The times (n,), evenly spaced within each burst, and a note; unchanged, without a note, if they do not come in bursts of one size."""
    steps = np.diff(t_s)
    if len(steps) < FEWEST or (steps < 0.0).any():
        return t_s, ()
    between_s = float(np.quantile(steps, BETWEEN_QUANTILE))
    begin = np.flatnonzero(np.concatenate([[True], steps > WITHIN * between_s]))  # first sample of each burst
    sizes = np.diff(np.append(begin, len(t_s)))
    size = int(np.median(sizes))
    if size < 2 or len(begin) < FEWEST or (sizes == size).mean() < ALIKE_SHARE:
        return t_s, ()
    stamp_s = t_s[begin]
    usual_s = float(np.median(np.diff(stamp_s)))
    span_s = np.concatenate([[usual_s], np.diff(stamp_s)])  # from the burst before
    span_s = np.where(span_s > PAUSE * usual_s, usual_s * sizes / size, span_s)
    place = np.arange(len(t_s)) - np.repeat(begin, sizes)  # of each sample in its burst
    many = np.repeat(sizes, sizes)
    even_s = np.repeat(stamp_s, sizes) - (many - 1 - place) / many * np.repeat(span_s, sizes)
    return even_s, (f"times come in bursts of {size}: spread evenly, {size / usual_s:.4g} samples a second",)
