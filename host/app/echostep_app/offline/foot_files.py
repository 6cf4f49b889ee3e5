# SPDX-License-Identifier: MIT
"""A foot IMU's recording as other programs keep it: a table, a folder or zip of tables, a MAT file, an MVNX file, a bag.

In: a path. Out: `Imu`, or an EchostepError that names the file and its fault (gliding, too). Owns nothing.

MAT: the names of github.com/utiasSTARS/pyshoe and of its published recordings. MVNX: sensorFreeAcceleration is without gravity and
in the global frame, as sensorOrientation gives it [MVN User Manual, MVNX]. Folders: UNITS.md, and CROSSPLATFORM.md for the signs of iOS, of
github.com/tszheichoi/awesome-sensor-logger; the sessions in github.com/xioTechnologies/x-IMU3-CSV; exports of phyphox.
"""

from __future__ import annotations

import csv
import re
import zipfile
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TextIO
from xml.etree.ElementTree import Element, ParseError, iterparse

import numpy as np

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.foot.steps import Track
from echostep.offline.csv_table import GREATEST, header_of, lines_of, open_samples
from echostep.offline.imu_checks import NEEDED
from echostep.offline.imu_csv import LIMITS, Imu, imu_of, load_imu
from echostep_app.extras import require
from echostep_app.offline.foreign_columns import OWN, Naming, read_header, time_unit
from echostep_app.offline.ros_bag import IMU, is_bag, read_bag
from echostep_app.printing.lines import as_error, faults_of

SESSIONS = ("inertial", "sensors", "raw data")  # files of one session that have both sensors: x-IMU3, NGIMU, phyphox
TIMES = "t_s", "seconds_elapsed"  # in a table of one sensor; or any title with a unit of time
MAT_IMU, MAT_TIME = ("imu_data", "imu"), ("timestamps_all", "timestamps", "ts", "t_s")
GRAVITY_M_S2 = np.array([0.0, 0.0, 9.80665])  # specific force at rest, z up
MOST_BYTES = 1 << 30  # of the tables of a zip, and of a MAT or MVNX file; assumed


def load_foot(path: Path, naming: Naming = OWN) -> Imu:
    """Samples of a file or folder of any program."""
    if is_bag(path):
        return _imu(path, *read_bag(path, IMU, "imu", naming))
    if path.is_dir():
        return _folder(path, path.glob("*.csv"), naming)
    if path.is_file() and zipfile.is_zipfile(path):
        return _zip(path, naming)
    reader = {".mat": _mat, ".mvnx": _mvnx}.get(path.suffix.lower())
    if reader is None:
        return load_imu(path, partial(read_header, naming=naming))
    with as_error(f"{path}: cannot read the samples"):
        if path.stat().st_size > MOST_BYTES:
            raise EchostepError(f"{path}: larger than {MOST_BYTES >> 30} GB: cut the recording into parts")
    with faults_of(path):
        return _imu(path, *reader(path))


def _imu(path: Path, table: Floats, notes: tuple[str, ...]) -> Imu:
    """The usable rows of (n, 7)."""
    with faults_of(path):
        return imu_of(np.where(np.abs(table) <= GREATEST, table, np.nan), notes)


def _zip(path: Path, naming: Naming) -> Imu:
    """A zip of tables."""
    try:
        with zipfile.ZipFile(path) as packed, TemporaryDirectory() as folder:
            tables = [each for each in packed.infolist() if each.filename.lower().endswith(".csv")]
            if sum(each.file_size for each in tables) > MOST_BYTES:
                raise EchostepError(f"{path}: its tables exceed {MOST_BYTES >> 30} GB: cut the recording into parts")
            packed.extractall(folder, tables)
            try:
                return _folder(path, Path(folder).rglob("*.csv"), naming)
            except EchostepError as error:
                raise EchostepError(str(error).replace(f"{folder}/", f"{path}: ")) from error
    except (zipfile.BadZipFile, NotImplementedError, RuntimeError, OSError, EOFError) as error:
        raise EchostepError(f"{path}: cannot unpack it: {error}") from error


def _folder(path: Path, files: Iterable[Path], naming: Naming) -> Imu:
    """A session: one table with both sensors, or one for each, of which the accelerometer's is brought to the gyro's times."""
    tables = {file.stem.lower(): file for file in sorted(files)}
    alone = [name for name in tables if len(tables) == 1 and not re.search("acc|gyr", name)]
    for name in (*SESSIONS, *alone):
        if name in tables:
            return load_imu(tables[name], partial(read_header, naming=naming))
    names = [name for name in tables if "uncal" not in name]
    gyros = [name for name in names if "gyr" in name]
    forces = [name for name in names if "acc" in name and "linear" not in name]
    forces.sort(key=lambda name: "total" not in name)
    if not gyros or not forces:
        lacks = "no table of a gyroscope" if forces else "no table of an accelerometer"
        raise EchostepError(f"{path}: {lacks} (there are: {', '.join(tables)[:300] or 'none'}); record both, as CSV")
    gyro = open_samples(tables[gyros[0]], partial(_vectors, ours="g"))
    force = open_samples(tables[forces[0]], partial(_vectors, ours="a"))
    accel = _at(gyro[:, 0], force)
    notes = [f"read from {tables[gyros[0]].name} and {tables[forces[0]].name}, at the times of the gyroscope"]
    if "gravity" in tables and "total" not in forces[0]:
        accel += _at(gyro[:, 0], open_samples(tables["gravity"], partial(_vectors, ours="a")))
        notes.append(f"gravity added from {tables['gravity'].name}")
    system = _system(tables.get("metadata"))
    if system == "ios":
        accel = -accel
        notes.append("an iPhone's, not standardised: the signs of its accelerations are changed")
    elif "gravity" in notes[-1] and not system:
        notes.append("read as of Android; of an iPhone, not standardised, the track is mirrored: add its Metadata.csv")
    return _imu(path, np.column_stack([gyro[:, 0], accel, gyro[:, 1:]]), tuple(notes))


def _system(metadata: Path | None) -> str:
    """Whose signs a Metadata.csv of Sensor Logger states: ios, or another system; "" where it states none."""
    lines = open_samples(metadata, lambda file: [*islice(lines_of(file, LIMITS), 2)]) if metadata else []
    about = next(csv.DictReader(lines), {})
    standard = str(about.get("standardisation")).casefold() == "true"
    return "standard" if standard else str(about.get("platform") or "").casefold()


def _vectors(file: TextIO, ours: str) -> Floats:
    """Time and three axes (n, 4) in SI of a table with one sensor; `ours`: a or g, before the axes' names."""
    lines = lines_of(file, LIMITS)
    first = next(lines, "")
    theirs, _ = header_of(first)
    time = next((name for name in theirs if name in TIMES or time_unit(name)), "")
    axes = [
        next((name for name in theirs if re.fullmatch(rf"(.* )?{axis}(-axis)?( \(.*\))?", name, re.I)), "")
        for axis in "xyz"
    ]
    if not time or not all(axes):
        raise ValueError("expected a column of times (seconds_elapsed, Time (s), epoch (ms)) and the axes x, y, z")
    columns = {"t_s": time} | {ours + axis: name for axis, name in zip("xyz", axes, strict=True)}
    head = read_header(iter([first]), Naming(columns))
    rows = head.table(lines, list(columns), 4, LIMITS).values
    return rows[np.isfinite(rows).all(axis=1)]


def _at(t_s: Floats, vectors: Floats) -> Floats:
    """Vectors (n, 3) at these times, from rows (m, 4) with theirs; NaN outside of them."""
    ordered = vectors[np.argsort(vectors[:, 0], kind="stable")]
    within = [np.interp(t_s, ordered[:, 0], column, np.nan, np.nan) for column in ordered[:, 1:].T]
    return np.column_stack(within)


def _mat(path: Path) -> tuple[Floats, tuple[str, ...]]:
    """Rows (n, 7) of a MAT file with the names of pyshoe."""
    require("a MAT file", "scipy")
    from scipy.io import loadmat, whosmat

    there = {name: shape for name, shape, _ in _read_mat(lambda: whosmat(path))}
    names = [next((name for name in known if name in there), "") for known in (MAT_TIME, MAT_IMU)]
    if not all(names):
        wanted = f"no {' or '.join(MAT_TIME)} with {' or '.join(MAT_IMU)} (n, 6)"
        raise ValueError(f"{wanted}; there are {', '.join(there)[:300]}")
    if any(max(there[name]) > (LIMITS.lines or 0) for name in names):
        raise ValueError(f"more than {LIMITS.lines} samples: cut the recording into parts")
    mat = _read_mat(lambda: loadmat(path, variable_names=names))
    t_s, imu = _read_mat(lambda: [np.asarray(mat[name], np.float64) for name in names])
    if imu.ndim != 2 or imu.shape[1] < 6 or t_s.size != len(imu):
        raise ValueError(f"{names[1]} {imu.shape} and {names[0]} {t_s.shape}: expected (n, 6) and n times")
    return np.column_stack([t_s.ravel(), imu[:, :6]]), ("read as a file of pyshoe: m/s2, rad/s",)


def _read_mat(read: Callable[[], Any]) -> Any:
    """What `read` gives; raises ValueError for whatever scipy makes of a damaged file."""
    try:
        return read()
    except NotImplementedError as error:
        raise ValueError("a MAT file of version 7.3: save it with -v7") from error
    except Exception as error:
        raise ValueError(f"no MAT file that can be read: {error}") from error


def _mvnx(path: Path) -> tuple[Floats, tuple[str, ...]]:
    """Rows (n, 7) of a foot's sensor in an MVNX file: force from the free acceleration, rates from the turns of the orientation."""
    require("an MVNX file", "scipy")
    from scipy.spatial.transform import Rotation

    sensors: list[str] = []
    rows: list[list[float]] = []
    try:
        for frame in _frames(path, sensors):
            k = next((k for k, name in enumerate(sensors) if name.endswith("Foot")), -1)
            if k < 0:
                raise ValueError(f"no sensor of a foot; there are {', '.join(sensors)[:300] or 'none'}")
            parts = {each.tag.rpartition("}")[2]: each.text or "" for each in frame}
            if missing := {"sensorFreeAcceleration", "sensorOrientation"} - parts.keys():
                raise ValueError(f"no {min(missing)}: export the sensors' data, too")
            free, turned = parts["sensorFreeAcceleration"].split(), parts["sensorOrientation"].split()
            row = [frame.get("time", "nan"), *free[3 * k : 3 * k + 3], *turned[4 * k : 4 * k + 4]]
            rows.append([float(value) for value in row] if len(row) == 8 else [np.nan] * 8)
    except ParseError as error:
        raise ValueError(f"no XML: {error}") from error
    table = np.array(rows).reshape(-1, 8)
    table = table[np.isfinite(table).all(axis=1) & table[:, 4:].any(axis=1)]
    if len(table) < 2:
        raise ValueError("no frames with a foot's sensor")
    t_s, turns = 1e-3 * table[:, 0], Rotation.from_quat(table[:, 4:], scalar_first=True)
    rates = (turns[:-1].inv() * turns[1:]).as_rotvec() / np.maximum(np.diff(t_s), 1e-6)[:, None]
    accel = turns.inv().apply(table[:, 1:4] + GRAVITY_M_S2)
    note = f"read as MVNX, the sensor of {next(name for name in sensors if name.endswith('Foot'))}: its rates are computed from its orientation"
    return np.column_stack([t_s[1:], accel[1:], rates]), (note,)


def _frames(path: Path, sensors: list[str]) -> Iterator[Element]:
    """Frames of motion, one at a time; the sensors' labels before them go into `sensors`."""
    for _, element in iterparse(path):
        tag = element.tag.rpartition("}")[2]
        if tag == "sensor":
            sensors.append(element.get("label", ""))
        if tag == "frame":
            if element.get("type", "normal") == "normal":
                yield element
            element.clear()


WITHIN_S, MOVED_M_S = 3.0, 0.4  # change of velocity within a time, which an offset of 0.1 m/s2 does not give; assumed


def refuse_glide(imu: Imu, track: Track, name: str) -> None:
    """Raises EchostepError for a track without a step of samples (n,) whose velocity changed."""
    if track.steps:
        return
    steps_s = np.diff(imu.t_s, prepend=imu.t_s[0])
    velocity = np.cumsum((imu.accel - np.median(imu.accel, axis=0)) * steps_s[:, None], axis=0)
    before = np.searchsorted(imu.t_s, imu.t_s - WITHIN_S)
    if float(np.abs(velocity - velocity[before]).max()) > MOVED_M_S:
        raise EchostepError(
            f"{name}: no step in {imu.t_s[-1] - imu.t_s[0]:.0f} s, yet the sensor moved, as on wheels, skates or in a car: {NEEDED}"
        )
