# SPDX-License-Identifier: MIT
"""The particle filter of [Girard 2011], step by step as printed: profile `girard2011`.

In: the motion vector and heading of each step, one ping of each ranger. Out: the position estimate. Owns its particles; draws from the generator
that it is given. The numbers 1 to 8 are the paper's (section 3.2). Where the paper leaves something open:

- A new particle inherits its parent's weight; step 5 compares these weights. Step 6 then replaces the weight, as printed, from this
  step's pings alone. Without rangers the inherited and merged weights go on to steps 7 and 8, so that the middle of the
  cloud is kept: it stops growing at about 0.4 m, unlike Figure 11. Drawing those that go in step 7 lets it grow, but misses the paper's row
  "with model" (0.33 m instead of 0.45 m; 0.47 m printed).
- Merging goes from the heaviest particle down (of equal ones the older first): each particle that is closer than tau to one already kept gives
  its weight to the heaviest such one. "Closer than tau" is a distance, not a common cell.
- When no particle survives the walls the paper asks the user to start again; here the step is made without walls, and `lost` counts it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.jit import kernel
from echostep.walls.index import WallIndex, build_index, crosses_wall
from echostep_studies.papers.girard2011_rays import lambda_ray_ranges


@dataclass(frozen=True, slots=True)
class GirardSettings:
    """The five parameters [Girard 2011, 3.1, 3.3] and the SRF02's cone and range [2.6, 3.2]."""

    nu: int = 150
    epsilon_m: float = 0.25
    kappa: int = 20
    tau_m: float = 0.05
    rays: int = 7
    aperture_rad: float = math.radians(55.0)
    maximum_m: float = 6.0


class Girard:
    """The cloud of one walk; `walls` (n, 4), or None: without a model, as in the paper's Figure 11."""

    def __init__(
        self, settings: GirardSettings, start_xy: tuple[float, float], walls: Floats | None, rng: np.random.Generator
    ) -> None:
        """Step 1: a single particle at the place that the user states."""
        self.settings = settings
        self.x_m: Floats = np.array([start_xy[0]])
        self.y_m: Floats = np.array([start_xy[1]])
        self.weight: Floats = np.ones(1)
        self.lost = 0
        self._walls = None if walls is None else build_index(walls)
        self._rng = rng

    def step(
        self, dx_m: float, dy_m: float, heading_rad: float, ranges_m: tuple[float, float] | None
    ) -> tuple[float, float]:
        """Steps 2 to 8 for one motion event: the motion vector (map), the user's heading, ranges left and right (nan: no echo) or None."""
        s = self.settings
        vectors = np.array([dx_m, dy_m]) + disc(self._rng, s.kappa, s.epsilon_m)
        x, y, weight = self._propagate(vectors)
        x, y, weight = merge(x, y, weight, s.tau_m)
        if ranges_m is not None:
            weight = self._reweight(x, y, heading_rad, ranges_m)
        heaviest = np.argsort(-weight, kind="stable")[: s.nu]
        self.x_m, self.y_m, self.weight = x[heaviest], y[heaviest], weight[heaviest]
        return average(self.x_m, self.y_m, self.weight)

    def _propagate(self, vectors: Floats) -> tuple[Floats, Floats, Floats]:
        """Step 4: every vector applied to every particle; those that cross a wall are removed."""
        if self._walls is not None:
            x, y, parent = moved(self.x_m, self.y_m, vectors, self._walls)
            if len(x):
                return x, y, self.weight[parent]
            self.lost += 1
        n = len(vectors)
        return (
            np.add.outer(self.x_m, vectors[:, 0]).ravel(),
            np.add.outer(self.y_m, vectors[:, 1]).ravel(),
            np.repeat(self.weight, n) / n,
        )

    def _reweight(self, x: Floats, y: Floats, heading_rad: float, ranges_m: tuple[float, float]) -> Floats:
        """Step 6 for both rangers."""
        s = self.settings
        measured = np.array([s.maximum_m if math.isnan(r) else r for r in ranges_m])
        if self._walls is None:
            return np.ones(len(x))
        heading = np.full(len(x), heading_rad)
        modelled = lambda_ray_ranges(x, y, heading, self._walls, s.rays, s.aperture_rad, s.maximum_m)
        return similarity(modelled, measured, s.maximum_m)


def disc(rng: np.random.Generator, count: int, radius_m: float) -> Floats:
    """Step 3: errors (count, 2), uniform in the disc of this radius [Girard 2011, Figure 6]."""
    angle = rng.uniform(0.0, 2.0 * math.pi, count)
    radius = radius_m * np.sqrt(rng.uniform(0.0, 1.0, count))
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])


def similarity(modelled_m: Floats, measured_m: Floats, maximum_m: float) -> Floats:
    """Weights (n,) of distances in the model (n, rangers) against those measured (rangers,) [Girard 2011, eq. 1]."""
    low = np.minimum(np.minimum(modelled_m, measured_m), maximum_m)
    high = np.minimum(np.maximum(modelled_m, measured_m), maximum_m)
    return np.mean(low / high, axis=1)


def average(x_m: Floats, y_m: Floats, weight: Floats) -> tuple[float, float]:
    """The position estimate: the weighted mean [Girard 2011, eq. 2]."""
    total = weight.sum()
    return float(weight @ x_m / total), float(weight @ y_m / total)


@kernel
def moved(x: Floats, y: Floats, vectors: Floats, walls: WallIndex) -> tuple[Floats, Floats, Ints]:
    """All particles by all vectors (k, 2), but for those that cross a wall: positions and the parent of each."""
    room = len(x) * len(vectors)
    to_x, to_y, parent = np.empty(room), np.empty(room), np.empty(room, np.int64)
    n = 0
    for i in range(len(x)):
        for k in range(len(vectors)):
            qx, qy = x[i] + vectors[k, 0], y[i] + vectors[k, 1]
            if not crosses_wall(x[i], y[i], qx, qy, walls):
                to_x[n], to_y[n], parent[n] = qx, qy, i
                n += 1
    return to_x[:n], to_y[:n], parent[:n]


@kernel
def merge(x: Floats, y: Floats, weight: Floats, tau_m: float) -> tuple[Floats, Floats, Floats]:
    """Step 5: no two particles closer than `tau_m`; the lighter gives its weight away. Particles are sorted by falling weight and stay so."""
    kept_x, kept_y, total, count = np.empty(len(x)), np.empty(len(x)), np.empty(len(x)), 0
    for i in range(len(x)):
        host = 0
        while host < count and (kept_x[host] - x[i]) ** 2 + (kept_y[host] - y[i]) ** 2 >= tau_m * tau_m:
            host += 1
        if host < count:
            total[host] += weight[i]
        else:
            kept_x[count], kept_y[count], total[count] = x[i], y[i], weight[i]
            count += 1
    return kept_x[:count], kept_y[:count], total[:count]
