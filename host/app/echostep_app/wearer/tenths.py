# SPDX-License-Identifier: MIT
"""Tenths of a second of an accelerometer and a gyro: the means, peaks and unrest from which posture and falls are detected.

In: samples of one place of the body with their times. Out: `Tenth`s. Owns the samples of the unfinished tenth. A tenth is computed from all of its
samples at once, so the result does not depend on how they are cut into portions, to the last bit.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats, Ints

TENTH_S = 0.1
LEAST_SAMPLES = 3  # of a tenth that counts; sensors give 10 to 23


class Tenth(NamedTuple):
    """A tenth of a second that ends at `end_s`, in the sensor's axes. NaN where a sensor is missing.

    `force` (3,): mean specific force, m/s2; `peak`: its largest size; `unrest`: rms of its deviation from the mean. `rate` (3,): mean angular rate,
    rad/s; `turning`: its rms. `beside` (3,): mean specific force of the second sensor.
    """

    end_s: float
    force: tuple[float, float, float]
    peak: float
    unrest: float
    rate: tuple[float, float, float]
    turning: float
    beside: tuple[float, float, float]


class Tenths:
    """Call `cut` with the samples in order."""

    def __init__(self) -> None:
        self._rows: Floats = np.empty((0, 10))  # of the unfinished tenth: t_s, force, rate, force of the sensor beside
        self._index = -1  # of that tenth

    def cut(self, t_s: Floats, force: Floats, rate: Floats, beside: Floats | None = None) -> list[tuple[int, Tenth]]:
        """Tenths that samples complete, each with the index of the sample that does; samples of an earlier tenth are skipped.

        `t_s` (n,), `force` and `rate` (n, 3), `beside` (n, 3): of a second sensor, read at the same instants.
        """
        index = np.floor(t_s / TENTH_S).astype(np.int64)
        in_order = np.flatnonzero(index >= np.maximum.accumulate(np.r_[self._index, index])[:-1])
        if not len(in_order):
            return []
        waiting = len(self._rows)
        other = np.full_like(force, np.nan) if beside is None else beside
        rows = np.concatenate([self._rows, np.column_stack([t_s, force, rate, other])[in_order]])
        index = np.concatenate([np.full(waiting, self._index), index[in_order]])
        begins = np.flatnonzero(np.r_[True, index[1:] != index[:-1]])
        last = int(begins[-1])
        completed_by = in_order[begins[1:] - waiting].tolist()
        with np.errstate(over="ignore", invalid="ignore"):  # of numbers that no sensor measures
            tenths = _tenths(rows[:last], index[:last], begins[:-1]) if last else []
        self._rows, self._index = rows[last:].copy(), int(index[-1])
        return [(k, tenth) for k, tenth in zip(completed_by, tenths, strict=True) if tenth is not None]


def _tenths(rows: Floats, index: Ints, begins: Ints) -> list[Tenth | None]:
    """Whole tenths, which begin at the rows `begins`; None for a tenth with too few samples."""
    count = np.diff(np.r_[begins, len(rows)])
    means = np.add.reduceat(rows[:, 1:], begins) / count[:, None]
    force, rate = rows[:, 1:4], rows[:, 4:7]
    off = force - np.repeat(means[:, :3], count, axis=0)
    squares = np.column_stack([(force**2).sum(axis=1), (off**2).sum(axis=1), (rate**2).sum(axis=1)])
    peak = np.sqrt(np.maximum.reduceat(squares[:, 0], begins))
    rms = np.sqrt(np.add.reduceat(squares[:, 1:], begins) / count[:, None])
    ends_s = TENTH_S * (index[begins] + 1.0)
    columns = (ends_s, means, peak, rms, count)
    return [
        Tenth(end_s, tuple(m[:3]), largest, unrest, tuple(m[3:6]), turning, tuple(m[6:]))
        if n >= LEAST_SAMPLES
        else None
        for end_s, m, largest, (unrest, turning), n in zip(*(c.tolist() for c in columns), strict=True)
    ]
