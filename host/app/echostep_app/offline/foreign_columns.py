# SPDX-License-Identifier: MIT
"""Columns of CSV files as other programs name them, and their units.

In: the first lines of a file, `--columns` and `--units`. Out: `Header`: the columns by this project's names, with the factors to SI units; an error
for names and units that are not known, with the options that would read them, if the titles allow. Owns the table of the loggers that are
recognised without options.

Sources of the table: NGIMU: short_walk.csv of github.com/xioTechnologies/Gait-Tracking. x-IMU3: Inertial.csv in the examples of
github.com/xioTechnologies/x-IMU3-CSV. phyphox: titles of the columns in public scripts that read its exports. Sensor Logger: UNITS.md of
github.com/tszheichoi/awesome-sensor-logger. MT Manager: text exports in a test of opensim-core's reader, and in [Voisard 2025]. Movella DOT: export
bei_D4CA6EF17860_20210830_170505.csv of a recording, in github.com/Allwillcome/XsensDot2Mtw4OpenSense: its times step by 8333 at 120 Hz, its sensor
at rest reads 9.65 and 0.2, which as rad/s would be a bias of 11 deg/s; the titles of the other modes: logger of the SDK for Android. SensorConnect
(MSCL): data of github.com/mtahakoroglu/gait-driven-inertial-navigation-dataset. gaitmap: example data of github.com/mad-lab-fau/gaitmap. SensorLog:
titles in public scripts; an iPhone's accelerations have the opposite sign [Apple, CMAccelerometerData: at rest -1 g upwards], which mirrors a track.
PicoQuake: docs/acquisition_data.md of github.com/PLab-SI/PicoQuake. OpenLog Artemis: its units in sparkfun/OpenLog_Artemis#15; the axes of its
magnetometer are others than those of its gyroscope [ICM-20948 data sheet, orientation of axes], so it is left out.
"""

from __future__ import annotations

import csv
import math
import re
import shlex
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice, zip_longest

import numpy as np

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.offline.csv_table import CsvLimits, column_of, header_of, is_comment, number_of, read_rows
from echostep.offline.header import Header
from echostep.offline.imu_csv import COLUMNS
from echostep.ports.imu_samples import RATE_RANGE_HZ, unit_of_times

# Quantity and factor to the SI unit of each unit; standard gravity [CGPM 1901].
UNITS = {
    "s": ("time", 1.0), "ms": ("time", 1e-3), "us": ("time", 1e-6), "ns": ("time", 1e-9),
    "m/s2": ("force", 1.0), "g": ("force", 9.80665), "mg": ("force", 9.80665e-3), "-g": ("force", -9.80665),
    "rad/s": ("rate", 1.0), "deg/s": ("rate", np.pi / 180.0),
    "rad": ("angle", 1.0), "deg": ("angle", np.pi / 180.0),
    "Pa": ("pressure", 1.0), "hPa": ("pressure", 100.0), "kPa": ("pressure", 1000.0),
    "bar": ("pressure", 1e5), "mmHg": ("pressure", 133.322), "inHg": ("pressure", 3386.39),
}  # fmt: skip
QUANTITIES = {"t_s": "time", "pressure_pa": "pressure", "compass_rad": "angle"} | {
    f"a{axis}": "force" for axis in "xyz"
}
RATE = re.compile(r"g[xyz]|(thigh|shank)_[xyz]|\w+_rad_s")
COUNTER, COUNTER_PERIOD = "PacketCounter", 1 << 16  # of the samples, in exports of MT Manager
COUNTERS = re.compile(r"packetcounter|count|counter|sample(?:count|number|index)")  # of the samples, by _letters
# Microseconds in exports of Movella DOT, tenths of a millisecond in those of MT Manager
CLOCK, DOT_CLOCK_HZ, MT_CLOCK_HZ, CLOCK_PERIOD = "SampleTimeFine", 1e6, 1e4, 1 << 32
DOT = "DeviceTag:"  # begins a line above the names of the columns
SENSORS = ",left_sensor,"  # begins a line above the names of the columns of gaitmap
# Lines above the names of the columns: of gaitmap, MT Manager, Excel and Movella DOT, and all of one cell
PREAMBLE = re.compile(rf"{SENSORS}|//|\"?sep=|\w[\w ]*: *,|[^,;\t]*\n")
COUNTS_HZ = re.compile(r"(?:Update Rate: *|Acquisition frequency: *|data_rate = )([0-9.]+) *Hz")
ADVICE = "; other names: --columns OURS=THEIRS,...; other units: --units deg/s,g"  # for a file without the names
MOST_PREAMBLE, BEGIN = 50, 50  # lines above the names, and of numbers that are read to know the units; assumed


def _axes(ours: str, theirs: str, letters: str = "XYZ") -> dict[str, str]:
    """Names of three axes, ours to theirs."""
    return {ours + axis: theirs.format(letter) for axis, letter in zip("xyz", letters, strict=True)}


XIO = _axes("a", "Accelerometer {} (g)") | _axes("g", "Gyroscope {} (deg/s)")
XIO_MAG = _axes("m", "Magnetometer {} (uT)")
PHYPHOX = _axes("a", "Acceleration {} (m/s^2)", "xyz") | _axes("g", "Gyroscope {} (rad/s)", "xyz")
XSENS = _axes("a", "Acc_{}") | _axes("g", "Gyr_{}")
XSENS_MAG = _axes("m", "Mag_{}")
GAITMAP = _axes("a", "left_sensor.acc_{}", "xyz") | _axes("g", "left_sensor.gyr_{}", "xyz")
SENSORLOG = {"t_s": "accelerometerTimestamp_sinceReboot(s)"} | _axes("a", "accelerometerAcceleration{}(G)")
SENSORLOG_GYROS = ("gyroRotation{}(rad/s)", "motionRotationRate{}(rad/s)")
PICOQUAKE = {"t_s": "count"} | _axes("a", "a_{}", "xyz") | _axes("g", "g_{}", "xyz")
ARTEMIS = {"t_s": "rtcTime"} | _axes("a", "a{}") | _axes("g", "g{}")
MSCL = _axes("a", "scaledAccel{}") | _axes("g", "scaledGyro{}")


@dataclass(frozen=True, slots=True)
class Logger:
    """Columns that its files have and may have (ours to theirs), units that the names do not hold, how a line `above` the names begins."""

    name: str
    has: dict[str, str]
    may_have: dict[str, str] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    above: str = ""


LOGGERS = (
    Logger("NGIMU", {"t_s": "Time (s)"} | XIO, XIO_MAG),
    Logger("x-IMU3", {"t_s": "Timestamp (us)"} | XIO, XIO_MAG),
    Logger("phyphox", {"t_s": "Time (s)"} | PHYPHOX),
    Logger("phyphox", {"t_s": "Time (s)", "pressure_pa": "Pressure (hPa)"}),
    Logger("Sensor Logger", {"t_s": "seconds_elapsed", "pressure_pa": "pressure"}, units={"pressure": "hPa"}),
    Logger("Movella DOT", {"t_s": CLOCK} | XSENS, XSENS_MAG, {"rate": "deg/s"}, DOT),
    *(Logger("MT Manager", {"t_s": counter} | XSENS, XSENS_MAG) for counter in (COUNTER, CLOCK)),
    *(Logger("SensorLog", SENSORLOG | _axes("g", gyro), units={"force": "-g"}) for gyro in SENSORLOG_GYROS),
    Logger("SensorConnect", {"t_s": "Time"} | MSCL, _axes("m", "scaledMag{}"), {"force": "g"}),
    Logger("PicoQuake", PICOQUAKE, units={"force": "g", "rate": "deg/s"}, above="# Config: data_rate"),
    Logger("OpenLog Artemis", ARTEMIS, units={"force": "mg", "rate": "deg/s"}),
    Logger("gaitmap, its left sensor", {"t_s": "index"} | GAITMAP, units={"rate": "deg/s"}),
)


@dataclass(frozen=True, slots=True)
class Naming:
    """Options of the command line: `columns`, names of this project to the file's names; `units`, of a quantity, by its name."""

    columns: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)


OWN = Naming()


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
    """The names of the columns, taken from the lines with all lines above them; raises ValueError for missing names."""
    above, text = _preamble(lines)
    begin, line, (theirs, separator) = [*islice(lines, BEGIN)], len(above) + 1, _titles(text, above)
    if (titled := _titled(theirs, begin[:1], separator)) != theirs:
        begin, line = begin[1:], line + 1
    columns, units = dict(naming.columns), dict(naming.units)
    notes: tuple[str, ...] = ()
    names = [_own(title) for title in theirs]

    def first(name: str) -> Floats:
        return read_rows(iter(begin), (theirs, separator), [theirs.index(name)], 0, CsvLimits(early_rows=None)).values

    if not above and separator == "," and CLOCK in theirs:
        above = [DOT]  # which its program leaves out on request; MT Manager separates by tabs
    if not columns and "t_s" not in names:
        columns, more, notes = _recognised(theirs, above)
        units = more | units
    counted = any(map(COUNTS_HZ.search, above))
    clocked = CLOCK in theirs and not (begin and np.isnan(first(CLOCK)).all())
    if columns.get("t_s") == COUNTER and clocked and not counted:
        columns["t_s"] = CLOCK
    counts_hz, period = _counter("" if "time" in units else columns.get("t_s", ""), above, clocked=CLOCK in theirs)
    names = ["t_s" if name == "time" and "t_s" not in names else name for name in names]
    names = _renamed(theirs, columns) if columns else names
    factors = factors_of(names, titled, units)
    advice = ("" if naming.columns else proposal(theirs, titled, first, counted=counted)) or _kinds(begin, separator)
    return Header(names, separator, line, factors, counts_hz, period, notes, advice, tuple(begin))


def _kinds(begin: list[str], separator: str) -> str:
    """The advice for lines that begin with the kind of their numbers, else that for names that are not known."""
    kinds = list(dict.fromkeys(line.partition(separator)[0].strip() for line in begin))
    if len(kinds) < 2 or any(map(math.isfinite, map(number_of, kinds))):
        return ADVICE
    return f"; its lines begin with the kind of their numbers ({', '.join(kinds)[:100]}): write those of one kind into a file, below their names"


def _titled(theirs: list[str], row: list[str], separator: str) -> list[str]:
    """Titles of the columns with their units, if the first row beneath them is one of units."""
    cells = [cell.strip() for cell in next(csv.reader(row, delimiter=separator), [])]
    is_row = any(map(_unit, cells)) and all(np.isnan(number_of(cell)) for cell in cells)
    pairs = zip_longest(theirs, cells[: len(theirs)], fillvalue="")
    return [f"{title} [{unit}]" if is_row and unit else title for title, unit in pairs]


def _preamble(lines: Iterator[str]) -> tuple[list[str], str]:
    """The lines above the names of the columns, and the line of the names."""
    above, text = list[str](), next(lines, "")
    while (PREAMBLE.match(text) or is_comment(text)) and len(above) < MOST_PREAMBLE:
        above.append(text)
        text = next(lines, "")
    return above, text


def _titles(text: str, above: list[str]) -> tuple[list[str], str]:
    """Titles of the columns, and the separator: without MSCL's name of the device, with gaitmap's name of the sensor from the line above."""
    titles, separator = header_of(text)
    titles = [title.rpartition(":")[2] if title.startswith("inertial-") else title for title in titles]
    if above and above[-1].startswith(SENSORS):
        sensors, _ = header_of(above[-1])
        titles = [
            f"{sensor}.{title}" if sensor else title or "index" for sensor, title in zip(sensors, titles, strict=False)
        ]
    return titles, separator


def _counter(name: str, above: list[str], *, clocked: bool) -> tuple[float | None, int]:
    """Counts a second and period of a column that counts samples or ticks; (None, ...) for a column of times."""
    if name == CLOCK:
        return DOT_CLOCK_HZ if _has(above, DOT) else MT_CLOCK_HZ, CLOCK_PERIOD
    if not COUNTERS.fullmatch(_letters(name)):
        return None, COUNTER_PERIOD
    rates = [float(found[1]) for line in above if (found := COUNTS_HZ.search(line))]
    if not rates or not rates[-1]:
        raise ValueError(f"{_uncounted(name)}{f' ({CLOCK} is empty)' if clocked else ''}")
    return rates[-1], COUNTER_PERIOD


def _uncounted(name: str) -> str:
    """Message for a column that counts samples at an unknown rate."""
    return f"{name} counts samples, and no line '// Update Rate: 100.0Hz' says how many a second: add it above the names of the columns"


def _has(above: list[str], begin: str) -> bool:
    """Whether one of the lines begins with `begin`."""
    return any(line.startswith(begin) for line in above)


def _recognised(theirs: list[str], above: list[str]) -> tuple[dict[str, str], dict[str, str], tuple[str, ...]]:
    """Columns, units and a note of the logger that uses these names; empty for an unknown one."""
    for logger in LOGGERS:
        if set(logger.has.values()) <= set(theirs) and (not logger.above or _has(above, logger.above)):
            there = {ours: name for ours, name in logger.may_have.items() if name in theirs}
            return logger.has | there, logger.units, (f"read as an export of {logger.name}",)
    if _has(above, DOT):
        raise ValueError(
            f"an export of Movella DOT without {CLOCK}, {', '.join(XSENS.values())}: record in a mode that has them, as "
            "rate quantities or custom mode 5 (FreeAcc is without gravity, which a track needs)"
        )
    return {}, {}, ()


def _own(title: str) -> str:
    """The name without the unit of a title like `ax (g)`, t_s for `t (ms)`; any other title unchanged."""
    name = BRACKETS.sub("", title).rstrip()
    name = "t_s" if name == "t" else name
    return name if quantity_of(name) else title


def _renamed(theirs: list[str], columns: Mapping[str, str]) -> list[str]:
    """The names of a file's columns with this project's names in place of theirs."""
    for ours, name in columns.items():
        if column_of(theirs, name) < 0:
            raise ValueError(f"--columns {ours}={name}: no column {name}; there are {', '.join(theirs)[:300]}")
    by_theirs = {name: ours for ours, name in columns.items()}
    return [by_theirs.get(name, "" if name in columns else name) for name in theirs]


def factors_of(names: list[str], theirs: list[str], units: Mapping[str, str]) -> dict[str, float]:
    """Factors to SI by name: of the unit given for the quantity, else in the brackets of the file's name; raises ValueError for an unknown one."""
    factors: dict[str, float] = {}
    quantities = {quantity_of(name) for name in names}
    if unused := [unit for quantity, unit in units.items() if quantity not in quantities]:
        raise ValueError(f"--units {unused[0]}: no column has such a unit; there are {', '.join(theirs)[:300]}")
    for name, title in zip(names, theirs, strict=True):
        quantity, stated = quantity_of(name), BRACKETS.search(title)
        if unit := units.get(quantity) or (quantity and stated and stated[1].strip()):
            unit = unit if unit in UNITS else _unit(unit) or unit
            if UNITS.get(unit, ("",))[0] != quantity:
                known = [each for each, (measured, _) in UNITS.items() if measured == quantity]
                raise ValueError(f"{title}: its unit is none of {', '.join(known)}: convert the column, or say --units")
            factors[name] = UNITS[unit][1]
    return factors


def quantity_of(name: str) -> str:
    """The quantity of a column by this project's name; empty for a column of any unit."""
    name = name.removeprefix("other_")
    return QUANTITIES.get(name) or ("rate" if RATE.fullmatch(name) else "")


SPELLINGS = {
    "s": "s sec seconds", "ms": "ms msec milliseconds", "us": "us µs μs microseconds", "ns": "ns nanoseconds",
    "m/s2": "m/s2 m/s^2 m/s² m/s/s mps2 m_s2 ms2 ms^-2", "g": "g", "mg": "mg", "hPa": "hpa mbar",
    "rad/s": "rad/s rad/sec rad_s rads rads^-1", "deg/s": "deg/s deg/sec °/s dps deg_s degs^-1",
}  # fmt: skip
BY_SPELLING = {spelling: unit for unit, spellings in SPELLINGS.items() for spelling in spellings.split()}
SI = ("s", "m/s2", "rad/s")
BRACKETS = re.compile(r"[(\[](?!\d+[)\]])((?:[^()\[\]]|\([^()]*\))*)[)\]]$")  # a unit that ends a title, no index
BEFORE = r"(?:imu|field|sensor|raw)*"  # words that change nothing
KINDS = {  # beginning of this project's name, and what it is called without signs between the words
    "t_s": r"t|time|times|timestamps?|timestampunix|timesec|seconds|secondselapsed|headerstamp",
    "a": r"a|acc|accel|accelero|acceleration|accelerometer|accelwr",
    "g": r"g|gyr|gyro|gyroscope|w|omega|angvel|angularvelocity|angularrate|rotationrate",
}
ROS = r"linearacceleration"  # with gravity, in m/s2, beside angular_velocity [sensor_msgs/Imu]
FREE = re.compile(r"(?:lin|linear|free|user)acc\w*")
LOW_NOISE = re.compile(r"\w*accelln[xyz]\w*")  # of the two accelerometers of a Shimmer3, beside the wide range's


def proposal(titles: Sequence[str], titled: Sequence[str], first: Callable[[str], Floats], *, counted: bool) -> str:
    """The options for a file with these columns, or why none would do, as the end of an error; empty where the titles are not certain.

    `titled`: with the units of the row beneath. `first`: the first numbers of a column. `counted`: whether a line states the rate of a counter.
    """
    parted = [_parted(title) for title in titled]
    common = _common([name for name, _ in parted])
    ros = any("angularvelocity" in _letters(title) for title in titles)
    stamp = next((title for title in titles if _letters(title).endswith("headerstamp")), "")
    free = next((title for title in titles if FREE.match(_letters(title))), "")
    if free and not any(_ours(name, ros, common) == "ax" for name, _ in parted):
        return f"; {free} is without gravity, which a track needs: record the accelerometer itself"
    found: dict[str, tuple[str, str]] = {}
    for title, (name, unit) in zip(titles, parted, strict=True):
        ours = _ours(name, ros, common)
        if not ours or (ours == "t_s" and title != (stamp or title)):
            continue  # the time of arrival, beside the sensor's own
        if ours in found or "," in title or unit is None:
            return ""
        found[ours] = title, unit
    if not set(COLUMNS[1:]) <= found.keys():
        return ""
    advice = ""
    if "t_s" not in found:
        found["t_s"] = next((title for title in titles if COUNTERS.fullmatch(_letters(title))), ""), ""
        if not found["t_s"][0]:
            return "; no column of times: add t_s in seconds, or one named count that counts the samples"
        advice = "" if counted else f"; {_uncounted(found['t_s'][0])}"
    elif not found["t_s"][1]:
        found["t_s"] = found["t_s"][0], _unit_of(first(found["t_s"][0]))
    if other := next((title for title in titles if LOW_NOISE.fullmatch(_letters(title))), ""):
        advice += f"; there are two accelerometers: a foot exceeds the range of the low-noise one, {other}"
    units = {name: {found[name + axis][1] for axis in "xyz"} for name in "ag"} | {"t": {found["t_s"][1]}}
    if any(len(each) > 1 for each in units.values()):
        return ""
    given = [unit for each in units.values() for unit in each if unit and unit not in SI]
    columns = shlex.quote(",".join(f"{ours}={found[ours][0]}" for ours in COLUMNS))
    return f"{advice}; by their titles: --columns {columns}{' --units ' + ','.join(given) if given else ''}"


def _unit_of(times: Floats) -> str:
    """The unit of the first times (n, 1) of a file by their rate; empty for a rate of no unit."""
    times = times[np.isfinite(times)]
    rate = (len(times) - 1) / max(float(np.ptp(times)), 1e-12) if len(times) > 1 else 0.0
    return unit_of_times(rate, RATE_RANGE_HZ)[1]


def _common(names: Sequence[str]) -> set[str]:
    """Words that the titles of all axes have: the name of the device, or of a frame."""
    axes = [words for name in names if (words := set(_words(name))) & set("xyz")]
    kinds = re.compile("[xyz]|" + "|".join(KINDS.values()))
    return {word for word in set.intersection(*axes) if not kinds.fullmatch(word)} if axes else set()


def _unit(text: str) -> str | None:
    """The unit of this spelling, None for one that is not known."""
    return BY_SPELLING.get(re.sub(r"[ ()]", "", text.casefold()))


def time_unit(title: str) -> str:
    """The unit of time in brackets that ends a title; empty for another one, and for none."""
    unit = _parted(title)[1] or "" if BRACKETS.search(title) else ""
    return unit if UNITS.get(unit, ("",))[0] == "time" else ""


def _words(text: str) -> list[str]:
    """Small letters and digits, by the signs between them."""
    return re.split(r"[^a-z0-9]+", text.casefold())


def _letters(text: str) -> str:
    """Small letters and digits alone."""
    return "".join(_words(text))


def _parted(title: str) -> tuple[str, str | None]:
    """Name and unit of a title, "" where it states none, None for a unit that is not known."""
    if bracket := BRACKETS.search(title):
        return title[: bracket.start()], _unit(bracket[1])
    for spelling, unit in sorted(BY_SPELLING.items(), key=lambda each: -len(each[0])):
        if re.search(rf"[xyz]?[_ .]{re.escape(spelling)}$", title, re.I) and title.casefold() != "t_s":
            return title[: -len(spelling)], unit
    return title, ""


def _ours(name: str, ros: bool, common: set[str]) -> str:
    """A column by the name that this project has for it, without the words `common` to all titles; empty for any other."""
    letters = "".join(word for word in _words(name) if word not in common)
    if re.fullmatch(BEFORE + f"(?:{KINDS['t_s']})", letters):
        return "t_s"
    for ours in "ag":
        kind = KINDS[ours] + (f"|{ROS}" if ros and ours == "a" else "")
        found = re.fullmatch(f"{BEFORE}(?:(?:{kind})([xyz])|([xyz])(?:{kind}))", letters)
        if found:
            return ours + (found[1] or found[2])
    return ""
