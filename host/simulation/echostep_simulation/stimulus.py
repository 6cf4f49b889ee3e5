# SPDX-License-Identifier: MIT
"""Inputs of the simulated board's sensors, as rows of one millisecond (docs/design/bench.md).

In: a walk, the levels of a building, a seeded generator. Out: rows for a board. Owns the sensors.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from echostep.arrays import Floats
from echostep.plan import Level
from echostep_simulation.devices.board_sensors import Adis16100Model, CompassModel, Scp1000Model, WornGyro
from echostep_simulation.people.walker import RATE_HZ, Walk
from echostep_simulation.world.acoustics import SRF02, Acoustics, speed_of_sound_m_s
from echostep_simulation.world.echoes import echoes, ranger_bias_m
from echostep_simulation.world.magnetic_field import MagneticField

ROW = np.dtype(
    [
        ("thigh", "<i2"), ("calf", "<i2"), ("belt", "<i2"),
        ("own_us", "<u2", 2), ("cross_us", "<u2", 2),
        ("bearing", "<u2"), ("pressure", "<u4"), ("temperature", "<i2"), ("sync_us", "<u2"),
    ]
)  # fmt: skip
AXES = np.dtype([("rate", "<i2", 3), ("force", "<i2", 3)])  # counts of an LSM6DSO
EXTENDED_ROW = np.dtype([("row", ROW), ("motion", AXES, 3), ("field", "<i2", 3)])  # for parts of more than one axis
NO_SYNC = 65535
TEMPERATURE_C = 20.0


class BoardSensors:
    """Makes the rows of any stretch of a walk; the same seed makes the same rows when stretches are asked for in order, however long they are."""

    def __init__(
        self, walk: Walk, levels: Sequence[Level], sync_t_s: Floats, rng: np.random.Generator,
        magnetism: MagneticField | None = None, air_pa: Floats | None = None, acoustics: Acoustics = SRF02,
        barometer: Scp1000Model | None = None, worn: WornGyro | None = None, celsius: float = TEMPERATURE_C,
    ) -> None:  # fmt: skip
        """`sync_t_s`: times of the MTx SyncOut edges, ascending; without `magnetism` the earth field alone.

        Echoes come from the walls of the nearest level.

        `acoustics`: of the rangers; `barometer`: another one than an SCP1000; `worn`: how the belt's gyro is worn, perfectly by default.

        `celsius`: of the air.

        `air_pa`: the true pressure at each millisecond of the walk (`weather.pressures`), instead of its heights.
        """
        self._walk, self._celsius = walk, celsius
        self._walls = [level.solid for level in levels]
        self._level = np.abs(walk.height_m[:, None] - [level.height_m for level in levels]).argmin(1)
        self._sync_us = np.rint(sync_t_s * 1e6).astype(np.int64)
        self._acoustics = acoustics._replace(speed_m_s=speed_of_sound_m_s(celsius))
        self._echo_rng, *rest = rng.spawn(6)
        self._range_bias_m = ranger_bias_m(self._echo_rng, self._acoustics)
        self._thigh, self._calf, self._belt = (Adis16100Model(r) for r in rest[:3])
        self._air_pa = air_pa
        self._barometer = barometer or Scp1000Model(rest[3])
        self._compass = CompassModel(magnetism, rest[4])
        self._belt_rad_s = (
            walk.belt_rad_s if worn is None else worn.rates(walk.belt_rad_s, RATE_HZ, rest[2].spawn(1)[0])
        )

    def rows(self, start: int, stop: int, ranging: NDArray[np.bool_] | None = None) -> NDArray[np.void]:
        """Rows of the milliseconds start..stop-1 of the walk; past its end the last posture goes on.

        `ranging` (n,): milliseconds whose echoes are needed; they are most of the work.
        """
        w = self._walk
        at = np.minimum(np.arange(start, stop), len(w.t_s) - 1)
        rows = np.zeros(len(at), ROW)
        rows["thigh"] = self._thigh.counts(w.thigh_rad_s[at])
        rows["calf"] = self._calf.counts(w.calf_rad_s[at])
        rows["belt"] = self._belt.counts(self._belt_rad_s[at])
        trunk, heading = w.trunk_m[at], w.heading_rad[at]
        begin = 0
        for end in [*(np.flatnonzero(np.diff(self._level[at])) + 1).tolist(), len(at)]:
            one = slice(begin, end)
            walls = self._walls[self._level[at[begin]]]
            asked = None if ranging is None else ranging[one]
            sound = echoes(trunk[one], heading[one], walls, self._range_bias_m, self._echo_rng, self._acoustics, asked)
            rows["own_us"][one], rows["cross_us"][one] = sound.own_us, sound.cross_us
            begin = end
        rows["bearing"] = self._compass.bearings(trunk, heading)
        air = None if self._air_pa is None else self._air_pa[at]
        rows["pressure"], rows["temperature"] = self._barometer.counts(w.height_m[at], self._celsius, len(at), air)
        rows["sync_us"] = self._edges(start, stop)
        return rows

    def _edges(self, start: int, stop: int) -> NDArray[np.uint16]:
        offsets_us = np.full(stop - start, NO_SYNC, np.uint16)
        first, last = np.searchsorted(self._sync_us, (start * 1000, stop * 1000))
        edges = self._sync_us[first:last]
        offsets_us[edges // 1000 - start] = edges % 1000
        return offsets_us
