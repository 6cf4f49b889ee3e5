"""The cloud: where the trunk may be, as weighted particles on the plan.

In: straight pieces of the trunk's path (walk frame) with the pings heard on them. Out: a `Cloud` whose moments are the estimate. Owns the particles;
draws from the generator that it is given. Only this module goes from the walk frame to the map.

A particle is (x, y) on the building's sheet, `turn` = rotation walk -> map, `scale` = true length / measured length; in a building of several levels
also its height `z` and what the pressure's height is off by, `lag`. Weights are logarithms.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.jit import kernel, lean_kernel
from echostep.localization.beacon_slam import Beliefs, no_beliefs
from echostep.localization.echo_likelihood import EchoModel, echo_density
from echostep.localization.level_changes import ClimbSettings, HeightChange, carry, climb, climb_model
from echostep.plan.model import Pose
from echostep.walls.echo_sources import MOST_SOURCES, Walls, echo_sources
from echostep.walls.index import WallIndex, crosses_wall
from echostep.walls.level_sheet import LevelSheet, level_of


@dataclass(frozen=True, slots=True)
class CloudSettings:
    """Size of the cloud, spread at the start, and what the path's own covariance leaves out.

    `step_sd`: of the length of a move, per square root of a metre; `turn_sd_deg`, `scale_sd`: drift of the walk frame's rotation and of the lengths,
    likewise. `resample_below`: effective share of the cloud at which it is resampled (systematic). The size follows the spread [Fox 2003,
    KLD-sampling]: so many particles that the distribution over cells of `cell_m`, `cell_m`, `cell_deg` is met within `kld`, at least `size`, at
    most `largest`. A cloud that has been scattered is roughened by `rough_m` and `rough_deg` until it has gathered again. `wall_cost`: log-weight
    that going through a wall costs.
    """

    size: int = 220
    largest: int = 20_000
    kld: float = 0.15
    cell_m: float = 0.1
    cell_deg: float = 5.0
    start_sd_m: float = 0.15
    start_turn_sd_deg: float = 5.0
    start_scale_sd: float = 0.02
    step_sd: float = 0.03
    turn_sd_deg: float = 0.3
    scale_sd: float = 0.002
    resample_below: float = 0.5
    wall_cost: float = 40.0
    rescue_sd_m: float = 0.5
    rough_m: float = 0.1
    rough_deg: float = 2.0

    def __post_init__(self) -> None:
        """Raise ValueError for a cloud without particles."""
        if not 1 <= self.size <= 10_000_000:
            raise ValueError(f"[cloud] size: {self.size} particles make no cloud")
        for name in ("kld", "cell_m", "cell_deg"):
            if getattr(self, name) <= 0.0:
                raise ValueError(f"[cloud] {name}: must be greater than 0")


class Move(NamedTuple):
    """A straight piece of the path in the walk frame, and the standard deviations that it adds: per axis, of the rotation, of the scale."""

    dx_m: float
    dy_m: float
    sd_m: float
    turn_sd_rad: float
    scale_sd: float = 0.0


class PingBatch(NamedTuple):
    """k pings on a move: share of the move at the trigger (ascending), axis of the ranger in the walk frame, range (0: none), power.

    `power`: share of independent information in the ping, its log-likelihood counts with it.
    """

    share: Floats
    axis_rad: Floats
    range_m: Floats
    power: Floats


ANY_LEVEL = -1  # of a start: nobody knows
UNKNOWN_LAG_M2 = 1e6  # nobody knows the weather, either
NOTHING = PingBatch(*(np.zeros(0) for _ in range(4)))


class Cloud:
    """Particles as flat arrays of n; `log_weight` is normalised to a maximum of 0."""

    def __init__(
        self, settings: CloudSettings, start: Pose, walk_heading_rad: float, rng: np.random.Generator,
        storeys: LevelSheet | None = None, climbing: ClimbSettings | None = None,
    ) -> None:  # fmt: skip
        """`walk_heading_rad`: the trunk's heading in the walk frame while it stands at `start`; without `storeys` there is one level."""
        self.storeys = storeys if storeys is not None and len(storeys.height_m) > 1 else None
        self._climbing = climbing or ClimbSettings()
        self._climb = climb_model(self._climbing)
        self._lag_variance = UNKNOWN_LAG_M2
        n = settings.size
        self._settings = settings
        self._rng = rng
        self.x_m: Floats = start.x_m + settings.start_sd_m * rng.standard_normal(n)
        self.y_m: Floats = start.y_m + settings.start_sd_m * rng.standard_normal(n)
        spread = math.radians(settings.start_turn_sd_deg)
        self.turn_rad: Floats = start.heading_rad - walk_heading_rad + spread * rng.standard_normal(n)
        self.scale: Floats = 1.0 + settings.start_scale_sd * rng.standard_normal(n)
        self.z_m: Floats = np.zeros(n)
        self.lag_m: Floats = np.zeros(n)
        self.log_weight: Floats = np.zeros(n)
        self.beliefs = no_beliefs(n, 0)
        if self.storeys:
            levels = len(self.storeys.height_m)
            level = np.arange(n) % levels if start.level == ANY_LEVEL else np.full(n, start.level)
            self.x_m += level * self.storeys.pitch_m
            self.z_m = self.storeys.height_m[level]
        self.rescues = 0
        self._least = n

    @property
    def level(self) -> Ints:
        """Level of each particle (n,), an index into the plan's."""
        return level_of(self.x_m, self.storeys) if self.storeys else np.zeros(len(self.x_m), np.int64)

    @property
    def map_x_m(self) -> Floats:
        """East of each particle in the map (n,), whichever its level."""
        return self.x_m - self.level * self.storeys.pitch_m if self.storeys else self.x_m

    @property
    def pitch_m(self) -> float:
        """How far east of the level below it each level lies on the sheet."""
        return self.storeys.pitch_m if self.storeys else 0.0

    def level_at(self, x_m: float) -> int:
        """Level of a place on the sheet."""
        return int(level_of(np.array([x_m]), self.storeys)[0]) if self.storeys else 0

    def climb(self, move: Move, rise: HeightChange) -> None:
        """Heights and levels after a move, and what they say of each particle."""
        if self.storeys is None:
            return
        if math.isfinite(rise.height_sd_m):
            self._lag_variance += self._climbing.drift_m**2 * rise.span_s
        noise = self._rng.standard_normal(len(self.x_m))
        self._lag_variance = climb(
            self.x_m, self.y_m, self.turn_rad, self.scale, self.z_m, self.lag_m, self.log_weight,
            move.dx_m, move.dy_m, noise, rise, self._lag_variance, self._climb, self.storeys,
        )  # fmt: skip
        self.renew()

    def puzzle(self, times: float) -> None:
        """Keep at least so many times the usual number of particles from the next resampling on."""
        self._least = int(times * self._settings.size)

    def follow(self, move: Move, heard: PingBatch, model: EchoModel, walls: Walls) -> Floats:
        """Propagate by a move and reweight by each ping on it, where it was triggered; resample whenever too few particles carry the weight.

        Particles that cross a wall lose their weight. If all do, the plan or the path is wrong: the cloud goes on behind the wall, wider. Returns
        for each ping the log of its probability under the cloud before it: how well the plan explains what was heard.
        """
        explained = np.zeros(len(heard.share))
        done, k, settings = 0.0, 0, self._settings
        while done < 1.0 or k < len(explained):
            noise = self._noise(move, 1.0 - done)
            index = walls.near(self.x_m, self.y_m, (1.0 - done) * math.hypot(move.dx_m, move.dy_m))
            k, done, top = _follow(
                self.x_m, self.y_m, self.turn_rad, self.scale, self.log_weight, move.dx_m, move.dy_m, noise, done, k,
                heard, settings.resample_below, settings.wall_cost, model, index, explained,
            )  # fmt: skip
            if top < -0.5 * settings.wall_cost:
                self._widen()
            self.renew()
        return explained

    def _noise(self, move: Move, share: float) -> Floats:
        """What the rest of a move adds to x, y, turn and scale of each particle, (4, n)."""
        s, length = self._settings, math.hypot(move.dx_m, move.dy_m)
        sd = math.hypot(move.sd_m, s.step_sd * math.sqrt(length))
        turn_sd = math.hypot(move.turn_sd_rad, math.radians(s.turn_sd_deg) * math.sqrt(length))
        noise = self._rng.standard_normal((4, len(self.x_m)))
        scale_sd = math.hypot(move.scale_sd, s.scale_sd * math.sqrt(length))
        noise *= np.array([[sd], [sd], [turn_sd], [scale_sd]]) * math.sqrt(share)
        return noise

    def _widen(self) -> None:
        """Every particle went through a wall."""
        self.rescues += 1
        self.x_m += self._settings.rescue_sd_m * self._rng.standard_normal(len(self.x_m))
        self.y_m += self._settings.rescue_sd_m * self._rng.standard_normal(len(self.x_m))

    def scatter(self, move: Move, rise: HeightChange | None = None) -> None:
        """Spread by a move that nobody watched: he may have gone round any wall, so none can veto it, and up or down as the pressure says."""
        self._take(systematic(np.exp(self.log_weight), float(self._rng.random()), self._settings.largest))
        noise = self._rng.standard_normal((3, len(self.x_m)))
        self.turn_rad += move.turn_sd_rad * noise[2]
        c, s = np.cos(self.turn_rad), np.sin(self.turn_rad)
        self.x_m += c * move.dx_m - s * move.dy_m + move.sd_m * noise[0]
        self.y_m += s * move.dx_m + c * move.dy_m + move.sd_m * noise[1]
        if self.storeys and rise and math.isfinite(rise.height_sd_m):
            carry(self.x_m, self.z_m, self.lag_m, rise.height_m, self.storeys)

    def _take(self, chosen: Ints) -> None:
        """Keep these particles, with equal weights."""
        self.x_m, self.y_m = self.x_m[chosen], self.y_m[chosen]
        self.turn_rad, self.scale = self.turn_rad[chosen], self.scale[chosen]
        self.z_m, self.lag_m = self.z_m[chosen], self.lag_m[chosen]
        self.beliefs = Beliefs(*(part[chosen] for part in self.beliefs))
        self.log_weight = np.zeros(len(chosen))

    def renew(self) -> None:
        """Systematic resampling [Kitagawa 1996] when too few particles carry the weight."""
        if effective_size(self.log_weight) >= self._settings.resample_below * len(self.x_m):
            return
        chosen = systematic(np.exp(self.log_weight), float(self._rng.random()), len(self.x_m))
        self._take(chosen)
        count = self._wanted()
        if count != len(self.x_m):
            self._take(systematic(np.ones(len(self.x_m)), float(self._rng.random()), count))
        if count > ROUGHENED * self._settings.size:
            # Scattered: between the few that fit there are others that do [Gordon et al. 1993, roughening].
            noise = self._rng.standard_normal((3, len(self.x_m)))
            self.x_m += self._settings.rough_m * noise[0]
            self.y_m += self._settings.rough_m * noise[1]
            self.turn_rad += math.radians(self._settings.rough_deg) * noise[2]

    def _wanted(self) -> int:
        """Size for the present spread, from the number of cells that hold particles [Fox 2003, eq. 7 with z of 99 %]."""
        s = self._settings
        cells = np.floor(self.x_m / s.cell_m)
        cells += 1e6 * np.floor(self.y_m / s.cell_m)
        cells += 1e12 * np.floor(self.turn_rad / math.radians(s.cell_deg))
        cells.sort()
        k = np.count_nonzero(cells[1:] != cells[:-1])
        if k < 1:
            return self._least
        part = 2.0 / (9.0 * k)
        wanted = k / (2.0 * s.kld) * (1.0 - part + math.sqrt(part) * 2.33) ** 3
        return int(min(max(wanted, self._least), s.largest))


NEGLIGIBLE = 1e-9  # particles of less weight go with the next resampling: not worth a look
ROUGHENED = 10  # a cloud of so many times the usual size has been scattered


@kernel
def _follow(
    x: Floats, y: Floats, turn: Floats, scale: Floats, log_weight: Floats,
    dx: float, dy: float, noise: Floats, done: float, k: int, heard: PingBatch, resample_below: float, wall_cost: float,
    model: EchoModel, walls: WallIndex, explained: Floats,
) -> tuple[int, float, float]:  # fmt: skip
    """Go on from share `done` and ping `k` until the cloud needs to be resampled or the move is over.

    Returns both anew, and the least of the log-weights that the best particle had left after a piece of the way.
    """
    rest, least = 1.0 - done, 0.0
    while done < 1.0 or k < len(heard.share):
        until = max(heard.share[k], done) if k < len(heard.share) else 1.0
        if until > done:
            part = until - done
            top = _propagate(x, y, turn, scale, log_weight, part * dx, part * dy, part / rest, noise, wall_cost, walls)
            least = min(least, top)
            done = until
        if k < len(heard.share):
            explained[k], size = _reweight(
                x, y, turn, log_weight, heard.axis_rad[k], heard.range_m[k], heard.power[k], model, walls
            )
            k += 1
        else:
            size = effective_size(log_weight)
        if size < resample_below * len(x):
            break
    return k, done, least


@lean_kernel
def _propagate(
    x: Floats, y: Floats, turn: Floats, scale: Floats, log_weight: Floats,
    dx: float, dy: float, share: float, noise: Floats, wall_cost: float, walls: WallIndex,
) -> float:  # fmt: skip
    """Move every particle in place, with this share of its noise; returns the greatest log-weight and makes it 0 again."""
    top = -np.inf
    for i in range(len(x)):
        turn[i] += share * noise[2, i]
        scale[i] += share * noise[3, i]
        c, s = math.cos(turn[i]), math.sin(turn[i])
        to_x = x[i] + scale[i] * (c * dx - s * dy) + share * noise[0, i]
        to_y = y[i] + scale[i] * (s * dx + c * dy) + share * noise[1, i]
        if crosses_wall(x[i], y[i], to_x, to_y, walls):
            log_weight[i] -= wall_cost
        top = max(top, log_weight[i])
        x[i], y[i] = to_x, to_y
    if top != 0.0:
        for i in range(len(x)):
            log_weight[i] -= top
    return top


@kernel
def _reweight(
    x: Floats, y: Floats, turn: Floats, log_weight: Floats,
    axis: float, range_m: float, power: float, model: EchoModel, walls: WallIndex,
) -> tuple[float, float]:  # fmt: skip
    """Add each particle's log-likelihood and bring the greatest weight to 0.

    Returns the log of the mean likelihood before, and the effective size after.
    """
    distance_m, off_axis_rad, kind = np.empty(MOST_SOURCES), np.empty(MOST_SOURCES), np.empty(MOST_SOURCES)
    top = -np.inf
    weight, explained, total, squares = 0.0, 0.0, 0.0, 0.0
    for i in range(len(x)):
        w = math.exp(log_weight[i])
        if w < NEGLIGIBLE:
            continue
        count = echo_sources(x[i], y[i], axis + turn[i], walls, distance_m, off_axis_rad, kind)
        likelihood = echo_density(range_m, count, distance_m, off_axis_rad, kind, model)
        weight += w
        explained += w * likelihood
        log_likelihood = power * math.log(likelihood)
        log_weight[i] += log_likelihood
        top = max(top, log_weight[i])
        w *= math.exp(log_likelihood)
        total += w
        squares += w * w
    for i in range(len(x)):
        log_weight[i] -= top
    return math.log(explained / weight), total * total / squares


@lean_kernel
def effective_size(log_weight: Floats) -> float:
    """Effective number of particles, (sum w)^2 / sum w^2."""
    total, squares = 0.0, 0.0
    for v in log_weight:
        w = math.exp(v)
        total += w
        squares += w * w
    return total * total / squares if squares > 0.0 else 0.0


@kernel
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
