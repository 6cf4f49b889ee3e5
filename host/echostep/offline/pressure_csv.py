"""A recorded barometer as a CSV file: samples checked and read, the floors written.

In: columns `t_s,pressure_pa[,temperature_c]`, 0.5 to 50 Hz. Out: `Pressures` with notes on what was mended, or an EchostepError that names file,
line and field; the floors as CSV. Owns nothing.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from echostep.arrays import Bools, Floats, Ints
from echostep.barometer.altitude import COLDEST_C, HIGHEST_PA, LOWEST_PA, WARMEST_C, Pressures
from echostep.barometer.floor_filter import Floors
from echostep.errors import EchostepError
from echostep.offline.csv_table import MOST_BAD, CsvLimits, header_of, lines_of, open_samples, read_rows

COLUMNS = ("t_s", "pressure_pa")
TEMPERATURE = "temperature_c"
FLOOR_COLUMNS = ("t_s", "floor", "probability", "height_m")
LIMITS = CsvLimits(line_chars=1000, lines=19_999_999, early_rows=None)
RATE_HZ = (0.45, 55.0)
BACK_SHARE = 0.01
LONGEST_GAP_S = 5.0
UNITS = (
    ("hPa", 100.0),
    ("kPa", 1000.0),
    ("bar", 1e5),
    ("mmHg", 133.322),
    ("inHg", 3386.39),
    ("a quarter of a pascal (SCP1000 counts)", 0.25),
)
SEA_PA = (80_000.0, 108_000.0)  # where people live, to guess a unit


@dataclass(frozen=True, slots=True)
class PressureRecord:
    """`samples`, and `notes`: what was found and mended, a line each."""

    samples: Pressures
    notes: tuple[str, ...]


def load_pressures(path: Path | str) -> PressureRecord:
    """Samples of a CSV file; raises EchostepError that names the file, the line and the field."""
    return open_samples(path, lambda file: _checked(*_table(lines_of(file, LIMITS))))


def _table(lines: Iterator[str]) -> tuple[Floats, Ints]:
    """Columns (n, 3), NaN where there is no number, and the line of each row."""
    header, separator = header_of(next(lines, ""))
    if missing := [name for name in COLUMNS if name not in header]:
        raise ValueError(
            f"line 1: no column {', '.join(missing)}; the first line must name t_s,pressure_pa[,temperature_c]"
        )
    if twice := [name for name in (*COLUMNS, TEMPERATURE) if header.count(name) > 1]:
        raise ValueError(f"line 1: column {twice[0]} is there twice")
    columns = [header.index(name) if name in header else -1 for name in (*COLUMNS, TEMPERATURE)]
    table = read_rows(lines, separator, columns, len(COLUMNS), LIMITS)
    if len(table.line) < 2:
        raise ValueError("no samples: two rows at least are needed under the names of the columns")
    return table.values, table.line


def _checked(table: Floats, lines: Ints) -> PressureRecord:
    """The rows that are samples; raises ValueError when too few are, or when they are something else."""
    whole: Bools = np.asarray(np.isfinite(table[:, :2]).all(axis=1))
    if not whole.all() and (~whole).mean() > MOST_BAD:
        raise ValueError(
            f"line {lines[~whole][0]}: no number in {_field(table[~whole][0])}, as in {100 * (~whole).mean():.0f} % of the rows"
        )
    notes = _note(~whole, lines, "without a number in t_s or pressure_pa: skipped")
    table, lines = table[whole], lines[whole]
    if len(table) < 2:
        raise ValueError("no samples: two rows with numbers at least are needed")
    _check_unit(table[:, 1], lines)
    possible = (table[:, 1] >= LOWEST_PA) & (table[:, 1] <= HIGHEST_PA)
    notes += _note(~possible, lines, f"with pressure_pa outside of {LOWEST_PA:.0f} to {HIGHEST_PA:.0f} Pa: skipped")
    table, lines = table[possible], lines[possible]
    again = np.concatenate([[False], np.diff(table[:, 0]) == 0.0])
    notes += _note(again, lines, "with the t_s of the row before: skipped")
    table, lines = table[~again], lines[~again]
    back = np.flatnonzero(np.diff(table[:, 0]) < 0.0)
    if len(back) > max(1.0, BACK_SHARE * len(table)):
        raise ValueError(
            f"line {lines[back[0] + 1]}: t_s does not advance, as in {len(back)} rows: sort the rows by t_s, one recording in a file"
        )
    later = np.concatenate([[True], table[1:, 0] > np.maximum.accumulate(table[:, 0])[:-1]])
    notes += _note(~later, lines, "not later than the row before: skipped")
    table, lines = table[later], lines[later]
    _check_rate(table[:, 0])
    gaps = np.flatnonzero(np.diff(table[:, 0]) > LONGEST_GAP_S)
    notes += tuple(
        f"line {lines[k + 1]}: {table[k + 1, 0] - table[k, 0]:.0f} s without a sample: judged by the pressure before and after"
        for k in gaps[:3]
    )
    if np.ptp(table[:, 1]) == 0.0:
        raise ValueError("pressure_pa never changes: is the sensor read?")
    temperature, more = _temperatures(table[:, 2], lines)
    return PressureRecord(Pressures(table[:, 0], table[:, 1], temperature), (*notes, *more))


def _field(row: Floats) -> str:
    return COLUMNS[0] if not math.isfinite(row[0]) else COLUMNS[1]


def _note(bad: Any, lines: Ints, what: str) -> tuple[str, ...]:
    return (f"{int(bad.sum())} rows {what} (first: line {lines[bad][0]})",) if bad.any() else ()


def _check_unit(pressure: Floats, lines: Ints) -> None:
    middle = float(np.median(pressure))
    if LOWEST_PA <= middle <= HIGHEST_PA:
        return
    for unit, factor in UNITS:
        if SEA_PA[0] <= middle * factor <= SEA_PA[1]:
            raise ValueError(
                f"line {lines[0]}: pressure_pa is {pressure[0]:g}: is it in {unit}? multiply it by {factor:g} to have pascals"
            )
    raise ValueError(
        f"line {lines[0]}: pressure_pa is {pressure[0]:g}, not the pressure of air: pascals are expected, about 100000"
    )


def _check_rate(t_s: Floats) -> None:
    rate = 1.0 / float(np.median(np.diff(t_s))) if len(t_s) > 1 else 0.0
    if RATE_HZ[0] <= rate <= RATE_HZ[1]:
        return
    for unit, factor in (("milliseconds", 1e3), ("microseconds", 1e6), ("nanoseconds", 1e9)):
        if RATE_HZ[0] <= rate * factor <= RATE_HZ[1]:
            raise ValueError(
                f"t_s gives {rate:.3g} samples a second: is it in {unit}? divide it by {factor:.0f} to have seconds"
            )
    advice = "two seconds between samples are the most" if rate < RATE_HZ[0] else "average them down to 50 or fewer"
    raise ValueError(f"t_s gives {rate:.3g} samples a second: is it in seconds? {advice}")


def _temperatures(column: Floats, lines: Ints) -> tuple[Floats | None, tuple[str, ...]]:
    """The column, None when it is of no use; a note when it is strange."""
    known = np.isfinite(column)
    if not known.any():
        return None, ()
    strange = known & ~((column >= COLDEST_C) & (column <= WARMEST_C))
    if not strange.any():
        return column, ()
    note = f"{int(strange.sum())} temperature_c outside of {COLDEST_C:.0f} to {WARMEST_C:.0f} degC: not believed (first: line {lines[strange][0]})"
    return column, (f"{note}; are they kelvins?" if float(np.median(column[known])) > 200.0 else note,)


def write_floors(path: Path | str, floors: Floors) -> None:
    """`t_s,floor,probability,height_m` for every sample; raises EchostepError when the file cannot be written."""
    best = floors.probability[np.arange(len(floors.t_s)), floors.floor]
    try:
        with Path(path).open("w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(FLOOR_COLUMNS)
            writer.writerows(
                [f"{t:.6f}", k, f"{p:.4f}", f"{h:.3f}"]
                for t, k, p, h in zip(
                    floors.t_s.tolist(), floors.floor.tolist(), best.tolist(), floors.height_m.tolist(), strict=True
                )
            )
    except OSError as error:
        raise EchostepError(f"{path}: cannot write the floors: {error.strerror}") from error
