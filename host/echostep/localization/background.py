# SPDX-License-Identifier: MIT
"""The echoes' density if nothing is known of the pose: what a wearer anywhere in the building receives, or what the last echoes foretell.

In: walls, their floor, pings. Out: `Background`: log-density by range; `RangeMemory`: densities of a ping after those before. Owns the views.
A cloud that explains the echoes no better than this is wrong, or the plan is. So it has to be as good as can be done without a plan: a wall that goes
on is foretold as well as by the plan (`last_wall.py`), and only where a view changes does the plan know more.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.jit import kernel
from echostep.localization.echo_likelihood import EchoModel, EchoSettings, echo_density
from echostep.localization.missed_echoes import MissedEchoes
from echostep.localization.view import View
from echostep.walls.echo_sources import MOST_SOURCES, Walls, echo_sources
from echostep.walls.floor import Floor
from echostep.walls.index import WallIndex

VIEW_M = 2.5  # mean length of the path between two changes of a view, by reason: walls, doors, corners
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


class PlacedPings(NamedTuple):
    """Pings (k,): `ranger`; place and axis in the walk frame; `range_m`, 0: no echo; `power`."""

    ranger: Ints
    x_m: Floats
    y_m: Floats
    axis_rad: Floats
    range_m: Floats
    power: Floats


class UnplannedDensities(NamedTuple):
    """Of pings (k,): `missed`, odds that a silent one missed its echo, 0 for an echo; `alike`, the density if like the one before, without those.

    Logs of densities to the pings' power, with them: `anywhere` in the building, `either` that or like the one before.
    """

    missed: Floats
    alike: Floats
    anywhere: Floats
    either: Floats


class RangeMemory:
    """The density of echoes without any plan: the view of the same ranger goes on, or it has changed to any in the building."""

    def __init__(self, background: Background, echo: EchoSettings) -> None:
        self._background, self._echo = background, echo
        self._missed = MissedEchoes()
        self._views = [View(echo), View(echo)]

    def densities(self, pings: PlacedPings) -> UnplannedDensities:
        """For pings (k,) in order of time."""
        log_anywhere = self._background.of(pings.range_m)
        anywhere = np.exp(log_anywhere)
        missed, alike, changed = (np.zeros(len(anywhere)) for _ in range(3))
        for k, which in enumerate(pings.ranger.tolist()):
            view, range_m = self._views[which], float(pings.range_m[k])
            missed[k] = self._missed.odds(which) if range_m <= 0.0 else 0.0
            self._missed.update(which, range_m)
            travel_m = view.move(float(pings.x_m[k]), float(pings.y_m[k]))
            changed[k] = 1.0 - (1.0 - self._echo.outlier) * math.exp(-travel_m / VIEW_M)
            alike[k] = view.density(range_m, float(pings.axis_rad[k]))
            goes_on = (1.0 - changed[k]) * (alike[k] + missed[k]) > changed[k] * anywhere[k]
            view.update(range_m, float(pings.axis_rad[k]), float(pings.power[k]), goes_on)
        either = changed * (anywhere + missed) ** pings.power + (1.0 - changed) * (alike + missed) ** pings.power
        return UnplannedDensities(missed, alike, pings.power * np.log(anywhere + missed), np.log(either))


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
