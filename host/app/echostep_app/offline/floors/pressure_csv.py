# SPDX-License-Identifier: MIT
"""A recorded barometer as a CSV file: samples checked and read.

In: columns `t_s,pressure_pa[,temperature_c]`, 0.5 to 50 Hz. Out: `Pressures` with notes on repairs, or an EchostepError that names file,
line and field. Owns nothing.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from echostep.arrays import Bools, Floats, Ints
from echostep.offline.csv_table import MOST_BAD, CsvLimits, lines_of, open_samples
from echostep.ports.imu_samples import rate_complaint
from echostep_app.offline.foreign_columns import ADVICE, OWN, UNITS, Naming, read_header
from echostep_app.offline.ros_bag import FLUID_PRESSURE, is_bag, read_bag
from echostep_app.printing.lines import faults_of

COLUMNS = ("t_s", "pressure_pa")
TEMPERATURE = "temperature_c"
TIME, PRESSURE, AIR_TEMPERATURE = range(3)  # columns of a table of samples

# Assumed, all of them.
LIMITS = CsvLimits(line_chars=1000, lines=19_999_999, early_rows=None)  # they bound the memory: four days at 50 Hz
RATE_HZ = (0.45, 55.0)  # 0.5 to 50 Hz with a margin of 10 %
BACK_SHARE = 0.01  # largest share of rows whose time goes back: damage, not another order of rows
LONGEST_GAP_S = 5.0  # a longer gap is reported: in it a storey can be climbed
MOST_GAPS = 3  # reported one by one
LOWEST_PA, HIGHEST_PA = 20_000.0, 120_000.0
COLDEST_C, WARMEST_C = -30.0, 45.0
# A barometer's first readings may be its reset value, or of a filter that still settles
SETTLING = 9  # samples: about a second of the SCP1000
FASTEST_PA_S = 120.0  # an express lift, 10 m/s
STEP_PA = 18.0  # that noise makes: six standard deviations of the SCP1000's high-speed mode
KELVIN_FROM = 200.0  # a median temperature above this number is likely in kelvins: no air is so hot in degC
PASCALS = (  # name, and pascals in it
    *((unit, factor) for unit, (quantity, factor) in UNITS.items() if quantity == "pressure"),
    ("a quarter of a pascal (SCP1000 counts)", 0.25),
)
USUAL_PA = (80_000.0, 108_000.0)  # pressures from about 2000 m of height down to the sea, to guess a unit


@dataclass(frozen=True, slots=True)
class Pressures:
    """Samples of a barometer (n,): possible pressures (Pa), times (s) ascending, temperatures (degC, NaN: unknown) or None."""

    t_s: Floats
    pressure_pa: Floats
    temperature_c: Floats | None = None


@dataclass(frozen=True, slots=True)
class PressureRecord:
    """`samples`, and `notes` on rows that were skipped and on gaps, a line each."""

    samples: Pressures
    notes: tuple[str, ...]


def load_pressures(path: Path | str, naming: Naming = OWN) -> PressureRecord:
    """Samples of a CSV file or a bag; raises EchostepError that names the file, the line and the field."""
    if is_bag(Path(path)):
        rows, notes = read_bag(Path(path), FLUID_PRESSURE, "pressure", naming)
        with faults_of(path):
            return _checked(np.insert(rows, AIR_TEMPERATURE, np.nan, axis=1), np.arange(1, len(rows) + 1), notes)
    return open_samples(path, lambda file: _checked(*_table(lines_of(file, LIMITS), naming)))


def _table(lines: Iterator[str], naming: Naming) -> tuple[Floats, Ints, tuple[str, ...]]:
    """Time, pressure and temperature (n, 3) in s, Pa, degC, NaN where there is no number; the line number of each row (n,); where they come from."""
    head = read_header(lines, naming)
    header, wanted = head.names, (*COLUMNS, TEMPERATURE)
    if missing := [name for name in COLUMNS if name not in header]:
        raise ValueError(
            f"line 1: no column {', '.join(missing)}; the first line must name t_s,pressure_pa[,temperature_c]{ADVICE}"
        )
    table = head.table(lines, wanted, len(COLUMNS), LIMITS)
    return table.values, table.line, head.notes


def _checked(table: Floats, lines: Ints, source: tuple[str, ...]) -> PressureRecord:
    """The usable samples of a table (n, 3) with line numbers (n,); raises ValueError when too few are usable, or when the unit is wrong."""
    table, lines, notes = _usable_rows(table, lines)
    rate = 1.0 / float(np.median(np.diff(table[:, TIME]))) if len(table) > 1 else 0.0
    if wrong := rate_complaint(
        rate, RATE_HZ, "two seconds between samples are the most", "average them down to 50 or fewer"
    ):
        raise ValueError(wrong)
    notes += _gap_notes(table[:, TIME], lines)
    if np.ptp(table[:, PRESSURE]) == 0.0:
        raise ValueError("pressure_pa never changes: is the sensor read?")
    temperature, more = _temperatures(table[:, AIR_TEMPERATURE], lines)
    return PressureRecord(Pressures(table[:, TIME], table[:, PRESSURE], temperature), (*source, *notes, *more))


def _usable_rows(table: Floats, lines: Ints) -> tuple[Floats, Ints, tuple[str, ...]]:
    """Rows with a possible pressure and increasing times, their line numbers, and notes on the rows left out."""
    whole: Bools = np.asarray(np.isfinite(table[:, : len(COLUMNS)]).all(axis=1))
    if not whole.all() and (~whole).mean() > MOST_BAD:
        field, share = COLUMNS[int(math.isfinite(table[~whole][0, TIME]))], 100 * (~whole).mean()
        raise ValueError(f"line {lines[~whole][0]}: no number in {field}, as in {share:.0f} % of the rows")
    notes = _note(~whole, lines, "without a number in t_s or pressure_pa: skipped")
    table, lines = table[whole], lines[whole]
    if len(table) < 2:
        raise ValueError("no samples: two rows with numbers at least are needed")
    _check_unit(table[:, PRESSURE], lines)
    possible = (table[:, PRESSURE] >= LOWEST_PA) & (table[:, PRESSURE] <= HIGHEST_PA)
    notes += _note(~possible, lines, f"with pressure_pa outside of {LOWEST_PA:.0f} to {HIGHEST_PA:.0f} Pa: skipped")
    table, lines = table[possible], lines[possible]
    again = np.concatenate([[False], np.diff(table[:, TIME]) == 0.0])
    notes += _note(again, lines, "with the t_s of the row before: skipped")
    table, lines = table[~again], lines[~again]
    back = np.flatnonzero(np.diff(table[:, TIME]) < 0.0)
    if len(back) > max(1.0, BACK_SHARE * len(table)):
        raise ValueError(
            f"line {lines[back[0] + 1]}: t_s does not advance, as in {len(back)} rows: sort the rows by t_s, one recording in a file"
        )
    later = np.concatenate([[True], table[1:, TIME] > np.maximum.accumulate(table[:, TIME])[:-1]])
    notes += _note(~later, lines, "not later than the row before: skipped")
    table, lines = table[later], lines[later]
    early = np.arange(len(table)) < unsettled(table[:, TIME], table[:, PRESSURE])
    notes += _note(early, lines, "before the barometer had settled, as its reset value: skipped")
    return table[~early], lines[~early], notes


def unsettled(t_s: Floats, pressure_pa: Floats) -> int:
    """Number of first samples that are farther from the samples after them than any lift gets in that time; SETTLING / 2 at most."""
    for k in range(SETTLING // 2 + 1):
        after = slice(k + 1, k + 1 + SETTLING)
        if len(t_s[after]) < SETTLING:
            return k
        off_pa = abs(pressure_pa[k] - float(np.median(pressure_pa[after])))
        if off_pa <= STEP_PA + FASTEST_PA_S * (float(np.median(t_s[after])) - t_s[k]):
            return k
    return SETTLING // 2 + 1


def _gap_notes(t_s: Floats, lines: Ints) -> tuple[str, ...]:
    """Notes on the first long gaps between the times (n,)."""
    gaps = np.flatnonzero(np.diff(t_s) > LONGEST_GAP_S)
    return tuple(
        f"line {lines[k + 1]}: {t_s[k + 1] - t_s[k]:.0f} s without a sample: judged by the pressure before and after"
        for k in gaps[:MOST_GAPS]
    )


def _note(bad: Any, lines: Ints, what: str) -> tuple[str, ...]:
    """A note with the number of rows where `bad` (n,) is true and the line of the first; none without such rows."""
    return (f"{int(bad.sum())} rows {what} (first: line {lines[bad][0]})",) if bad.any() else ()


def _check_unit(pressure: Floats, lines: Ints) -> None:
    """Raise ValueError, with the likely unit, when the median pressure is not that of air in pascals."""
    middle, said = float(np.median(pressure)), f"line {lines[0]}: pressure_pa is {pressure[0]:g}"
    if LOWEST_PA <= middle <= HIGHEST_PA:
        return
    for unit, factor in PASCALS:
        if USUAL_PA[0] <= middle * factor <= USUAL_PA[1]:
            option = f", or say --units {unit}" if unit in UNITS else ""
            raise ValueError(f"{said}: is it in {unit}? multiply it by {factor:g} to have pascals{option}")
    raise ValueError(f"{said}, not the pressure of air: pascals are expected, about 100000")


def _temperatures(column: Floats, lines: Ints) -> tuple[Floats | None, tuple[str, ...]]:
    """The temperatures (n,), None when the column has no number; a note when values are outside of the possible range."""
    known = np.isfinite(column)
    if not known.any():
        return None, ()
    strange = known & ~((column >= COLDEST_C) & (column <= WARMEST_C))
    if not strange.any():
        return column, ()
    note = f"{int(strange.sum())} temperature_c outside of {COLDEST_C:.0f} to {WARMEST_C:.0f} degC: ignored (first: line {lines[strange][0]})"
    return column, (f"{note}; are they kelvins?" if float(np.median(column[known])) > KELVIN_FROM else note,)
