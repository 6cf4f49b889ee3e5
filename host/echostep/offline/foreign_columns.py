# SPDX-License-Identifier: MIT
"""Columns of CSV files as other programs name them, and their units.

In: the first lines of a file, `--columns` and `--units`. Out: `Header`: the columns by this project's names, with the factors to SI units; an error
for names and units that are not known. Owns the table of the loggers that are recognised without options.

Sources of the table: NGIMU: short_walk.csv of github.com/xioTechnologies/Gait-Tracking. x-IMU3: Inertial.csv in the examples of
github.com/xioTechnologies/x-IMU3-CSV. phyphox: titles of the columns in public scripts that read its exports. Sensor Logger: UNITS.md of
github.com/tszheichoi/awesome-sensor-logger. MT Manager: text exports in a test of opensim-core's reader, and in [Voisard 2025].
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.offline.csv_table import column_of, header_of

# Quantity and factor to the SI unit of each unit; standard gravity [CGPM 1901].
UNITS = {
    "s": ("time", 1.0), "ms": ("time", 1e-3), "us": ("time", 1e-6), "ns": ("time", 1e-9),
    "m/s2": ("force", 1.0), "g": ("force", 9.80665), "mg": ("force", 9.80665e-3),
    "rad/s": ("rate", 1.0), "deg/s": ("rate", np.pi / 180.0),
    "rad": ("angle", 1.0), "deg": ("angle", np.pi / 180.0),
    "Pa": ("pressure", 1.0), "hPa": ("pressure", 100.0), "kPa": ("pressure", 1000.0),
}  # fmt: skip
QUANTITIES = {"t_s": "time", "pressure_pa": "pressure", "compass_rad": "angle"} | {
    f"a{axis}": "force" for axis in "xyz"
}
RATE = re.compile(r"g[xyz]|(thigh|shank)_[xyz]|\w+_rad_s")
COUNTER, COUNTER_PERIOD = "PacketCounter", 1 << 16  # of the samples, in exports of MT Manager
PREAMBLE = re.compile(r"//|Acquisition frequency:")  # lines above the names of the columns
COUNTS_HZ = re.compile(r"(?:Update Rate|Acquisition frequency): *([0-9.]+) *Hz")
ADVICE = "; other names: --columns OURS=THEIRS,...; other units: --units deg/s,g"  # for a file without the names
MOST_PREAMBLE = 50  # lines; assumed


def _axes(ours: str, theirs: str, letters: str = "XYZ") -> dict[str, str]:
    """Names of three axes, ours to theirs."""
    return {ours + axis: theirs.format(letter) for axis, letter in zip("xyz", letters, strict=True)}


XIO = _axes("a", "Accelerometer {} (g)") | _axes("g", "Gyroscope {} (deg/s)")
XIO_MAG = _axes("m", "Magnetometer {} (uT)")
PHYPHOX = _axes("a", "Acceleration {} (m/s^2)", "xyz") | _axes("g", "Gyroscope {} (rad/s)", "xyz")
XSENS = _axes("a", "Acc_{}") | _axes("g", "Gyr_{}")
LOGGERS: tuple[tuple[str, dict[str, str], dict[str, str], dict[str, str]], ...] = (
    # Name, columns that it has, columns that it may have (both ours to theirs), units that the names do not hold.
    ("NGIMU", {"t_s": "Time (s)"} | XIO, XIO_MAG, {}),
    ("x-IMU3", {"t_s": "Timestamp (us)"} | XIO, XIO_MAG, {}),
    ("phyphox", {"t_s": "Time (s)"} | PHYPHOX, {}, {}),
    ("phyphox", {"t_s": "Time (s)", "pressure_pa": "Pressure (hPa)"}, {}, {}),
    ("Sensor Logger", {"t_s": "seconds_elapsed", "pressure_pa": "pressure"}, {}, {"pressure": "hPa"}),
    ("MT Manager", {"t_s": COUNTER} | XSENS, _axes("m", "Mag_{}"), {}),
)


@dataclass(frozen=True, slots=True)
class Naming:
    """What the command line says: `columns`, names of this project to those of the file; `units`, of a quantity, by its name."""

    columns: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)


OWN = Naming()


@dataclass(frozen=True, slots=True)
class Header:
    """`names` of the columns, this project's where they are known; `line`: their line in the file; `factors` to SI by name.

    `counts_hz`: samples a second, where `t_s` is a counter of them. `notes`: which logger was recognised.
    """

    names: list[str]
    separator: str
    line: int
    factors: Mapping[str, float]
    counts_hz: float | None = None
    notes: tuple[str, ...] = ()

    def in_si(self, values: Floats, names: Sequence[str]) -> Floats:
        """Columns (n, k) of these names in SI units."""
        scaled: Floats = values * [self.factors.get(name, 1.0) for name in names]
        if self.counts_hz is not None:
            scaled[:, list(names).index("t_s")] = _since_first(values[:, list(names).index("t_s")]) / self.counts_hz
        return scaled


def parse_naming(columns: str | None, units: str | None) -> Naming:
    """The options `--columns OURS=THEIRS,...` and `--units UNIT,...`; raises EchostepError."""
    pairs = [pair.partition("=") for pair in columns.split(",")] if columns else []
    for ours, _, theirs in pairs:
        if not ours.strip() or not theirs.strip():
            raise EchostepError(f"--columns {columns}: pairs of names are expected, as t_s=time,gx=gyro_x")
    by_quantity: dict[str, str] = {}
    for unit in (text.strip() for text in units.split(",")) if units else ():
        if unit not in UNITS:
            raise EchostepError(f"--units {unit}: unknown; there are {', '.join(UNITS)}")
        if (quantity := UNITS[unit][0]) in by_quantity:
            raise EchostepError(f"--units {by_quantity[quantity]},{unit}: two units of one quantity")
        by_quantity[quantity] = unit
    return Naming({ours.strip(): theirs.strip() for ours, _, theirs in pairs}, by_quantity)


def read_header(lines: Iterator[str], naming: Naming = OWN) -> Header:
    """The names of the columns, taken from the lines with what stands above them; raises ValueError for names that are not there."""
    line, text, counts_hz = 1, next(lines, ""), None
    while PREAMBLE.match(text) and line < MOST_PREAMBLE:
        found = COUNTS_HZ.search(text)
        counts_hz = float(found[1]) if found else counts_hz
        line, text = line + 1, next(lines, "")
    theirs, separator = header_of(text)
    columns, units = dict(naming.columns), dict(naming.units)
    notes: tuple[str, ...] = ()
    if not columns and "t_s" not in theirs:
        columns, more, notes = _recognised(theirs)
        units = more | units
    is_counter = columns.get("t_s") == COUNTER
    if is_counter and not counts_hz:
        raise ValueError(
            f"{COUNTER} counts samples, and no line '// Update Rate: 100.0Hz' says how many there are a second"
        )
    names = _renamed(theirs, columns)
    factors = _factors(names, theirs, units)
    return Header(names, separator, line, factors, counts_hz if is_counter else None, notes)


def _recognised(theirs: list[str]) -> tuple[dict[str, str], dict[str, str], tuple[str, ...]]:
    """Columns, units and a note of the logger that names its columns so; empty for an unknown one."""
    for logger, has, may_have, units in LOGGERS:
        if set(has.values()) <= set(theirs):
            there = {ours: name for ours, name in may_have.items() if name in theirs}
            return has | there, units, (f"read as an export of {logger}",)
    return {}, {}, ()


def _renamed(theirs: list[str], columns: Mapping[str, str]) -> list[str]:
    """The names of a file's columns with those of this project in the place of theirs."""
    for ours, name in columns.items():
        if column_of(theirs, name) < 0:
            raise ValueError(f"--columns {ours}={name}: no column {name}; there are {', '.join(theirs)[:300]}")
    by_theirs = {name: ours for ours, name in columns.items()}
    return [by_theirs.get(name, "" if name in columns else name) for name in theirs]


def _factors(names: list[str], theirs: list[str], units: Mapping[str, str]) -> dict[str, float]:
    """Factors to SI by name: of the unit given for the quantity, else of the one in the brackets of the file's name."""
    factors: dict[str, float] = {}
    quantities = {quantity_of(name) for name in names}
    if unused := [unit for quantity, unit in units.items() if quantity not in quantities]:
        raise ValueError(f"--units {unused[0]}: no column has such a unit; there are {', '.join(theirs)[:300]}")
    for name, title in zip(names, theirs, strict=True):
        in_brackets = re.search(r"\(([^)]*)\)$", title)
        unit = units.get(quantity_of(name)) or (in_brackets[1].replace("^", "") if in_brackets else "")
        if unit in UNITS and UNITS[unit][0] == quantity_of(name):
            factors[name] = UNITS[unit][1]
    return factors


def quantity_of(name: str) -> str:
    """The quantity of a column by this project's name; empty for one of any unit."""
    name = name.removeprefix("other_")
    return QUANTITIES.get(name) or ("rate" if RATE.fullmatch(name) else "")


def _since_first(counter: Floats) -> Floats:
    """Samples since the first one, of a counter (n,) that wraps; NaN where there is no number."""
    counts = np.full(len(counter), np.nan)
    whole = np.isfinite(counter)
    if whole.any():
        unwrapped = np.unwrap(counter[whole], period=COUNTER_PERIOD)
        counts[whole] = unwrapped - unwrapped[0]
    return counts
