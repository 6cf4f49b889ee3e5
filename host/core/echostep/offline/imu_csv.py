# SPDX-License-Identifier: MIT
"""A recorded foot IMU as a CSV file: samples checked and read, the track written and described.

In: columns `t_s,ax,ay,az,gx,gy,gz[,mx,my,mz]` (s, m/s2, rad/s, any unit), 50 to 500 Hz, any mounting. Out: `Imu` with notes on corrections, or an
EchostepError; the track as CSV and in words. Owns nothing. `imu_checks` holds the checks.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.file_mode import write_csv
from echostep.foot.alignment import aligned
from echostep.foot.steps import Stance, Step, Track, walk_track
from echostep.foot.trunk_path import RUN_STANCE_S
from echostep.offline.bursts import spread
from echostep.offline.csv_table import CsvLimits, lines_of, number_of, open_samples
from echostep.offline.header import HeaderReader, own_header
from echostep.offline.imu_checks import complaint, contradiction, end_sd_m, notes, sorted_by_time, whole_rows

COLUMNS = ("t_s", "ax", "ay", "az", "gx", "gy", "gz")
MAG_COLUMNS = ("mx", "my", "mz")
LIMITS = CsvLimits(lines=5_000_000)  # they bound the memory: 7 hours at 200 Hz
TRACK_COLUMNS = ("t_s", "x", "y", "z", "heading_rad", "stance")


@dataclass(frozen=True, slots=True)
class Imu:
    """`t_s` (n,), `accel` (n, 3) m/s2, `gyro` (n, 3) rad/s, `mag` (n, 3) of any unit or None, NaN where it has no number.

    `notes`: findings and corrections, a line each.
    """

    t_s: Floats
    accel: Floats
    gyro: Floats
    mag: Floats | None = None
    notes: tuple[str, ...] = ()


def load_imu(path: Path | str, header: HeaderReader = own_header) -> Imu:
    """Samples of a CSV file; raises EchostepError that names file, column and fault."""
    return open_samples(path, lambda file: imu_of(*_table(lines_of(file, LIMITS), header)))


def imu_of(table: Floats, left_out: tuple[str, ...]) -> Imu:
    """The usable rows of (n, 7) or (n, 10) in order of time; raises ValueError for samples that cannot be used. `left_out`: notes so far."""
    table, holes = whole_rows(table)
    if empty := int(np.isnan(table[:, len(COLUMNS) :]).any(axis=1).sum()):
        left_out = (f"{empty} rows without a number of the magnetometer: used without it",)
    table, mended = sorted_by_time(table)
    table[:, 0], spreading = spread(table[:, 0])
    if wrong := complaint(table, COLUMNS):
        raise ValueError(wrong)
    mag = table[:, 7:10] if table.shape[1] > len(COLUMNS) else None
    mendings = (*holes, *left_out, *mended, *spreading)
    return Imu(table[:, 0], table[:, 1:4], table[:, 4:7], mag, (*mendings, *notes(table, COLUMNS)))


def _table(lines: Iterator[str], read_header: HeaderReader) -> tuple[Floats, tuple[str, ...]]:
    """The columns (n, 7), or (n, 10) with a magnetometer, in SI units, and notes on their origin and on an incomplete magnetometer."""
    head = read_header(lines)
    header = head.names
    if missing := [name for name in COLUMNS if name not in header]:
        hint = ": the first line must name the columns" if all(map(math.isfinite, map(number_of, header))) else ""
        raise ValueError(f"no column {', '.join(missing)}{hint}; there are {', '.join(header)[:300]}{head.advice}")
    wanted = COLUMNS + MAG_COLUMNS if all(name in header for name in MAG_COLUMNS) else COLUMNS
    half = [name for name in MAG_COLUMNS if name in header and name not in wanted]
    left_out = (f"{', '.join(half)} without the other axes of the magnetometer: left out",) if half else ()
    return head.table(lines, wanted, len(COLUMNS), LIMITS).values, (*head.notes, *left_out)


def write_foot_track(path: Path | str, track: Track) -> None:
    """`t_s,x,y,z,heading_rad,stance` for every sample; raises EchostepError when the file cannot be written."""
    try:
        rows = zip(track.t_s, *track.position_m.T, track.heading_rad, track.stance, strict=True)
        write_csv(Path(path), TRACK_COLUMNS, ([*(f"{v:.6f}" for v in row), int(still)] for *row, still in rows))
    except OSError as error:
        raise EchostepError(f"{path}: cannot write the track: {error.strerror}") from error


def _describe_runs(track: Track) -> str:
    """The steps that ended in a stance too brief for walking, and how well such a step is known, in words; empty if none."""
    brief = [
        math.sqrt(float(step.covariance[0, 0] + step.covariance[1, 1]))
        for step, after in zip(track.events, track.events[1:], strict=False)
        if isinstance(step, Step) and isinstance(after, Stance) and after.t_end_s - after.t_start_s < RUN_STANCE_S
    ]
    if not brief:
        return ""
    times = "once" if len(brief) == 1 else f"{len(brief)} times"
    return f"; {times} the foot stood for less than {RUN_STANCE_S} s, as in a run: such a step is known to {max(brief):.2f} m (1 sd)"


def own_track(imu: Imu, name: str) -> Track:
    """The track by this project's method; raises EchostepError that names the recording when it contradicts itself: other units or axes."""
    track = aligned(walk_track(imu.t_s, imu.accel, imu.gyro, mag=imu.mag))
    if wrong := contradiction(track):
        raise EchostepError(f"{name}: {wrong}")
    return track


def describe_track(track: Track) -> str:
    """Distance, distance from start to end with its standard deviation, steps and skipped samples, in words."""
    steps = track.steps
    distance = sum(float(np.hypot(*step.move_m[:2])) for step in steps)
    end = track.position_m[-1] - track.position_m[0]
    lost = track.counts.impossible + track.counts.not_later
    toe = "" if track.toe_known else "; the toe's direction is not known, heading_rad counts from the first rest"
    trusted, read = track.compass
    compass = f"; magnetometer trusted in {trusted} of {read} stances" if read else ""
    runs = _describe_runs(track)
    return (
        f"{len(steps)} steps, {distance:.2f} m; the end is {np.hypot(end[0], end[1]):.2f} m from the beginning and {end[2]:+.2f} m in height, "
        f"known to {end_sd_m(track):.2f} m (1 sd); {track.counts.samples} samples, {lost} skipped, {track.counts.gaps} gaps{runs}{compass}{toe}"
        f"{''.join(f'; {doubt}' for doubt in steps[-1].doubts()) if steps else ''}"
    )
