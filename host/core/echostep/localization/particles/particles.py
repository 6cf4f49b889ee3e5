# SPDX-License-Identifier: MIT
"""Weighted particles as a struct of arrays, and the values read from them.

In: arrays of n particles. Out: levels, weights, places. Owns the arrays.
"""

from __future__ import annotations

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.localization.limits import ROOM_M
from echostep.localization.particle_arrays import ParticleArrays
from echostep.localization.particles.places import LikelyPlace, hypotheses
from echostep.walls.level_sheet import LevelSheet, level_of

# A cloud is gathered when less than this weight is farther than ROOM_M from its mean, assumed
GATHERED_REST = 1e-4


class Particles:
    """Flat arrays of n particles on the sheet of levels; `log_weight` is normalised to a maximum of 0.

    `carried`: arrays (n, ...) of what aids the filter, which each particle carries along.
    """

    sheet: LevelSheet | None
    x_m: Floats
    y_m: Floats
    turn_rad: Floats
    scale: Floats
    veer_rad_m: Floats
    lag_m: Floats
    log_weight: Floats
    hidden: Floats
    bend: Floats
    carried: tuple[Floats, ...]
    z_m: Floats

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

    @property
    def hidden_shares(self) -> Floats:
        """Probability (2,) that the view of each ranger is hidden."""
        shares: Floats = self.hidden @ self.weight
        return shares

    @property
    def hidden_share(self) -> float:
        """Mean of `hidden_shares`."""
        return float(self.hidden_shares.mean())

    def places(self, walk_heading_rad: float) -> tuple[LikelyPlace, ...]:
        """The likeliest places of the trunk, the likeliest first."""
        return hypotheses(self.map_x_m, self.y_m, self.level, self.turn_rad + walk_heading_rad, self.weight)

    @property
    def place_share(self) -> float:
        """Weight of the likeliest place, on whatever level; 0 if none has enough to be listed."""
        places = hypotheses(self.map_x_m, self.y_m, np.zeros(len(self.x_m), np.int64), self.turn_rad, self.weight)
        return places[0].probability if places else 0.0

    @property
    def likeliest_level(self) -> int:
        """The level with the most weight."""
        return int(self.level_shares.argmax())

    @property
    def level_shares(self) -> Floats:
        """Weight on each level up to the highest that has any (k,)."""
        return np.asarray(np.bincount(self.level, self.weight), np.float64)

    def level_at(self, x_m: float) -> int:
        """Level of an x on the sheet."""
        return int(level_of(np.array([x_m]), self.sheet)[0]) if self.sheet else 0

    def far_weight(self, x_m: Floats) -> float:
        """Weight further than ROOM_M from the mean, by x (n,) on the sheet or in the map."""
        weight = self.weight
        far = np.hypot(x_m - weight @ x_m, self.y_m - weight @ self.y_m) > ROOM_M
        return float(weight @ far)

    def keep(self, chosen: Ints) -> None:
        """Replace the particles by the chosen ones (m,), with equal weights."""
        self.x_m, self.y_m = self.x_m[chosen], self.y_m[chosen]
        self.turn_rad, self.scale, self.veer_rad_m = self.turn_rad[chosen], self.scale[chosen], self.veer_rad_m[chosen]
        self.z_m, self.lag_m, self.bend = self.z_m[chosen], self.lag_m[chosen], self.bend[chosen]
        self.carried = tuple(each[chosen] for each in self.carried)
        self.hidden = np.ascontiguousarray(self.hidden[:, chosen])
        self.log_weight = np.zeros(len(chosen))
