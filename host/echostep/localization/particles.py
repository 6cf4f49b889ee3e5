"""The cloud: the trunk's position as weighted particles on the plan.

In: moves of the trunk in the walk frame, with the pings on them. Out: a `Cloud` whose moments are the estimate. Owns the particles; draws from the
generator that it is given. Only the filter's kernels go from the walk frame to the map.

A particle is (x, y) on the sheet of levels, `turn` = rotation walk -> map, `scale` = true length / measured length. In a building of several levels
it also has a height `z` and an offset `lag` of the height by pressure. Weights are logarithms.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.localization.beacon_beliefs import BeaconBeliefs, empty_beliefs
from echostep.localization.echo_likelihood import EchoModel
from echostep.localization.level_changes import (
    ClimbSettings,
    HeightArrays,
    HeightChange,
    change_levels,
    level_change_model,
    set_levels_by_pressure,
)
from echostep.localization.particle_kernels import (
    CloudModel,
    Move,
    MoveProgress,
    ParticleArrays,
    PingBatch,
    effective_size,
    propagate_and_reweight,
    systematic,
)
from echostep.plan.model import Pose
from echostep.walls.echo_sources import Walls
from echostep.walls.level_sheet import LevelSheet, level_of

ANY_LEVEL = -1  # level of a start that is not known
UNKNOWN_LAG_M2 = 1e6  # variance of `lag` before the first height by pressure: no information
ROUGHENED = (
    10  # a cloud of more than so many times the usual size is roughened, by reason: only a scattered one is so large
)
KLD_QUANTILE = 2.33  # z of 99 % [Fox 2003, eq. 7]


@dataclass(frozen=True, slots=True)
class CloudSettings:
    """Size of the cloud, spread at the start, and noise that the path's own covariance leaves out.

    `step_sd`: of the length of a move, per square root of a metre; `turn_sd_deg`, `scale_sd`: drift of the walk frame's rotation and of the lengths,
    likewise. `resample_below`: effective share of the cloud at which it is resampled (systematic). The size follows the spread [Fox 2003,
    KLD-sampling]: enough particles that the distribution over cells of `cell_m`, `cell_m`, `cell_deg` is met within `kld`, at least `size`, at
    most `largest`. A scattered cloud is roughened by `rough_m` and `rough_deg` until it has contracted. `wall_cost`: log-weight that crossing a
    wall costs. `rescue_sd_m`: widening of a cloud that crossed a wall as a whole.
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


class Cloud:
    """Particles as flat arrays of n; `log_weight` is normalised to a maximum of 0."""

    def __init__(
        self, settings: CloudSettings, start: Pose, walk_heading_rad: float, rng: np.random.Generator,
        sheet: LevelSheet | None = None, climbing: ClimbSettings | None = None,
    ) -> None:  # fmt: skip
        """`walk_heading_rad`: the trunk's heading in the walk frame while it stands at `start`; without `sheet` there is one level."""
        self.sheet = sheet if sheet is not None and len(sheet.height_m) > 1 else None
        self._climbing = climbing or ClimbSettings()
        self._level_changes = level_change_model(self._climbing)
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
        self.beliefs = empty_beliefs(n, 0)
        if self.sheet:
            levels = len(self.sheet.height_m)
            level = np.arange(n) % levels if start.level == ANY_LEVEL else np.full(n, start.level)
            self.x_m += level * self.sheet.pitch_m
            self.z_m = self.sheet.height_m[level]
        self.rescues = 0
        self._minimum_size = n

    @property
    def level(self) -> Ints:
        """Level of each particle (n,), an index into the plan's."""
        return level_of(self.x_m, self.sheet) if self.sheet else np.zeros(len(self.x_m), np.int64)

    @property
    def map_x_m(self) -> Floats:
        """East of each particle in the map (n,), on any level."""
        return self.x_m - self.level * self.sheet.pitch_m if self.sheet else self.x_m

    @property
    def pitch_m(self) -> float:
        """How far east of the level below it each level lies on the sheet."""
        return self.sheet.pitch_m if self.sheet else 0.0

    @property
    def arrays(self) -> ParticleArrays:
        """The particles as kernels take them: these arrays, not copies."""
        return ParticleArrays(self.x_m, self.y_m, self.turn_rad, self.scale, self.log_weight)

    @property
    def weight(self) -> Floats:
        """Weights (n,) that sum to 1."""
        weight: Floats = np.exp(self.log_weight)
        weight /= weight.sum()
        return weight

    def level_at(self, x_m: float) -> int:
        """Level of an x on the sheet."""
        return int(level_of(np.array([x_m]), self.sheet)[0]) if self.sheet else 0

    def propagate_and_reweight(self, move: Move, pings: PingBatch, model: EchoModel, walls: Walls) -> Floats:
        """Propagate by a move and reweight by each ping on it, where it was triggered; resample whenever too few particles carry the weight.

        A particle that crosses a wall loses its weight. If all do, the plan or the path is wrong: the cloud goes on behind the wall, wider. Returns
        for each ping the log of its mean likelihood under the cloud before it: how well the plan explains the ping.
        """
        log_evidence = np.zeros(len(pings.share))
        progress, settings = MoveProgress(0.0, 0), self._settings
        cloud_model = CloudModel(settings.wall_cost, settings.resample_below, model)
        while progress.share < 1.0 or progress.ping < len(log_evidence):
            rest = 1.0 - progress.share
            noise = self._noise(move, rest)
            index = walls.near(self.x_m, self.y_m, rest * math.hypot(move.dx_m, move.dy_m))
            progress, lowest = propagate_and_reweight(
                self.arrays, move, noise, progress, pings, cloud_model, index, log_evidence
            )
            if lowest < -0.5 * settings.wall_cost:
                self._widen()
            self.resample_if_needed()
        return log_evidence

    def change_levels(self, move: Move, change: HeightChange) -> None:
        """Update heights and levels after a move, reweight by them, and resample when too few particles carry the weight."""
        if self.sheet is None:
            return
        if math.isfinite(change.height_sd_m):
            self._lag_variance += self._climbing.drift_m**2 * change.span_s
        noise = self._rng.standard_normal(len(self.x_m))
        heights = HeightArrays(self.z_m, self.lag_m)
        self._lag_variance = change_levels(
            self.arrays, heights, move, noise, change, self._lag_variance, self._level_changes, self.sheet
        )
        self.resample_if_needed()

    def scatter(self, move: Move, change: HeightChange | None = None) -> None:
        """Spread by an unobserved move: no wall is asked, the path to its end is not known. The level is that of the height by pressure, if any."""
        self._keep(systematic(np.exp(self.log_weight), float(self._rng.random()), self._settings.largest))
        noise = self._rng.standard_normal((3, len(self.x_m)))
        self.turn_rad += move.turn_sd_rad * noise[2]
        c, s = np.cos(self.turn_rad), np.sin(self.turn_rad)
        self.x_m += c * move.dx_m - s * move.dy_m + move.sd_m * noise[0]
        self.y_m += s * move.dx_m + c * move.dy_m + move.sd_m * noise[1]
        if self.sheet and change and math.isfinite(change.height_sd_m):
            set_levels_by_pressure(self.x_m, HeightArrays(self.z_m, self.lag_m), change.height_m, self.sheet)

    def set_minimum_size(self, factor: float) -> None:
        """From the next resampling on, keep at least `factor` times the usual number of particles."""
        self._minimum_size = int(factor * self._settings.size)

    def resample_if_needed(self) -> None:
        """Systematic resampling [Kitagawa 1996] when too few particles carry the weight."""
        if effective_size(self.log_weight) >= self._settings.resample_below * len(self.x_m):
            return
        self._keep(systematic(np.exp(self.log_weight), float(self._rng.random()), len(self.x_m)))
        count = self._size_by_spread()
        if count != len(self.x_m):
            self._keep(systematic(np.ones(len(self.x_m)), float(self._rng.random()), count))
        if count > ROUGHENED * self._settings.size:
            self._roughen()

    def _noise(self, move: Move, share: float) -> Floats:
        """Noise of this share of a move in x, y, turn and scale of each particle, (4, n)."""
        s, length = self._settings, math.hypot(move.dx_m, move.dy_m)
        sd = math.hypot(move.sd_m, s.step_sd * math.sqrt(length))
        turn_sd = math.hypot(move.turn_sd_rad, math.radians(s.turn_sd_deg) * math.sqrt(length))
        noise = self._rng.standard_normal((4, len(self.x_m)))
        scale_sd = math.hypot(move.scale_sd, s.scale_sd * math.sqrt(length))
        noise *= np.array([[sd], [sd], [turn_sd], [scale_sd]]) * math.sqrt(share)
        return noise

    def _widen(self) -> None:
        """Widen the places after every particle has crossed a wall."""
        self.rescues += 1
        self.x_m += self._settings.rescue_sd_m * self._rng.standard_normal(len(self.x_m))
        self.y_m += self._settings.rescue_sd_m * self._rng.standard_normal(len(self.x_m))

    def _roughen(self) -> None:
        """Add noise to a scattered cloud, so that copies of one particle try places between the few that fit [Gordon et al. 1993]."""
        noise = self._rng.standard_normal((3, len(self.x_m)))
        self.x_m += self._settings.rough_m * noise[0]
        self.y_m += self._settings.rough_m * noise[1]
        self.turn_rad += math.radians(self._settings.rough_deg) * noise[2]

    def _keep(self, chosen: Ints) -> None:
        """Replace the particles by the chosen ones (m,), with equal weights."""
        self.x_m, self.y_m = self.x_m[chosen], self.y_m[chosen]
        self.turn_rad, self.scale = self.turn_rad[chosen], self.scale[chosen]
        self.z_m, self.lag_m = self.z_m[chosen], self.lag_m[chosen]
        self.beliefs = BeaconBeliefs(*(part[chosen] for part in self.beliefs))
        self.log_weight = np.zeros(len(chosen))

    def _size_by_spread(self) -> int:
        """Size for the present spread, from the number of cells that hold particles [Fox 2003, eq. 7]."""
        s = self._settings
        cells = np.floor(self.x_m / s.cell_m)
        cells += 1e6 * np.floor(self.y_m / s.cell_m)
        cells += 1e12 * np.floor(self.turn_rad / math.radians(s.cell_deg))
        cells.sort()
        k = np.count_nonzero(cells[1:] != cells[:-1])
        if k < 1:
            return self._minimum_size
        part = 2.0 / (9.0 * k)
        wanted = k / (2.0 * s.kld) * (1.0 - part + math.sqrt(part) * KLD_QUANTILE) ** 3
        return int(min(max(wanted, self._minimum_size), s.largest))
