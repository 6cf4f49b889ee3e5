"""A recorded foot IMU as a CSV file, for researchers: read with suspicion, tracked by the same kernel as live.

In: columns `t_s,ax,ay,az,gx,gy,gz[,mx,my,mz]` (s, m/s2, rad/s, any unit), 50 to 500 Hz, any mounting. Out: `Imu` with what had to be mended, or an
EchostepError; the track as CSV and in words. Owns nothing. `imu_checks` knows what is wrong with samples.
"""

from __future__ import annotations

import csv
import math
from array import array
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

import numpy as np

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.foot.steps import Track
from echostep.offline.imu_checks import complaint, contradiction, end_sd_m, notes, sorted_by_time, whole_rows

COLUMNS = ("t_s", "ax", "ay", "az", "gx", "gy", "gz")
MAG_COLUMNS = ("mx", "my", "mz")
TRACK_COLUMNS = ("t_s", "x", "y", "z", "heading_rad", "stance")
LONGEST_LINE = 10_000
EARLY_ROWS, MOST_BAD = 2000, 0.5


@dataclass(frozen=True, slots=True)
class Imu:
    """`t_s` (n,), `accel` (n, 3) m/s2, `gyro` (n, 3) rad/s, `mag` (n, 3) of any unit or None, NaN where it has no number.

    `notes`: what was found and mended, a line each.
    """

    t_s: Floats
    accel: Floats
    gyro: Floats
    mag: Floats | None = None
    notes: tuple[str, ...] = ()


def load_imu(path: Path | str) -> Imu:
    """Samples of a CSV file; raises EchostepError that names the file and what is wrong with which column."""
    try:
        with Path(path).open(newline=None, encoding="utf-8-sig", errors="replace") as file:
            table, holes = whole_rows(_table(_lines(file)))
        table, mended = sorted_by_time(table)
        if wrong := complaint(table, COLUMNS):
            raise ValueError(wrong)
    except OSError as error:
        raise EchostepError(f"{path}: cannot read the samples: {error.strerror}") from error
    except ValueError as error:
        raise EchostepError(f"{path}: {error}") from error
    mag = table[:, 7:10] if table.shape[1] > len(COLUMNS) else None
    return Imu(table[:, 0], table[:, 1:4], table[:, 4:7], mag, (*holes, *mended, *notes(table, COLUMNS)))


def _lines(file: TextIO) -> Iterator[str]:
    """Lines of a bounded length; raises ValueError for a longer one, which is no line of numbers."""
    number = 0
    while line := file.readline(LONGEST_LINE):
        number += 1
        if len(line) == LONGEST_LINE:
            raise ValueError(f"line {number} is longer than {LONGEST_LINE} characters: is this a CSV file?")
        yield line


def _table(lines: Iterator[str]) -> Floats:
    """The columns (n, 7) or (n, 10)."""
    first = next(lines, "")
    comma = max(",;\t", key=first.count)
    header = [name.strip().strip('"') for name in first.split(comma)]
    if missing := [name for name in COLUMNS if name not in header]:
        hint = ": the first line must name the columns" if _is_numbers(header) else ""
        raise ValueError(f"no column {', '.join(missing)}{hint}; expected {','.join(COLUMNS)}[,mx,my,mz]")
    wanted = COLUMNS + MAG_COLUMNS if all(name in header for name in MAG_COLUMNS) else COLUMNS
    places = [header.index(name) for name in wanted]
    found, rows, bad = array("d"), 0, 0
    for line in lines:
        if not line.strip():
            continue
        cells = (line.replace(",", ".") if comma == ";" else line).split(comma)
        numbers = [_number(cells[k]) if k < len(cells) else math.nan for k in places]
        found.extend(numbers)
        rows += 1
        bad += not all(map(math.isfinite, numbers[: len(COLUMNS)]))
        if rows == EARLY_ROWS and bad > MOST_BAD * rows:
            break  # garbage, however long
    if rows < 2:
        raise ValueError("no samples")
    if bad > MOST_BAD * rows:
        raise ValueError(f"{100 * bad / rows:.0f} % of the first {rows} rows have no number in some column")
    return np.array(found).reshape(rows, len(wanted))


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


def _is_numbers(cells: list[str]) -> bool:
    return all(math.isfinite(_number(cell)) for cell in cells)


def checked(track: Track, path: Path | str) -> Track:
    """The track; raises EchostepError when it contradicts itself, because then the samples are not what they are taken for."""
    if wrong := contradiction(track):
        raise EchostepError(f"{path}: {wrong}")
    return track


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
    """Distance, closure, how well the end is known, steps and losses in words."""
    steps = track.steps
    distance = sum(float(np.hypot(*step.move_m[:2])) for step in steps)
    end = track.position_m[-1] - track.position_m[0]
    lost = track.counts.impossible + track.counts.not_later
    toe = "" if track.toe_known else "; the toe's direction is not known, heading_rad counts from the first rest"
    trusted, read = track.compass
    compass = f"; magnetometer trusted in {trusted} of {read} stances" if read else ""
    return (
        f"{len(steps)} steps, {distance:.2f} m; the end is {np.hypot(end[0], end[1]):.2f} m from the beginning and {end[2]:+.2f} m in height, "
        f"known to {end_sd_m(track):.2f} m (1 sd); {track.counts.samples} samples, {lost} skipped, {track.counts.gaps} gaps{compass}{toe}"
    )
