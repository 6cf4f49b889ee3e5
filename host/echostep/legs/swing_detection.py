"""When a leg swings, and which way round its gyros are worn.

In: rates of thigh and shank on a regular grid. Out: middles of swings, heel strikes, toe offs, signs, whether the leg stands. Owns the signs.

In a swing the shank turns forward, fast and briefly; in stance it turns back, slowly [Aminian 2002; Salarian 2004]. The thigh's angle goes with the
shank's, and its forward turns come before the shank's; its backward turns, when the whole leg is stiff, come at about the same time. Walking
backward is walking forward in reversed time: then the shank leads, in either sign.
"""

from __future__ import annotations

import math
from collections import deque
from statistics import median

import numpy as np

from echostep.arrays import Floats

GRID_HZ = 100.0
SMOOTH = 7  # places of the running mean under which swings are looked for
LEAST_PEAK_RAD_S = 1.0
OF_USUAL = 0.3  # of the median peak so far: the last step may be half a one
SHORTEST_CYCLE = int(0.55 * GRID_HZ)
LONGEST_CYCLE = int(2.6 * GRID_HZ)
DECIDE_S = 2.2  # of motion
MOVING_RAD_S = 0.35
CLEAR = 0.12  # of the score that tells the sign
OF_SKEW = 0.3  # in it, beside how the leads of forward and of backward turns differ
OF_LEAD = 0.25
BACKWARD = -0.1  # of the thigh's lead
LAGS = range(5, 26, 5)  # places by which the thigh may lead
NEAR, SPENT = 0.2, 0.05  # of the way from mid swing, of the rate there
LATEST_STRIKE_S = 0.45
STILL = int(0.35 * GRID_HZ)
STILL_RANGE_RAD_S = 0.16
STILL_MEAN_RAD_S = 0.2  # the bias of a poor gyro


class Swings:
    """`sign` of thigh and shank, 0 until known, and the usual peak of the shank's rate."""

    def __init__(self) -> None:
        self.sign = (0.0, 0.0)
        self._peaks: deque[float] = deque(maxlen=9)
        self.usual_rad_s = 0.0

    @property
    def known(self) -> bool:
        """Whether the signs are."""
        return self.sign[1] != 0.0

    def decide(self, rates: Floats, *, final: bool) -> bool:
        """Find the signs from all rates (n, 2) so far, when they say enough; `final`: there will be no more."""
        if len(rates) < SHORTEST_CYCLE:
            return False
        moving = np.abs(rates[:, 1]) > MOVING_RAD_S
        if not final and moving.sum() < DECIDE_S * GRID_HZ:
            return False
        rates = rates - np.median(rates[~moving], axis=0) if (~moving).sum() > STILL else rates
        pair = together(rates) + OF_LEAD * leads(rates)  # hardly anybody walks backward
        if abs(pair) < CLEAR and not final:
            return False
        thigh = 1.0 if pair >= 0.0 else -1.0
        rates = rates * np.array([thigh, 1.0])
        ahead = leads(rates)
        skew = lopsided(rates[:, 0]) + lopsided(rates[:, 1])
        score = leads(np.clip(rates, 0.0, None)) - leads(np.clip(-rates, 0.0, None))
        score += OF_SKEW * (skew if ahead > BACKWARD else -skew)
        if abs(score) < CLEAR and not final:
            return False
        shank = 1.0 if score >= 0.0 else -1.0
        self.sign = (thigh * shank, shank)
        return True

    def saw(self, peak_rad_s: float) -> None:
        """There was a swing."""
        self._peaks.append(peak_rad_s)
        self.usual_rad_s = median(self._peaks)

    def threshold(self) -> float:
        """What a peak of the shank's rate must reach."""
        return max(LEAST_PEAK_RAD_S, OF_USUAL * self.usual_rad_s)


def lopsided(rate: Floats) -> float:
    """From -1 to 1: whether the fast turns go forward."""
    cubes = rate**3
    size = float(np.abs(cubes).sum())
    return float(cubes.sum()) / size if size > 0.0 else 0.0


def together(rates: Floats) -> float:
    """Correlation of both angles within a second or so: the slow way of biases is left out."""
    angles = np.cumsum(rates, axis=0) / GRID_HZ
    width = int(1.2 * GRID_HZ)
    if len(angles) > 2 * width:
        total = np.vstack([np.zeros((1, 2)), np.cumsum(angles, axis=0)])
        mean = (total[width:] - total[:-width]) / width
        angles = angles[width // 2 : width // 2 + len(mean)] - mean
    else:
        angles = angles - angles.mean(axis=0)
    size = math.sqrt(float((angles[:, 0] ** 2).sum() * (angles[:, 1] ** 2).sum()))
    return float((angles[:, 0] * angles[:, 1]).sum()) / size if size > 0.0 else 0.0


def leads(rates: Floats) -> float:
    """From about -1 to 1: positive when the thigh does first what the shank does after it."""
    thigh, shank = rates.T
    size = math.sqrt(float((thigh**2).sum() * (shank**2).sum()))
    found = sum(float((thigh[:-lag] * shank[lag:]).sum() - (shank[:-lag] * thigh[lag:]).sum()) for lag in LAGS)
    return found / (len(LAGS) * size) if size > 0.0 else 0.0


def is_still(rates: Floats) -> bool:
    """Whether a leg stands over these places (n, 2)."""
    calm = bool((np.ptp(rates, axis=0) < STILL_RANGE_RAD_S).all())
    return calm and bool((np.abs(rates.mean(axis=0)) < STILL_MEAN_RAD_S).all())


def strike_after(shank: Floats) -> int:
    """Heel strike after the middle of a swing, from which on these angles are: the shank has all but stopped, near its foremost angle."""
    swing = shank[: int(LATEST_STRIKE_S * GRID_HZ)]
    foremost = float(swing.max())
    near = swing >= foremost - NEAR * (foremost - shank[0])
    rate = np.diff(smooth(swing), append=swing[-1])
    stops = near & (rate <= SPENT * max(float(rate[:SMOOTH].max()), 1e-9))
    return int(np.argmax(stops)) if stops.any() else int(np.argmax(swing))


def toe_off_before(shank: Floats, peak: int, begin: int) -> int:
    """Toe off: where the shank turns back fastest before the swing."""
    first = max(begin, peak - int(0.55 * GRID_HZ))
    return first + int(np.argmin(shank[first : peak + 1]))


def smooth(rate: Floats) -> Floats:
    """Running mean, ends held."""
    padded = np.pad(rate, SMOOTH // 2, mode="edge")
    total = np.concatenate([[0.0], np.cumsum(padded)])
    found: Floats = (total[SMOOTH:] - total[:-SMOOTH]) / SMOOTH
    return found
