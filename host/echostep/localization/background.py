# SPDX-License-Identifier: MIT
"""The echoes' density if nothing is known of the pose: what a wearer anywhere in the building receives, or what the last echo foretells.

In: walls, their floor, pings. Out: `Background`: log-density by range; `RangeMemory`: densities of a ping after those before. Owns the last ranges.
A cloud that explains the echoes no better than this is wrong, or the plan is.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.jit import kernel
from echostep.localization.echo_likelihood import EchoModel, echo_density
from echostep.localization.missed_echoes import MissedEchoes
from echostep.walls.echo_sources import MOST_SOURCES, Walls, echo_sources
from echostep.walls.floor import Floor
from echostep.walls.index import WallIndex

ALIKE = 0.5  # share of echoes that are like the one before, by reason
ALIKE_M = 0.07  # mean difference of such, by reason: the error of two ranges, and the sway between them; the plan's error is added
STAYS = 0.9  # probability that such a view still has an echo, or still none, by reason
POSES = 400  # drawn on the floor, by reason: their mean is then good to 5 %
BIN_M = 0.05  # width of a bin of ranges


class Background(NamedTuple):
    """`log_density` (bins + 1,): log of the density (1/m) in each bin of BIN_M; the last entry: log-probability of no echo."""

    log_density: Floats

    def of(self, range_m: Floats) -> Floats:
        """Log-densities of ranges (k,); 0: no echo."""
        last = len(self.log_density) - 1
        k = np.minimum((range_m / BIN_M).astype(np.int64), last - 1)
        return self.log_density[np.where(range_m > 0.0, k, last)]


def background(walls: Walls, floor: Floor, model: EchoModel) -> Background:
    """The mean of the echo density over poses evenly on the floor; of a plan without a floor: even over all ranges."""
    bins = math.ceil(model.maximum_m / BIN_M) + 1
    if not len(floor.x_m):
        return Background(np.full(bins + 1, -math.log(model.maximum_m)))
    rng = np.random.default_rng(0)
    x, y = floor.draw(POSES, rng)
    density = _mean_density(x, y, 2.0 * math.pi * rng.random(POSES), walls.near(x, y), model, bins)
    return Background(np.log(density))


class UnplannedDensities(NamedTuple):
    """Of pings (k,): `missed`, odds that a silent one missed its echo, 0 for an echo; `alike`, the density if like the one before, without those.

    Logs, to the pings' power, with them: `anywhere` in the building, `either`.
    """

    missed: Floats
    alike: Floats
    anywhere: Floats
    either: Floats


class RangeMemory:
    """The density of echoes without any plan: like the last echo of the same ranger, or as anywhere in the building.

    `plan_sd_m`: standard deviation of the plan's walls. A right cloud foretells no echo better than that, though a wall's error stays the same along
    it; a rival that used this would beat it on every wall, so it knows the last echo no better either.
    """

    def __init__(self, background: Background, plan_sd_m: float = 0.0) -> None:
        self._background = background
        self._alike_m = math.hypot(ALIKE_M, plan_sd_m)
        self._missed = MissedEchoes()
        self._last_m = [math.nan, math.nan]  # range of each ranger's last ping; 0: no echo, NaN: no ping yet

    def densities(self, ranger: Ints, range_m: Floats, power: Floats) -> UnplannedDensities:
        """For pings (k,) in order of time; range 0: no echo."""
        log_anywhere = self._background.of(range_m)
        anywhere = np.exp(log_anywhere)
        missed, alike = np.zeros(len(range_m)), np.empty(len(range_m))
        for k, (which, value_m) in enumerate(zip(ranger.tolist(), range_m.tolist(), strict=True)):
            alike[k] = _alike(value_m, self._last_m[which], float(anywhere[k]), self._alike_m)
            if value_m <= 0.0:
                missed[k] = self._missed.odds(which)
            if (
                missed[k] < 1.0 - STAYS
            ):  # otherwise it is likelier that an echo was missed than that the view has changed
                self._last_m[which] = value_m
            self._missed.update(which, value_m)
        either = power * np.log((1.0 - ALIKE) * anywhere + ALIKE * alike + missed)
        return UnplannedDensities(missed, alike, power * np.log(anywhere + missed), either)


def _alike(range_m: float, last_m: float, anywhere: float, alike_m: float) -> float:
    """Density of a range after one that it is like: Laplace about it. After no echo, no echo is likely."""
    if math.isnan(last_m):
        return anywhere
    if range_m <= 0.0 or last_m <= 0.0:
        if last_m > 0.0:
            return 1.0 - STAYS
        return STAYS if range_m <= 0.0 else (1.0 - STAYS) * anywhere
    return STAYS * math.exp(-abs(range_m - last_m) / alike_m) / (2.0 * alike_m)


@kernel
def _mean_density(x: Floats, y: Floats, axis: Floats, walls: WallIndex, model: EchoModel, bins: int) -> Floats:
    """Mean over the poses of the density in the middle of each bin, and of the probability of no echo."""
    distance_m, off_axis_rad, kind = np.empty(MOST_SOURCES), np.empty(MOST_SOURCES), np.empty(MOST_SOURCES)
    mean = np.zeros(bins + 1)
    for i in range(len(x)):
        count = echo_sources(x[i], y[i], axis[i], walls, distance_m, off_axis_rad, kind)
        for k in range(bins):
            mean[k] += echo_density((k + 0.5) * BIN_M, count, distance_m, off_axis_rad, kind, model)
        mean[bins] += echo_density(0.0, count, distance_m, off_axis_rad, kind, model)
    return mean / len(x)
