# SPDX-License-Identifier: MIT
"""Sweeps of a ranger that turns about itself at a known place: files, or simulated.

In: a folder of CSV files, or a seed. Out: `SweepSet`: walls, and the pings of each sweep. Owns nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

import numpy as np

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.offline.csv_table import CsvLimits, CsvTable, column_of, header_of, lines_of, open_samples, read_rows
from echostep_simulation.world.acoustics import Acoustics
from echostep_simulation.world.echoes import echoes

COLUMNS = ("x_m", "y_m", "heading_deg", "bearing_deg", "range_m")
WALLS = "walls.csv"
# The room and the ranger of the real sweeps whose shares are known [real sweeps of 40 kHz rangers]: 2.1 m square with two alcoves, their places
# assumed; beam and threshold are chosen so that the shares of right echoes by angle come near to the real ones, as the boards are low: by a data
# sheet the ranger hears farther. Up to 25 degrees off the axis 8 to 13 % of the pings have no echo or a longer one: `missed`. Of the pings that the
# nearest wall did not answer 54 to 85 % came back too long, in a room where a beam meets two to four walls: 1 - (1 - 0.35)^2 to ^4
ROOM = np.array(
    [[0, 0, 2.1, 0], [2.1, 0, 2.1, 0.7], [2.1, 0.7, 2.5, 0.7], [2.5, 0.7, 2.5, 1.3], [2.5, 1.3, 2.1, 1.3], [2.1, 1.3, 2.1, 2.1],
     [2.1, 2.1, 1.5, 2.1], [1.5, 2.1, 1.5, 2.4], [1.5, 2.4, 0.9, 2.4], [0.9, 2.4, 0.9, 2.1], [0.9, 2.1, 0, 2.1], [0, 2.1, 0, 0]],
)  # fmt: skip
ROOM_RANGER = Acoustics(
    size=3.2, threshold_db=-10.5, minimum_m=0.03, maximum_m=4.0, noise_m=0.013, bias_m=0.02, missed=0.1, scatter=0.35
)
SWEEPS, PINGS, CLEAR_M = 8, 72, 0.2


@dataclass(frozen=True, slots=True)
class Sweep:
    """Pings (n,) from one place: the axis against the heading, and the range, NaN for none."""

    x_m: float
    y_m: float
    heading_rad: float
    bearing_rad: Floats
    range_m: Floats

    @property
    def axis_rad(self) -> Floats:
        """Axes (n,) in the map."""
        axes: Floats = self.heading_rad + self.bearing_rad
        return axes


@dataclass(frozen=True, slots=True)
class SweepSet:
    """Sweeps among the same walls (n, 4)."""

    walls: Floats
    sweeps: tuple[Sweep, ...]


def read_sweeps(folder: Path) -> SweepSet:
    """All sweeps of a folder: every CSV file but walls.csv, cut where place or heading change; raises EchostepError with file and column."""
    if not (folder / WALLS).is_file():
        raise EchostepError(
            f"{folder / WALLS}: not there: it has the ends of each wall in metres, x y x y, after one line of names"
        )
    walls = open_samples(folder / WALLS, lambda file: _table(file, None)).values
    if not np.isfinite(walls).all():
        raise EchostepError(f"{folder / WALLS}: a wall lacks a number: four are needed, the ends x y x y in metres")
    paths = sorted(path for path in folder.glob("*.csv") if path.name != WALLS)
    sweeps = [sweep for path in paths for sweep in _sweeps_of(path)]
    if not sweeps:
        raise EchostepError(f"{folder}: no sweep: its CSV files have the columns {', '.join(COLUMNS)}")
    return SweepSet(walls, tuple(sweeps))


def _sweeps_of(path: Path) -> list[Sweep]:
    rows = open_samples(path, lambda file: _table(file, COLUMNS)).values
    rows = rows[np.isfinite(rows[:, :4]).all(1)]
    change = np.flatnonzero((np.diff(rows[:, :3], axis=0) != 0.0).any(1)) + 1
    return [
        Sweep(
            float(part[0, 0]), float(part[0, 1]), math.radians(part[0, 2]), np.radians(part[:, 3]),
            np.where(part[:, 4] > 0.0, part[:, 4], np.nan),
        )
        for part in np.split(rows, change)
        if len(part)
    ]  # fmt: skip


def _table(file: TextIO, names: tuple[str, ...] | None) -> CsvTable:
    """The named columns, the last of which may be empty; without names the first four."""
    limits = CsvLimits()
    header = header_of(next(lines_of(file, limits), ""))
    columns = [column_of(header[0], name) for name in names] if names else [0, 1, 2, 3]
    if names and -1 in columns:
        raise ValueError(f"no column {names[columns.index(-1)]}: a sweep has {', '.join(names)}")
    return read_rows(lines_of(file, limits, 2), header, columns, 4, limits)


def simulated_sweeps(seed: int) -> SweepSet:
    """Sweeps of 72 pings at random places of ROOM, each by another ranger of its kind, by the simulator's image sources and scattering."""
    rng = np.random.default_rng([seed, 46])
    sweeps = []
    for _ in range(SWEEPS):
        x, y = rng.uniform(CLEAR_M, 2.1 - CLEAR_M, 2).tolist()
        heading = float(rng.uniform(-math.pi, math.pi))
        bearing = np.arange(PINGS, dtype=np.float64) * (2.0 * math.pi / PINGS)
        look = heading + bearing - 0.5 * math.pi  # of the left ranger's trunk
        bias_m = np.full(2, ROOM_RANGER.bias_m * rng.standard_normal())
        us = echoes(np.tile([x, y], (PINGS, 1)), look, ROOM, bias_m, rng, ROOM_RANGER).own_us[:, 0].astype(float)
        range_m = np.where(us > 0.0, us * (0.5e-6 * ROOM_RANGER.speed_m_s), np.nan)
        sweeps.append(Sweep(x, y, heading, bearing, range_m))
    return SweepSet(ROOM, tuple(sweeps))
