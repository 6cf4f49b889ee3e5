"""The cloud: where the trunk may be, as weighted particles on the plan.

In: pieces of the trunk's path (walk frame) and echoes. Out: a `Cloud` whose moments are the estimate. Owns the particles; draws from the generator
that it is given. Only this module goes from the walk frame to the map.

A particle is (x, y) in the map, `turn` = rotation walk -> map, and `scale` = true length / measured length. Weights are logarithms.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from echostep.likelihoods import EchoModel, log_echo
from echostep.plan import Pose
from echostep.walls import WallIndex, crosses_wall, reflectors

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class CloudSettings:
    """Size of the cloud, spread at the start, and what the path's own covariance leaves out.

    `step_sd`: of the length of a move, per square root of a metre; `turn_sd_deg`: of the walk frame's rotation, per square root of a
    metre; `resample_below`: effective share of the cloud at which it is resampled (systematic). After a
    move that nobody watched the cloud grows with its area, up to `largest`, until it has gathered again; meanwhile resampling roughens
    it by `rough_m` and `rough_deg`.
    """

    size: int = 1000
    start_sd_m: float = 0.15
    start_turn_sd_deg: float = 5.0
    start_scale_sd: float = 0.02
    step_sd: float = 0.03
    turn_sd_deg: float = 0.3
    resample_below: float = 0.5
    rescue_sd_m: float = 0.5
    largest: int = 20_000
    rough_m: float = 0.1
    rough_deg: float = 2.0

    def __post_init__(self) -> None:
        """Raise ValueError for a cloud without particles."""
        if not 1 <= self.size <= 10_000_000:
            raise ValueError(f"[cloud] size: {self.size} particles make no cloud")


class Cloud:
    """Particles as flat arrays of n; `log_weight` is normalised to a maximum of 0."""

    def __init__(self, settings: CloudSettings, start: Pose, walk_heading_rad: float, rng: np.random.Generator) -> None:
        """`walk_heading_rad`: the trunk's heading in the walk frame while it stands at `start`."""
        n = settings.size
        self._settings = settings
        self._rng = rng
        self.x_m: Floats = start.x_m + settings.start_sd_m * rng.standard_normal(n)
        self.y_m: Floats = start.y_m + settings.start_sd_m * rng.standard_normal(n)
        spread = math.radians(settings.start_turn_sd_deg)
        self.turn_rad: Floats = start.heading_rad - walk_heading_rad + spread * rng.standard_normal(n)
        self.scale: Floats = 1.0 + settings.start_scale_sd * rng.standard_normal(n)
        self.log_weight: Floats = np.zeros(n)
        self.rescues = 0

    def move(self, dx_m: float, dy_m: float, sd_m: float, turn_sd_rad: float, walls: WallIndex) -> None:
        """Propagate by a move in the walk frame; `sd_m` and `turn_sd_rad` come from the path's own covariance.

        Particles that cross a wall die. If all do, the plan or the path is wrong: the cloud moves through, wider.
        """
        length = math.hypot(dx_m, dy_m)
        sd = math.hypot(sd_m, self._settings.step_sd * math.sqrt(length))
        turn_sd = math.hypot(turn_sd_rad, math.radians(self._settings.turn_sd_deg) * math.sqrt(length))
        noise = self._rng.standard_normal((3, len(self.x_m)))
        noise *= np.array([[sd], [sd], [turn_sd]])
        before = self.log_weight.copy()
        died = _propagate(self.x_m, self.y_m, self.turn_rad, self.scale, self.log_weight, dx_m, dy_m, noise, walls)
        if died and not np.isfinite(self.log_weight).any():
            self.log_weight = before
            self.rescues += 1
            self.x_m += self._settings.rescue_sd_m * self._rng.standard_normal(len(self.x_m))
            self.y_m += self._settings.rescue_sd_m * self._rng.standard_normal(len(self.x_m))
        if died:
            self._renew()

    def scatter(self, dx_m: float, dy_m: float, sd_m: float, turn_sd_rad: float) -> None:
        """Spread by a move that nobody watched: he may have gone round any wall, so none can veto it."""
        chosen = systematic(np.exp(self.log_weight), float(self._rng.random()), self._settings.largest)
        noise = self._rng.standard_normal((3, len(chosen)))
        self._take(chosen)
        self.turn_rad += turn_sd_rad * noise[2]
        c, s = np.cos(self.turn_rad), np.sin(self.turn_rad)
        self.x_m += c * dx_m - s * dy_m + sd_m * noise[0]
        self.y_m += s * dx_m + c * dy_m + sd_m * noise[1]

    def _take(self, chosen: Ints) -> None:
        """Keep these particles, with equal weights."""
        self.x_m, self.y_m = self.x_m[chosen], self.y_m[chosen]
        self.turn_rad, self.scale = self.turn_rad[chosen], self.scale[chosen]
        self.log_weight = np.zeros(len(chosen))

    def _wanted(self, weight: Floats) -> int:
        """Size for the cloud's present spread: the usual one up to a metre, then as the area, never more than there are."""
        w = weight / weight.sum()
        spread2 = float(w @ self.x_m**2 - (w @ self.x_m) ** 2 + w @ self.y_m**2 - (w @ self.y_m) ** 2)
        return int(
            min(self._settings.size * max(spread2, 1.0), self._settings.largest, max(len(w), self._settings.size))
        )

    def weigh(
        self, axis_walk_rad: float, range_m: float | None, power: float, model: EchoModel, walls: WallIndex
    ) -> float:
        """Reweight by an echo; `axis_walk_rad`: the ranger's axis in the walk frame, `power`: share of independent information.

        Returns the log of the echo's probability under the cloud before it: how well the plan explains what was heard.
        """
        found = _reweight(
            self.x_m, self.y_m, self.turn_rad, self.log_weight, axis_walk_rad, range_m or 0.0, power, model, walls
        )
        self._renew()
        return found

    def _renew(self) -> None:
        """Systematic resampling [Kitagawa 1996] when too few particles carry the weight."""
        if effective_size(self.log_weight) >= self._settings.resample_below * len(self.x_m):
            return
        weight = np.exp(self.log_weight)
        self._take(systematic(weight, float(self._rng.random()), self._wanted(weight)))
        if len(self.x_m) > self._settings.size:
            # Scattered: between the few that fit there are others that do [Gordon et al. 1993, roughening].
            noise = self._rng.standard_normal((3, len(self.x_m)))
            self.x_m += self._settings.rough_m * noise[0]
            self.y_m += self._settings.rough_m * noise[1]
            self.turn_rad += math.radians(self._settings.rough_deg) * noise[2]


@njit(cache=True, error_model="numpy")
def _propagate(
    x: Floats, y: Floats, turn: Floats, scale: Floats, log_weight: Floats,
    dx: float, dy: float, noise: Floats, walls: WallIndex,
) -> int:  # fmt: skip
    """Move every particle in place; a weight of -inf marks one that went through a wall. Returns how many did."""
    died = 0
    for i in range(len(x)):
        turn[i] += noise[2, i]
        c, s = math.cos(turn[i]), math.sin(turn[i])
        to_x = x[i] + scale[i] * (c * dx - s * dy) + noise[0, i]
        to_y = y[i] + scale[i] * (s * dx + c * dy) + noise[1, i]
        if log_weight[i] > -np.inf and crosses_wall(x[i], y[i], to_x, to_y, walls):
            log_weight[i] = -np.inf
            died += 1
        x[i], y[i] = to_x, to_y
    return died


@njit(cache=True, error_model="numpy")
def _reweight(
    x: Floats, y: Floats, turn: Floats, log_weight: Floats,
    axis: float, range_m: float, power: float, model: EchoModel, walls: WallIndex,
) -> float:  # fmt: skip
    """Add each particle's log-likelihood and bring the greatest weight to 0; returns the log of the mean likelihood before."""
    top = -np.inf
    weight, explained = 0.0, 0.0
    for i in range(len(x)):
        if log_weight[i] == -np.inf:
            continue
        wall_m, off_axis, edge_m = reflectors(x[i], y[i], axis + turn[i], walls)
        log_likelihood = log_echo(range_m, wall_m, off_axis, edge_m, model)
        weight += math.exp(log_weight[i])
        explained += math.exp(log_weight[i] + log_likelihood)
        log_weight[i] += power * log_likelihood
        top = max(top, log_weight[i])
    for i in range(len(x)):
        log_weight[i] -= top
    return math.log(explained / weight)


@njit(cache=True, error_model="numpy")
def effective_size(log_weight: Floats) -> float:
    """Effective number of particles, (sum w)^2 / sum w^2."""
    total, squares = 0.0, 0.0
    for v in log_weight:
        w = math.exp(v)
        total += w
        squares += w * w
    return total * total / squares if squares > 0.0 else 0.0


@njit(cache=True, error_model="numpy")
def systematic(weight: Floats, draw: float, count: int) -> Ints:
    """`count` indices of systematic resampling for weights (n,) and one uniform draw in [0, 1)."""
    step = weight.sum() / count
    chosen = np.empty(count, np.int64)
    reach, k = weight[0], 0
    for i in range(count):
        mark = (i + draw) * step
        while reach < mark and k < len(weight) - 1:
            k += 1
            reach += weight[k]
        chosen[i] = k
    return chosen
