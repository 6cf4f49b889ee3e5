"""A recorded foot IMU as a CSV file, for researchers: read with suspicion, tracked by the same kernel as live.

In: columns `t_s,ax,ay,az,gx,gy,gz[,mx,my,mz]` (s, m/s2, rad/s), any rate from 50 to 500 Hz, any mounting. Out: `Imu`. Owns nothing.
Wrong units, constant columns and disordered times are told by name: a track from them would look right and be wrong.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from echostep.errors import EchostepError
from echostep.foot import Track

Floats = NDArray[np.float64]

COLUMNS = ("t_s", "ax", "ay", "az", "gx", "gy", "gz")
FIELD_COLUMNS = ("mx", "my", "mz")
TRACK_COLUMNS = ("t_s", "x", "y", "z", "heading_rad", "stance")
GRAVITY_RANGE_M_S2 = (7.0, 13.0)  # the middle reading of any foot, standing or running
G_RANGE = (0.7, 1.3)
FASTEST_FOOT_RAD_S = 40.0  # 2300 deg/s
RATE_RANGE_HZ = (30.0, 2000.0)
MOST_BAD = 0.5


@dataclass(frozen=True, slots=True)
class Imu:
    """`t_s` (n,), `accel` (n, 3) m/s2, `gyro` (n, 3) rad/s, `mag` (n, 3) in any unit, None without; NaN where the file has no number."""

    t_s: Floats
    accel: Floats
    gyro: Floats
    mag: Floats | None = None


def load_imu(path: Path | str) -> Imu:
    """Samples of a CSV file; raises EchostepError that names the file and what is wrong with which column."""
    try:
        with Path(path).open(newline="", encoding="utf-8", errors="replace") as file:
            table = _table(csv.reader(file))
    except OSError as error:
        raise EchostepError(f"{path}: cannot read the samples: {error.strerror}") from error
    except (ValueError, csv.Error) as error:
        raise EchostepError(f"{path}: {error}") from error
    imu = Imu(table[:, 0], table[:, 1:4], table[:, 4:7], table[:, 7:10] if table.shape[1] > len(COLUMNS) else None)
    if complaint := _complaint(imu):
        raise EchostepError(f"{path}: {complaint}")
    return imu


def _table(rows: Iterator[list[str]]) -> Floats:
    header = [name.strip() for name in next(rows, [])]
    if missing := [name for name in COLUMNS if name not in header]:
        raise ValueError(f"no column {', '.join(missing)}; expected {','.join(COLUMNS)}[,mx,my,mz]")
    optional = FIELD_COLUMNS if all(name in header for name in FIELD_COLUMNS) else ()
    places = [header.index(name) for name in COLUMNS + optional]
    found = [[_number(row[k]) if k < len(row) else np.nan for k in places] for row in rows if row]
    if len(found) < 2:
        raise ValueError("no samples")
    return np.array(found, dtype=np.float64)


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return float("nan")


def _complaint(imu: Imu) -> str:
    """What makes the samples unusable, in words; empty when nothing does."""
    table = np.column_stack([imu.t_s, imu.accel, imu.gyro])
    bad = 1.0 - np.isfinite(table).all(axis=1).mean()
    if bad > MOST_BAD:
        return f"{100 * bad:.0f} % of the rows have no number in some column"
    return _time_complaint(imu.t_s) or _column_complaint(table) or _unit_complaint(imu)


def _time_complaint(t_s: Floats) -> str:
    steps = np.diff(t_s[np.isfinite(t_s)])
    back = float((steps < 0).mean())
    if back > 0.02:
        return f"t_s goes back in {100 * back:.0f} % of the rows: are they shuffled?"
    forward = steps[steps > 0]
    if not len(forward):
        return "t_s does not advance"
    rate = 1.0 / float(np.median(forward))
    if not RATE_RANGE_HZ[0] <= rate <= RATE_RANGE_HZ[1]:
        return f"t_s gives {rate:.3g} samples a second: is it in seconds?"
    return ""


def _column_complaint(table: Floats) -> str:
    for k, name in enumerate(COLUMNS[1:], start=1):
        column = table[np.isfinite(table[:, k]), k]
        if len(column) > 100 and np.ptp(column) == 0.0:
            return f"{name} is constant: is that sensor alive?"
    return ""


def _unit_complaint(imu: Imu) -> str:
    force = float(np.nanmedian(np.linalg.norm(imu.accel, axis=1)))
    if G_RANGE[0] <= force <= G_RANGE[1]:
        return f"ax, ay, az look like g (their median is {force:.2f}): multiply them by 9.80665"
    if not GRAVITY_RANGE_M_S2[0] <= force <= GRAVITY_RANGE_M_S2[1]:
        return f"ax, ay, az have a median of {force:.3g}, gravity is 9.8 m/s2: wrong unit, or gravity was removed"
    fastest = float(np.nanquantile(np.abs(imu.gyro), 0.999))
    if fastest > FASTEST_FOOT_RAD_S:
        return f"gx, gy, gz reach {fastest:.0f}, no foot turns so fast in rad/s: in deg/s? multiply them by pi/180"
    return ""


def write_foot_track(path: Path | str, track: Track) -> None:
    """`t_s,x,y,z,heading_rad,stance` for every sample; raises EchostepError when the file cannot be written."""
    try:
        with Path(path).open("w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(TRACK_COLUMNS)
            columns = (track.t_s, *track.position_m.T, track.heading_rad)
            writer.writerows(
                [*(f"{v:.6f}" for v in row), int(still)] for *row, still in zip(*columns, track.stance, strict=True)
            )
    except OSError as error:
        raise EchostepError(f"{path}: cannot write the track: {error.strerror}") from error


def describe_track(track: Track) -> str:
    """Distance, closure, steps and losses in words."""
    steps = track.steps
    distance = sum(float(np.hypot(*step.move_m[:2])) for step in steps)
    end = track.position_m[-1] - track.position_m[0]
    lost = track.counts.impossible + track.counts.not_later
    return (
        f"{len(steps)} steps, {distance:.2f} m; the end is {np.hypot(end[0], end[1]):.2f} m from the beginning and {end[2]:+.2f} m in height; "
        f"{track.counts.samples} samples, {lost} skipped, {track.counts.gaps} gaps"
    )
