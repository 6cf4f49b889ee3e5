"""What the board's sensors feel, as rows of one millisecond (host/DESIGN.md, the bench).

In: a walk, a world, a seeded generator. Out: rows for a board. Owns each sensor's constant errors.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from echostep.simulation.walker import Walk
from echostep.simulation.world import echoes, ranger_bias_m

Floats = NDArray[np.float64]

ROW = np.dtype(
    [
        ("thigh", "<i2"), ("calf", "<i2"), ("belt", "<i2"),
        ("own_us", "<u2", 2), ("cross_us", "<u2", 2),
        ("bearing", "<u2"), ("pressure", "<u4"), ("temperature", "<i2"), ("sync_us", "<u2"),
    ]
)  # fmt: skip
NO_SYNC = 65535
GYRO_RAD_S = math.radians(0.2439)  # per count [ADIS16100 datasheet]
GYRO_NOISE_RAD_S = math.radians(0.5)  # rms at 40 Hz bandwidth
GYRO_BIAS_RAD_S = math.radians(1.0)
PRESSURE_PA = 101_325.0
PRESSURE_NOISE_PA = 3.0  # SCP1000, high speed
PASCAL_PER_METRE = 12.0


class BoardSensors:
    """Makes the rows of any stretch of a walk; the same seed makes the same rows when stretches are asked for in order."""

    def __init__(self, walk: Walk, walls: Floats, sync_t_s: Floats, rng: np.random.Generator) -> None:
        """`sync_t_s`: times of the MTx's SyncOut edges, ascending."""
        self._walk = walk
        self._walls = walls
        self._sync_us = np.rint(sync_t_s * 1e6).astype(np.int64)
        self._rng = rng
        self._range_bias_m = ranger_bias_m(rng)
        self._gyro_bias = GYRO_BIAS_RAD_S * rng.standard_normal(3)
        self._compass_error = math.radians(3.0) * rng.standard_normal(2)

    def rows(self, start: int, stop: int) -> NDArray[np.void]:
        """Rows of the milliseconds start..stop-1 of the walk; past its end the last posture goes on."""
        at = np.minimum(np.arange(start, stop), len(self._walk.t_s) - 1)
        rows = np.zeros(len(at), ROW)
        for k, (name, rate) in enumerate(
            (("thigh", self._walk.thigh_rad_s), ("calf", self._walk.calf_rad_s), ("belt", self._walk.belt_rad_s))
        ):
            noisy = rate[at] + self._gyro_bias[k] + GYRO_NOISE_RAD_S * self._rng.standard_normal(len(at))
            rows[name] = np.clip(np.rint(noisy / GYRO_RAD_S), -2048, 2047)
        heard = echoes(self._walk.trunk_m[at], self._walk.heading_rad[at], self._walls, self._range_bias_m, self._rng)
        rows["own_us"], rows["cross_us"] = heard.own_us, heard.cross_us
        rows["bearing"] = self._bearing(self._walk.heading_rad[at])
        rows["pressure"] = np.rint((PRESSURE_PA + PRESSURE_NOISE_PA * self._rng.standard_normal(len(at))) * 4.0)
        rows["temperature"] = 20 * 20
        rows["sync_us"] = self._edges(start, stop)
        return rows

    def _bearing(self, heading: Floats) -> NDArray[np.uint16]:
        """Clockwise from north in tenths of a degree, with a hard-iron-like error of a few degrees."""
        error = self._compass_error[0] * np.cos(heading) + self._compass_error[1] * np.sin(heading)
        noisy = heading + error + math.radians(0.5) * self._rng.standard_normal(len(heading))
        return (np.rint(900.0 - np.degrees(noisy) * 10.0) % 3600).astype(np.uint16)

    def _edges(self, start: int, stop: int) -> NDArray[np.uint16]:
        found = np.full(stop - start, NO_SYNC, np.uint16)
        first, last = np.searchsorted(self._sync_us, (start * 1000, stop * 1000))
        edges = self._sync_us[first:last]
        found[edges // 1000 - start] = edges % 1000
        return found
