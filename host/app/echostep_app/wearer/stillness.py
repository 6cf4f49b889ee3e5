# SPDX-License-Identifier: MIT
"""Stillness: since when the wearer has not moved, by the sensors and not by the track.

In: samples of the foot's MTx and of the leg gyros, with their times. Out: windows, with or without motion. Owns the extremes of the unfinished ones.
A window of half a second has motion when the range of a channel (largest less smallest sample) exceeds its limit: so a slow bias, gravity and the
orientation in which a wearer lies do not matter, and the result does not depend on how samples are cut into portions. Pings are not used: they change
when others walk by. A window below these limits may still show that a living wearer stands or crouches on the foot (`sway.py`).

Sway, the small slow turning of a foot or a leg that carries a living wearer, is separated from the noise of its gyros by spectrum. Noise is white:
means over 0.1 s have a fifth of the variance of means over 0.02 s. Sway is slow (below 3 Hz), so it adds to the former alone; shivering, machines and
engines add to the latter as well. No level of noise has to be known or learnt.
"""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

import numpy as np

from echostep.arrays import Bools, Floats, Ints
from echostep.legs.trunk_path import GyroBlock

SHORT, GROUPS = 25, 5  # short means of 0.02 s in a window of half a second, long means of 0.1 s
# Ratio of the long means' variance to that of white noise. A pair of leg gyros, the least that is tested, exceeds 2.5 by chance in 3 % of
# all windows, hence never in most of ten. Where recorded feet are stillest it is 0.6 to 2.
LEAST_RATIO = 2.5
# rad/s, standard deviation of the long means, all channels: in public recordings of quiet standing 40-100 % of the half seconds of shanks and
# thighs exceed it, 0-80 % of the half seconds of feet; breathing turns neither.
LEAST_RAD_S = 0.004
WINDOW_S = 0.5
MOST_SAMPLES = 10_000  # of one window, 20 kHz: no sensor has more, and times that stand still fill no memory
# Limits: twice the largest range of an MTx's noise in half a second (0.105 rad/s, 0.26 m/s2 by its manual, simulated; other sensors of the
# public recordings: 0.04 rad/s, 0.16 m/s2). A foot that is lifted, turned or shifted exceeds them several times; breathing turns no shoe.
FOOT_RAD_S, FOOT_M_S2 = 0.2, 0.6
LEG_RAD_S = 0.15  # of thigh, shank and belt; noise of an ADIS16100 has a range of 0.05 rad/s, breathing turns a belt by less than 0.03 rad/s
# Sway counts when most windows of the last seconds have it: a twitch of a wearer who is unconscious is a window or two.
SWAY_WINDOWS, LEAST_SWAYING = 10, 8


def swaying(t_s: Floats, windows: Ints, values: Floats) -> Bools:
    """Whether windows (w,) sway; `windows` (n,), ascending from 0: the window of each sample (n, c) in rad/s, taken at `t_s` (n,)."""
    part = np.clip(SHORT * (t_s / WINDOW_S - np.floor(t_s / WINDOW_S)), 0, SHORT - 1).astype(np.int64)
    flat, total = windows * SHORT + part, int(windows[-1] + 1) * SHORT
    counts = np.bincount(flat, minlength=total)
    sums: Floats = np.column_stack([np.bincount(flat, column, total) for column in values.T])
    with np.errstate(divide="ignore", invalid="ignore"):
        return sways((sums / counts[:, None]).reshape(-1, SHORT, values.shape[1]))


def sways(short: Floats) -> Bools:
    """Whether windows of short means (w, 25, c) in rad/s sway (w,); one with a missing mean does not."""
    long = short.reshape(len(short), GROUPS, SHORT // GROUPS, -1).mean(axis=2)
    slow = long.var(axis=1, ddof=1).sum(axis=1)
    noise = 0.5 * (np.diff(short, axis=1) ** 2).mean(axis=1).sum(axis=1) / (SHORT // GROUPS)
    sway: Bools = (slow > LEAST_RATIO * noise) & (slow > LEAST_RAD_S**2)
    return sway


class Window(NamedTuple):
    """Half a second of one sensor that ends at `end_s`; `moved`: there was motion. `sways`: no motion, but sway for some time."""

    end_s: float
    moved: bool
    sways: bool = False


class MotionWindows:
    """Windows of one sensor: `add` takes samples and returns the windows that they complete. Owns the samples of the unfinished one."""

    def __init__(self, limits: Floats, sway_channels: int = 0) -> None:
        """`limits` (c,): of the range of each channel; the first `sway_channels` ones are gyros, used for the test of sway."""
        self._limits, self._sway_channels = limits, sway_channels
        self._index, self._count = -1, 0  # of the unfinished window, and its samples
        self._samples: list[tuple[Floats, Floats]] = []
        self._swayed: deque[bool] = deque(maxlen=SWAY_WINDOWS)

    def add(self, t_s: Floats, values: Floats) -> list[tuple[int, Window]]:
        """Windows completed by samples `values` (n, c) at `t_s` (n,), each with the index of the sample that does.

        Samples of an earlier window than any before them are skipped.
        """
        index = np.floor(t_s / WINDOW_S).astype(np.int64)
        fresh = np.flatnonzero(index == np.maximum.accumulate(np.maximum(index, self._index)))
        if not len(fresh):
            return []
        before, last = self._count, int(index[fresh[-1]])
        if before < MOST_SAMPLES or last != self._index:
            self._keep(t_s[fresh], values[fresh])
        if last == self._index:
            return []
        t_s, values = (np.concatenate(parts) for parts in zip(*self._samples, strict=True))
        index = np.floor(t_s / WINDOW_S).astype(np.int64)
        begins = np.flatnonzero(np.r_[True, index[1:] != index[:-1]])
        finished = self._finished(t_s, index, values, begins)
        self._samples, self._count, self._index = [], 0, last
        self._keep(t_s[begins[-1] :], values[begins[-1] :])
        return list(zip(fresh[begins[1:] - before].tolist(), finished, strict=True))

    def _keep(self, t_s: Floats, values: Floats) -> None:
        self._samples.append((t_s, values))
        self._count += len(t_s)

    def _finished(self, t_s: Floats, index: Ints, values: Floats, begins: Ints) -> list[Window]:
        """All windows but the last one of samples (n,), whose windows begin at `begins`."""
        span = np.maximum.reduceat(values, begins) - np.minimum.reduceat(values, begins)
        moved = np.any(span > self._limits, axis=1)
        sways = np.zeros(len(begins), np.bool_)
        if self._sway_channels:
            windows = np.repeat(np.arange(len(begins)), np.diff(np.r_[begins, len(index)]))
            sways = swaying(t_s, windows, values[:, : self._sway_channels])
        ends_s = WINDOW_S * (index[begins] + 1.0)
        return [
            self._window(*row) for row in list(zip(ends_s.tolist(), moved.tolist(), sways.tolist(), strict=True))[:-1]
        ]

    def _window(self, end_s: float, moved: bool, sways: bool) -> Window:
        """A finished window: it counts as swaying when most of those before it did so too, up to a movement."""
        self._swayed.append(sways and not moved)
        return Window(end_s, moved, self._swayed[-1] and sum(self._swayed) >= LEAST_SWAYING)


class Stillness:
    """Windows of foot and legs. A sensor counts from its first motion on: one that has never moved is not worn."""

    def __init__(self) -> None:
        self._foot = MotionWindows(np.array([FOOT_RAD_S] * 3 + [FOOT_M_S2] * 3), 3)
        # Sway of thigh and shank: a belt turns with each breath
        self._legs = MotionWindows(np.array([LEG_RAD_S] * 3), 2)
        self._worn: set[MotionWindows] = set()

    def add_foot(self, t_s: Floats, gyro: Floats, accel: Floats) -> list[tuple[int, Window]]:
        """Windows completed by samples of the foot: t_s (n,), gyro (n, 3) rad/s, accel (n, 3) m/s2; each with the sample's index."""
        with np.errstate(over="ignore", invalid="ignore"):  # of numbers that no sensor measures
            return self._of_worn(self._foot, self._foot.add(t_s, np.hstack([gyro, accel])))

    def add_legs(self, block: GyroBlock) -> list[Window]:
        """Windows completed by a block of the leg gyros."""
        windows = self._legs.add(block.t_s, np.column_stack([block.thigh, block.calf, block.belt]))
        return [window for _, window in self._of_worn(self._legs, windows)]

    def _of_worn(self, source: MotionWindows, windows: list[tuple[int, Window]]) -> list[tuple[int, Window]]:
        finished: list[tuple[int, Window]] = []
        for index, window in windows:
            if window.moved:
                self._worn.add(source)
            if source in self._worn:
                finished.append((index, window))
        return finished
