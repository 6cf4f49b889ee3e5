# SPDX-License-Identifier: MIT
"""Detection of swings, heel strikes, toe offs and standing, and of the signs of the gyros of thigh and shank.

In: rates of thigh and shank on a regular grid. Out: indices of events, signs, whether the leg stands. Owns the signs and the usual peak rate.

In a swing the shank turns forward, fast and briefly; in stance it turns back, slowly [Aminian 2002; Salarian 2004]. The angles of thigh and shank
are correlated. The thigh's forward turns come before the shank's; its backward turns, with a stiff leg, come at about the same time.
Walking backward is walking forward in reversed time: then the shank leads, with either sign.
"""

from __future__ import annotations

import math
from collections import deque
from statistics import median

import numpy as np

from echostep.arrays import Floats

# The source of these values is not recorded. Durations without a unit are numbers of grid samples.
GRID_HZ = 100.0
SMOOTH = 7  # length of the running mean
LEAST_PEAK_RAD_S = 1.0  # of a swing
PEAK_SHARE = 0.3  # least peak of a swing over the median peak so far: the last step may be half a stride
PEAKS = 9  # swings whose median peak counts
SHORTEST_CYCLE = int(0.55 * GRID_HZ)  # of a stride
LONGEST_CYCLE = int(2.6 * GRID_HZ)
DECIDE_S = 2.2  # motion after which the signs are decided
MOVING_RAD_S = 0.35  # rate of a moving shank
CLEAR_SCORE = 0.12  # least score that decides a sign
SKEW_WEIGHT = 0.3  # of the skewness of the rates in the shank's score
LEAD_WEIGHT = 0.25  # of the thigh's lead in the score of the relative sign
BACKWARD_LEAD = -0.1  # lead of the thigh below which the walk goes backward
LAGS = range(5, 26, 5)  # of the shank behind the thigh
TREND_S = 1.2  # running mean subtracted from the angles
HALF_SWING = int(0.3 * GRID_HZ)  # longest time before the peak of a swing: a swing takes 0.4 s
TOP_SHARE = 0.5  # of the peak: above it the rate belongs to the top of a swing, assumed
FOREMOST_SHARE = 0.2  # the shank is near its foremost angle within this share of its turn since mid swing
STOPPED_SHARE = 0.05  # rate of a shank that has stopped, over the rate at mid swing
LATEST_STRIKE_S = 0.45  # after mid swing
EARLIEST_TOE_OFF_S = 0.55  # before mid swing
STILL = int(0.35 * GRID_HZ)  # duration of standing
STILL_RANGE_RAD_S = 0.16  # largest range of the rates over it
STILL_MEAN_RAD_S = 0.2  # largest mean rate over it: the bias of a poor gyro


class Swings:
    """`sign` of the gyros of thigh and shank, 0 until known; `usual_rad_s`: median peak of the shank's rate."""

    def __init__(self, sign: tuple[float, float] | None = None) -> None:
        self.sign = sign or (0.0, 0.0)
        self._peaks: deque[float] = deque(maxlen=PEAKS)
        self.usual_rad_s = 0.0

    @property
    def known(self) -> bool:
        """Whether the signs are known."""
        return self.sign[1] != 0.0

    def decide(self, rates: Floats, *, final: bool) -> bool:
        """Decide the signs from all rates (n, 2) so far, if they are clear; `final`: no more will come, decide in any case.

        1. Relative sign: the angles of thigh and shank are correlated, and the thigh leads, as walking backward is rare.
        2. Common sign: forward turns lead more than backward turns, and fast turns are forward (backward in a walk backward).
        """
        if len(rates) < SHORTEST_CYCLE:
            return False
        moving = np.abs(rates[:, 1]) > MOVING_RAD_S
        if not final and moving.sum() < DECIDE_S * GRID_HZ:
            return False
        rates = rates - np.median(rates[~moving], axis=0) if (~moving).sum() > STILL else rates
        pair = angle_correlation(rates) + LEAD_WEIGHT * thigh_lead(rates)
        if abs(pair) < CLEAR_SCORE and not final:
            return False
        thigh = 1.0 if pair >= 0.0 else -1.0
        rates = rates * np.array([thigh, 1.0])
        lead = thigh_lead(rates)
        skew = rate_skewness(rates[:, 0]) + rate_skewness(rates[:, 1])
        score = thigh_lead(np.clip(rates, 0.0, None)) - thigh_lead(np.clip(-rates, 0.0, None))
        score += SKEW_WEIGHT * (skew if lead > BACKWARD_LEAD else -skew)
        if abs(score) < CLEAR_SCORE and not final:
            return False
        shank = 1.0 if score >= 0.0 else -1.0
        self.sign = (thigh * shank, shank)
        return True

    def add_peak(self, peak_rad_s: float) -> None:
        """Add the peak of a swing to the usual one."""
        self._peaks.append(peak_rad_s)
        self.usual_rad_s = median(self._peaks)

    def threshold(self) -> float:
        """Least peak (rad/s) of the shank's rate in a swing."""
        return max(LEAST_PEAK_RAD_S, PEAK_SHARE * self.usual_rad_s)


def rate_skewness(rate: Floats) -> float:
    """Skewness of the rates (n,), from -1 to 1: positive when fast turns go forward."""
    cubes = rate * rate * rate
    size = float(np.abs(cubes).sum())
    return float(cubes.sum()) / size if size > 0.0 else 0.0


def angle_correlation(rates: Floats) -> float:
    """Correlation of both angles about their running mean, which removes the drift from the gyros' biases; rates (n, 2)."""
    angles = np.cumsum(rates, axis=0) / GRID_HZ
    width = int(TREND_S * GRID_HZ)
    if len(angles) > 2 * width:
        total = np.vstack([np.zeros((1, 2)), np.cumsum(angles, axis=0)])
        mean = (total[width:] - total[:-width]) / width
        angles = angles[width // 2 : width // 2 + len(mean)] - mean
    else:
        angles = angles - angles.mean(axis=0)
    size = math.sqrt(float((angles[:, 0] ** 2).sum() * (angles[:, 1] ** 2).sum()))
    return float((angles[:, 0] * angles[:, 1]).sum()) / size if size > 0.0 else 0.0


def thigh_lead(rates: Floats) -> float:
    """Antisymmetric part of the cross-correlation of rates (n, 2), from about -1 to 1: positive when the thigh moves before the shank."""
    thigh, shank = rates.T
    size = math.sqrt(float((thigh**2).sum() * (shank**2).sum()))
    lead = sum(float((thigh[:-lag] * shank[lag:]).sum() - (shank[:-lag] * thigh[lag:]).sum()) for lag in LAGS)
    return lead / (len(LAGS) * size) if size > 0.0 else 0.0


def is_still(rates: Floats) -> bool:
    """Whether a leg stands during these rates (n, 2)."""
    calm = bool((np.ptp(rates, axis=0) < STILL_RANGE_RAD_S).all())
    return calm and bool((np.abs(rates.mean(axis=0)) < STILL_MEAN_RAD_S).all())


def mid_swing_index(shank: Floats, peak: int) -> int:
    """Index of mid swing in the shank's rates (n,) about a peak: the centroid of the rate above TOP_SHARE of the peak's.

    The peak itself jumps: a swing often has two tops, 0.06 s apart, and either can be the higher one.
    """
    rate = smooth(shank)
    above = rate - TOP_SHARE * rate[min(peak, len(rate) - 1)]
    low = np.flatnonzero(above <= 0.0)
    before, after = low[low < peak], low[low > peak]
    begin = int(before[-1]) + 1 if len(before) else 0
    weight = np.clip(above[begin : int(after[0]) if len(after) else None], 0.0, None)
    total = float(weight.sum())
    return begin + round(float((weight * np.arange(len(weight))).sum()) / total) if total > 0.0 else peak


def heel_strike_index(shank: Floats) -> int:
    """Index of the heel strike in the shank's angles (n,) from mid swing on: the shank has nearly stopped, near its foremost angle."""
    swing = shank[: int(LATEST_STRIKE_S * GRID_HZ)]
    foremost = float(swing.max())
    near = swing >= foremost - FOREMOST_SHARE * (foremost - shank[0])
    rate = np.diff(smooth(swing), append=swing[-1])
    stops = near & (rate <= STOPPED_SHARE * max(float(rate[:SMOOTH].max()), 1e-9))
    return int(np.argmax(stops)) if stops.any() else int(np.argmax(swing))


def toe_off_index(shank: Floats, peak: int, begin: int) -> int:
    """Index of toe off in the shank's rates: its fastest turn back before the mid swing at `peak`."""
    first = max(begin, peak - int(EARLIEST_TOE_OFF_S * GRID_HZ))
    return first + int(np.argmin(shank[first : peak + 1]))


def smooth(rate: Floats) -> Floats:
    """Running mean of rates (n,), with the end values repeated beyond the ends."""
    padded = np.pad(rate, SMOOTH // 2, mode="edge")
    total = np.concatenate([[0.0], np.cumsum(padded)])
    return (total[SMOOTH:] - total[:-SMOOTH]) / SMOOTH
