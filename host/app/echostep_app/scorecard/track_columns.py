# SPDX-License-Identifier: MIT
"""Tracks and true paths from CSV files of any tracker: which column means what; and our estimates as such a track.

In: a CSV file, the plan's levels. Out: `ScoredPath`s. Owns the names that columns may have. Metres, seconds, radians; x and y in the frame of the
truth, which is the plan's if there is a plan.
Our own estimates are scored without a file.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from echostep.arrays import Bools, Floats
from echostep.errors import EchostepError
from echostep.localization import Estimate, TrackStatus
from echostep.particles.ellipse import ellipse95
from echostep.plan import Plan
from echostep_app.scorecard.csv_columns import CsvColumns, read_csv

NAMES = {
    "time": tuple(f"{word}{unit}" for unit in ("_s", "", "_ms", "_us", "_ns") for word in ("t", "time", "timestamp")),
    "x": ("x_m", "x", "east_m", "east", "pos_x", "tx", "p_rs_r_x [m]"),
    "y": ("y_m", "y", "north_m", "north", "pos_y", "ty", "p_rs_r_y [m]"),
    "height": ("z_m", "z", "height_m", "height", "pos_z", "tz", "p_rs_r_z [m]"),
    "floor": ("level", "floor", "storey"),
    "radius95": ("radius95_m", "ce95_m"),
    "protection": ("protection_m", "protection_level_m"),
    "latency": ("latency_s",),
    "status": ("status",),
    "xx": ("xx_m2",),
    "xy": ("xy_m2",),
    "yy": ("yy_m2",),
}
REQUIRED = ("time", "x", "y")
TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
EPOCH_S = 3e8  # seconds since 1970 in July 1979: a greater number is the time of day of a recording, in whatever unit
# Mean speed below which seconds are doubted, and speeds of tracks; assumed
SLOWEST_M_S, WALKED_M_S = 0.005, (0.05, 15.0)


@dataclass(frozen=True, slots=True)
class ScoredPath:
    """A track or a true path of n rows: `t_s` (n,), `xy_m` (n, 2); None for data that the file lacks.

    `level`: index of the plan's level, or the file's own number of the floor. `covariance_m2` (n, 3): xx, xy, yy. `lost`: rows that are marked
    so. `columns`: the columns found, name of the column by its meaning. `time_unit`: the unit of the file's times.
    """

    path: Path
    t_s: Floats
    xy_m: Floats
    lost: Bools
    columns: dict[str, str] = field(compare=False)
    height_m: Floats | None = None
    level: Floats | None = None
    covariance_m2: Floats | None = None
    radius95_m: Floats | None = None
    protection_m: Floats | None = None
    latency_s: Floats | None = None
    time_unit: str = field(default="s", compare=False)

    def described(self) -> str:
        """The columns that were used, in words."""
        units = {"time": "" if self.time_unit == "s" else f" in {self.time_unit}"}
        used = ", ".join(f"{what} is {name}{units.get(what, '')}" for what, name in self.columns.items())
        return f"{self.path}: {used}"


def load_path(path: Path, plan: Plan | None) -> ScoredPath:
    """A track or a true path; raises EchostepError that names file, line and column."""
    table = read_csv(path)
    columns = {what: name for what, names in NAMES.items() if (name := table.find(names)) is not None}
    for what in REQUIRED:
        if what not in columns:
            wanted, there = ", ".join(NAMES[what]), ", ".join(table.names)[:300]
            raise EchostepError(f"{path}:1: no column for {what}: it may be named {wanted}; there are {there}")
    xy_m = np.column_stack([table.numbers(columns[axis]) for axis in "xy"])
    written = table.numbers(columns["time"])
    unit = time_unit(columns["time"], written, xy_m)
    t_s = written * TIME_UNITS[unit]
    back = np.flatnonzero(np.diff(t_s) < 0.0)
    if len(back):
        raise table.error(int(back[0]) + 1, columns["time"], "the time goes back")

    def optional(what: str) -> Floats | None:
        return table.numbers(columns[what], gaps=True) if what in columns else None

    height_m = optional("height")
    moments = [optional(what) for what in ("xx", "xy", "yy")]
    covariance = np.column_stack([m for m in moments if m is not None]) if all(m is not None for m in moments) else None
    radius = optional("radius95")
    if radius is None and covariance is not None:
        radius = np.array([ellipse95(*row).major_m for row in covariance.tolist()])
    lost = np.array([s.lower() == "lost" for s in table.texts(columns["status"])]) if "status" in columns else None
    return ScoredPath(
        path, t_s, xy_m,
        np.zeros(len(t_s), bool) if lost is None else lost, columns, height_m,
        _levels(table, columns.get("floor"), height_m, plan), covariance, radius, optional("protection"),
        optional("latency"), unit,
    )  # fmt: skip


def time_unit(name: str, written: Floats, xy_m: Floats) -> str:
    """The unit of a column of times: by its name, else by the date since 1970 that it would give, else by the speed that it would give."""
    ending = name.lower().rpartition("_")[2]
    if ending in TIME_UNITS:
        return ending
    greatest = float(np.abs(written).max())
    if greatest >= EPOCH_S / TIME_UNITS["ms"]:
        return next(unit for unit in ("ns", "us", "ms") if greatest >= EPOCH_S / TIME_UNITS[unit])
    way_m, span = float(np.hypot(*np.diff(xy_m, axis=0).T).sum()), float(np.ptp(written))
    if span <= 0.0 or way_m / span >= SLOWEST_M_S:
        return "s"
    fast = {unit: way_m / span / second for unit, second in TIME_UNITS.items()}
    return next((unit for unit in ("ms", "us", "ns") if WALKED_M_S[0] <= fast[unit] <= WALKED_M_S[1]), "s")


def other_unit(own: ScoredPath, begin_s: float, end_s: float) -> str:
    """The unit in which the times of a file would be those from `begin_s` to `end_s`, as the end of an error; empty for none."""
    for unit, second in TIME_UNITS.items():
        t_s = own.t_s * (second / TIME_UNITS[own.time_unit])
        alike = 0.1 <= np.ptp(t_s) / max(end_s - begin_s, 1e-9) <= 10.0
        if alike and t_s[0] <= end_s and begin_s <= t_s[-1]:
            return f"; those of {own.path} would be in {unit}: name its column {own.columns['time']} t_{unit}"
    return ""


def _levels(table: CsvColumns, name: str | None, height_m: Floats | None, plan: Plan | None) -> Floats | None:
    """Floor of each row: the column's, else the level of the plan nearest to the height, else the plan's only one."""
    if name is not None:
        index = {level.name: k for k, level in enumerate(plan.levels)} if plan else {}
        return np.array([_level(table, k, name, text, index.get) for k, text in enumerate(table.texts(name))])
    return levels_at(height_m, len(table.rows), plan) if plan else None


def levels_at(height_m: Floats | None, rows: int, plan: Plan) -> Floats | None:
    """The level of the plan nearest to each height, else the plan's only one; None where neither is known."""
    heights = np.array([level.height_m for level in plan.levels])
    if height_m is None:
        return np.zeros(rows) if len(heights) == 1 else None
    nearest = np.abs(height_m[:, None] - heights).argmin(1).astype(float)
    return np.asarray(np.where(np.isfinite(height_m), nearest, math.nan))


def _level(table: CsvColumns, row: int, name: str, text: str, index_of: Callable[[str], int | None]) -> float:
    """A floor from its cell: a whole number, or the name of a level of the plan; NaN where the cell is empty."""
    if not text:
        return math.nan
    try:
        value = float(text)
    except ValueError:
        level = index_of(text)
        if level is None:
            raise table.error(row, name, f"{text[:40]!r} is neither a whole number nor a level of the plan") from None
        return float(level)
    if value != round(value) or abs(value) > 1000:
        raise table.error(row, name, f"{text[:40]!r} is not a whole number of a floor")
    return value


def track_of(estimates: Sequence[Estimate], name: str = "estimates") -> ScoredPath:
    """Estimates as a track."""
    moments = [(e.xx_m2, e.xy_m2, e.yy_m2) for e in estimates]
    return ScoredPath(
        Path(name), np.array([e.t_s for e in estimates]), np.array([(e.x_m, e.y_m) for e in estimates]).reshape(-1, 2),
        np.array([e.status is TrackStatus.LOST for e in estimates], dtype=bool), {},
        height_m=np.array([e.z_m for e in estimates]), level=np.array([float(e.level) for e in estimates]),
        covariance_m2=np.array(moments).reshape(-1, 3), radius95_m=np.array([e.ellipse95.major_m for e in estimates]),
        protection_m=np.array([e.protection_m for e in estimates]),
    )  # fmt: skip
