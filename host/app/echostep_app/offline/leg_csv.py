# SPDX-License-Identifier: MIT
"""A recorded leg as a CSV file: samples read and checked.

In: columns `t_s,thigh_rad_s,shank_rad_s[,belt_rad_s,compass_rad]`, 50 to 500 Hz, either sign; in place of a pitch rate the rates about three axes
in rad/s, as `thigh_x,thigh_y,thigh_z`. The other leg: the same columns with `other_` before them, or a file of its own whose times are of the same
clock. Out: `LegSamples` with notes on repairs, or an EchostepError that names the fault. Owns nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TextIO

import numpy as np

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.offline.bursts import spread
from echostep.offline.csv_table import CsvLimits, lines_of, open_samples
from echostep.offline.imu_checks import MISSING_SHARE, missing_share, sorted_by_time
from echostep.ports.imu_samples import time_complaint
from echostep_app.offline.foreign_columns import ADVICE, OWN, Naming, read_header
from echostep_app.offline.leg_gyros import find_clipping_limits, repair_clipping, walking_axis

COLUMNS = ("t_s", "thigh_rad_s", "shank_rad_s")
OPTIONAL = ("belt_rad_s", "compass_rad")
AXES = {name: tuple(f"{name.split('_')[0]}_{axis}" for axis in "xyz") for name in COLUMNS[1:]}  # of gyros with three
OTHER = "other_"  # before the names of the columns of the other leg
TIME, THIGH, SHANK, BELT, COMPASS = range(5)  # columns of a table of samples

FASTEST_LEG_RAD_S = 20.0  # for the 99 % quantile of the rates: the shank of a sprinter reaches it
MOST_TURNS = 4  # of a compass column that was not wrapped: beyond it, degrees are more likely than radians
LARGEST_NUMBER = 1e6  # of a rate in any unit: larger ones are not measurements, and their squares overflow
FEWEST_ROWS = 100  # fewer rows do not show a dead sensor


@dataclass(frozen=True, slots=True)
class LegSamples:
    """Arrays (n,): `t_s`, `thigh`, `shank`, `belt` rad/s, `compass` rad; NaN where the file has no belt or compass. `notes`: repairs."""

    t_s: Floats
    thigh: Floats
    shank: Floats
    belt: Floats
    compass: Floats
    notes: tuple[str, ...] = ()

    @property
    def has_heading(self) -> bool:
        """Whether a belt or a compass was worn."""
        return not bool(np.isnan(self.belt).all() and np.isnan(self.compass).all())


def load_pair(paths: Sequence[Path], naming: Naming = OWN) -> tuple[LegSamples, ...]:
    """Samples of one leg or of both, from one file or two; the notes on the other leg say so. Raises EchostepError."""
    if len(paths) > 2:
        raise EchostepError(f"{len(paths)} files: a person has two legs, give one file or two")
    names = open_samples(paths[0], lambda file: read_header(lines_of(file, CsvLimits()), naming).names)
    if len(paths) == 1 and not any(name.startswith(OTHER) for name in names):
        return (load_legs(paths[0], "", naming),)
    other = load_legs(paths[-1], OTHER if len(paths) == 1 else "", naming)
    return load_legs(paths[0], "", naming), replace(other, notes=tuple(f"other leg: {note}" for note in other.notes))


def load_legs(path: Path | str, prefix: str = "", naming: Naming = OWN) -> LegSamples:
    """Samples of the leg whose columns have this prefix; raises EchostepError that names the file, the column and the fault."""
    table, mended = open_samples(path, partial(_mended_table, prefix=prefix, naming=naming))
    later = np.concatenate([[True], table[1:, TIME] > np.maximum.accumulate(table[:-1, TIME])])
    t_s, thigh, shank, belt, compass = table[later].T
    return LegSamples(t_s, thigh, shank, belt, compass, (*mended, *_notes(table)))


def _mended_table(file: TextIO, prefix: str, naming: Naming) -> tuple[Floats, tuple[str, ...]]:
    """Usable rows (n, 5) in order of time, and notes on repairs; raises ValueError for samples that cannot be used."""
    table, mounted = _table(file, prefix, naming)
    whole = np.isfinite(table[:, : len(COLUMNS)]).all(axis=1)
    holes = () if whole.all() else (f"{int((~whole).sum())} rows without a number in some column: skipped",)
    table, mended = sorted_by_time(table[whole])
    table[:, TIME], spreading = spread(table[:, TIME])
    if wrong := complaint(table):
        raise ValueError(wrong)
    return table, (*holes, *_empty_cells(table), *mended, *spreading, *mounted)


def _table(file: TextIO, prefix: str, naming: Naming) -> tuple[Floats, tuple[str, ...]]:
    """The columns (n, 5) in SI units, NaN for a missing column and for a cell without a number; notes on the axes of sensors with three."""
    lines = lines_of(file, CsvLimits())
    head = read_header(lines, naming)
    header = head.names
    if prefix:
        hidden = tuple(name.split("_")[0] for name in COLUMNS[1:])  # of the first leg
        header = ["" if name.startswith(hidden) else name.removeprefix(prefix) for name in header]
    names = [AXES.get(name, ()) if name not in header else () for name in COLUMNS]
    sources = [
        axes if axes and all(axis in header for axis in axes) else (name,)
        for name, axes in zip(COLUMNS, names, strict=True)
    ]
    if missing := [name for source in sources for name in source if name not in header]:
        degrees = [f"; {name} looks like degrees" for name in header if "deg" in name.lower()]
        raise ValueError(
            f"no column {', '.join(prefix + name for name in missing)}; the first line must name {','.join(COLUMNS)}[,{','.join(OPTIONAL)}], "
            f"or thigh_x,thigh_y,thigh_z and shank_x,shank_y,shank_z for gyros of three axes{''.join(degrees[:1])}{ADVICE}"
        )
    wanted = [name for source in sources for name in source]
    named = [prefix + name if prefix + name in head.names else name for name in (*wanted, *OPTIONAL)]
    values = head.table(lines, named, len(wanted), CsvLimits()).values
    series, notes, at = [], [], 0
    for name, source in zip(COLUMNS, sources, strict=True):
        rates = values[:, at : at + len(source)]
        at += len(source)
        if len(source) == 1:
            series.append(rates[:, 0])
            continue
        column, note = _about_walking_axis(name, values[:, TIME], rates)
        series.append(column)
        notes.append(note)
    return np.column_stack([*series, values[:, at:]]), tuple(notes)


def _empty_cells(table: Floats) -> tuple[str, ...]:
    """Notes on rows (n, 5) without a number of belt or compass, where others have one."""
    missing = np.isnan(table[:, BELT:]).sum(axis=0).tolist()
    return tuple(
        f"{rows} rows without a number in {name}: taken as {instead}"
        for rows, name, instead in zip(missing, OPTIONAL, ("no turning", "no reading"), strict=True)
        if 0 < rows < len(table)
    )


def _about_walking_axis(name: str, t_s: Floats, rates: Floats) -> tuple[Floats, str]:
    """Rates (n,) about the axis of walking of a sensor with rates (n, 3), peaks repaired, and a note; NaN where a number is missing."""
    part, pitch_rate = name.split("_", maxsplit=1)[0], np.full(len(t_s), np.nan)
    finite = np.isfinite(rates).all(axis=1) & np.isfinite(t_s)
    whole = np.flatnonzero(finite & (np.abs(rates).max(axis=1) < LARGEST_NUMBER))
    order = whole[np.argsort(t_s[whole], kind="stable")]
    if len(order) < FEWEST_ROWS:
        raise ValueError(f"{part}_x, {part}_y, {part}_z: too few rows with numbers to find the axis of walking")
    repaired = repair_clipping(t_s[order], rates[order])
    mounting = walking_axis(t_s[order], repaired)
    pitch_rate[order] = repaired @ mounting.axis
    if not mounting.clear:
        return (
            pitch_rate,
            f"{part}: no axis of walking stands out, the one turned about most is taken: the track is less certain",
        )
    off = math.degrees(math.acos(min(float(np.abs(mounting.axis).max()), 1.0)))
    axis = "xyz"[int(np.argmax(np.abs(mounting.axis)))]
    return pitch_rate, f"{part}: the axis of walking is {off:.0f} degrees from the sensor's {axis}"


def complaint(table: Floats) -> str:
    """Why the samples (n, 5) cannot be used, as a message; empty when they can."""
    return time_complaint(table[:, TIME], "a leg") or _dead_complaint(table) or _unit_complaint(table)


def _dead_complaint(table: Floats) -> str:
    """Message for a constant column, or for two equal ones."""
    if len(table) <= FEWEST_ROWS:
        return ""
    for column, name in ((THIGH, COLUMNS[THIGH]), (SHANK, COLUMNS[SHANK])):
        if np.ptp(table[:, column]) == 0.0:
            return f"{name} is constant: is that sensor alive?"
    if np.array_equal(table[:, THIGH], table[:, SHANK]):
        return "thigh_rad_s and shank_rad_s are the same numbers: is one column copied?"
    return ""


def _unit_complaint(table: Floats) -> str:
    """Message for rates or compass headings too large for radians."""
    for column, name in zip((THIGH, SHANK, BELT), (*COLUMNS[1:], OPTIONAL[0]), strict=True):
        rates = table[np.isfinite(table[:, column]), column]
        if len(rates) and float(np.quantile(np.abs(rates), 0.99)) > FASTEST_LEG_RAD_S:
            fastest = float(np.abs(rates).max())
            return f"{name} reaches {fastest:.0f}, no leg turns so fast in rad/s: in deg/s? multiply it by pi/180, or say --units deg/s"
    compass = np.abs(table[np.isfinite(table[:, COMPASS]), COMPASS])
    if len(compass) and float(compass.max()) > MOST_TURNS * 2.0 * math.pi:
        return f"compass_rad reaches {float(compass.max()):.0f}: in degrees? multiply it by pi/180, or say --units deg"
    return ""


def _notes(table: Floats) -> tuple[str, ...]:
    """Faults of the samples (n, 5) that make the track less certain, a line each."""
    notes = []
    steps = np.diff(table[:, TIME])
    if repeated := int((steps <= 0.0).sum()):
        notes.append(f"{repeated} rows are not later than the one before: skipped")
    if (missing := missing_share(steps)) > MISSING_SHARE:
        notes.append(f"{100 * missing:.0f} % of the samples are missing: the track is less certain")
    for name, *limits in zip(COLUMNS[1:], *find_clipping_limits(table[:, THIGH : SHANK + 1]), strict=True):
        if reached := [abs(limit) for limit in limits if math.isfinite(limit)]:
            notes.append(f"{name} is cut off at {min(reached):.3g} rad/s, its range is too small: peaks restored")
    return tuple(notes)
