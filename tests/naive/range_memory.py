# SPDX-License-Identifier: MIT
"""What the last echoes tell of the next ones without a plan, by matrices and one object a ranger: slow twin of `echoes.range_memory`."""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Floats
from echostep.echoes import range_memory as memory
from echostep.echoes.likelihood import STRAY_ON, EchoModel, detection
from echostep.elementary import wrap
from echostep.walls.tile_points import WALL


class Ranger:
    """`state`: distance and normal of the wall that answered last, None for none; `P`: their covariance."""

    def __init__(self, model: EchoModel) -> None:
        self.model = model
        self.state: Floats | None = None
        self.P = np.zeros((2, 2))
        self.pose: Floats | None = None
        self.missed, self.heard = memory.PRIOR_MISSED, memory.PRIOR_HEARD
        self.last_m, self.silent = math.nan, 0

    def count(self, range_m: float) -> None:
        """Count a ping."""
        if range_m == 0.0:
            self.silent += 1
            return
        if range_m < memory.SURE_M and abs(range_m - self.last_m) < memory.LIKE_M and self.silent <= memory.MOST_SILENT:
            self.missed, self.heard = self.missed + self.silent, self.heard + 1.0
            shrink = max(1.0, (self.missed + self.heard) / memory.REMEMBERED)
            self.missed, self.heard = self.missed / shrink, self.heard / shrink
        self.last_m, self.silent = range_m, 0

    def share_alike(self, pose: Floats) -> float:
        """Move to the next ping; the probability that its view is that of the last one."""
        if self.pose is None:
            self.pose = pose
            return 0.0
        way, turn = pose[:2] - self.pose[:2], abs(wrap(pose[2] - self.pose[2]))
        self.pose, length = pose, float(np.linalg.norm(way))
        if self.state is not None:
            n = np.array([math.cos(self.state[1]), math.sin(self.state[1])])
            jacobian = np.array([[1.0, n[1] * way[0] - n[0] * way[1]], [0.0, 1.0]])
            self.state = self.state - np.array([n @ way, 0.0])
            self.P = jacobian @ self.P @ jacobian.T + np.diag([0.0, memory.TURN_SD_RAD**2 * length])
        return math.exp(-length / memory.VIEW_M - turn / memory.VIEW_RAD)

    def density(self, range_m: float, stray: float, blur_m: float) -> float:
        """Of a range if the view goes on; of 0, the probability of no echo."""
        m = self.model
        if self.state is None:
            return stray / (m.maximum_m - m.minimum_m) if range_m else 1.0 - stray
        if range_m == 0.0:
            return 0.0
        variance = self.P[0, 0] + self.error_m() ** 2 + blur_m**2
        square = (range_m - self.state[0]) ** 2 / variance
        heard = float(detection(float(self.state[0]), self.slant_rad(), WALL, m))
        return heard * math.exp(-0.5 * square) / math.sqrt(2.0 * math.pi * variance)

    def update(self, range_m: float, power: float, goes_on: bool) -> None:
        """Correct, begin or forget the wall."""
        assert self.pose is not None
        if range_m == 0.0:
            self.state = self.state if goes_on else None
        elif goes_on and self.state is not None:
            gain = self.P[:, 0] / (self.P[0, 0] + self.error_m() ** 2 / power)
            self.state = self.state + gain * (range_m - self.state[0])
            self.P = self.P - np.outer(gain, self.P[0])
        else:
            self.state = np.array([range_m, self.pose[2]])
            self.P = np.diag([self.model.sd_m**2, memory.AXIS_SD_RAD**2])

    def slant_rad(self) -> float:
        """Angle of the normal off the axis."""
        assert self.state is not None
        assert self.pose is not None
        return abs(wrap(float(self.state[1] - self.pose[2])))

    def error_m(self) -> float:
        """Standard deviation of a range."""
        return self.model.sd_m + self.model.slant_m * self.slant_rad()


def densities(pings: memory.PlacedPings, log_anywhere: Floats, blur_m: float, m: EchoModel) -> Floats:
    """Rows STRAY to LOG_BLURRED of pings (k,)."""
    rangers, rows = (Ranger(m), Ranger(m)), []
    for which, x, y, axis, range_m, power, log in zip(*(a.tolist() for a in (*pings, log_anywhere)), strict=True):
        r, anywhere = rangers[which], math.exp(log)
        stray = m.stray * (STRAY_ON if r.state is None else 1.0)
        odds = 0.0 if range_m else r.missed / r.heard
        r.count(range_m)
        same = (1.0 - m.outlier) * r.share_alike(np.array([x, y, axis]))
        sharp, blurred = (r.density(range_m, stray, blur) for blur in (0.0, blur_m))
        r.update(range_m, power, same * (sharp + odds) > (1.0 - same) * anywhere)
        either, wide = (
            (1.0 - same) * (anywhere + odds) ** power + same * (d + odds) ** power for d in (sharp, blurred)
        )
        rows.append((stray, odds, sharp, either, math.log(either), math.log(wide)))
    return np.array(rows).T
