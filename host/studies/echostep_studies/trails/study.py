# SPDX-License-Identifier: MIT
"""`echostep evaluate trails`: the trails of [Fischer 2008, section 3.2], walked in simulation, by the paper's method and by ours.

In: seeds. Out: rows for each trail, method and rate. Owns nothing. All results are simulated. The magnitudes of the
paper's errors were used to set the model of the MTx's filter (`xsens.onboard_filter`) and the machines, so they test the method, not the MTx.
A track begins at the true first position and heading of the foot; nothing else of the truth is used.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from echostep.arrays import Floats
from echostep.foot.steps import Track, walk_track
from echostep_app.output.table import Table
from echostep_simulation.devices.mtx import MtxSamples
from echostep_simulation.people.walker import RATE_HZ, Walk
from echostep_studies.frame.report import Row, as_dict, rows_by_name, summary
from echostep_studies.frame.study import Study, StudyRequest
from echostep_studies.papers import fischer2008
from echostep_studies.simulation.fischer_trails import TRAILS, Trail, measure_trail, walk_trail

RATES_HZ = (100, 50)  # of the MTx
METHODS = ("fischer2008", "default")


@dataclass(frozen=True, slots=True)
class JudgedTrack:
    """One method on one walk, judged whenever the foot is about to leave the ground: `places_m` (k, 2) on the map, what is wrong with them."""

    places_m: Floats
    errors_m: Floats
    heading_errors_rad: Floats
    distance_m: float
    true_distance_m: float


def track(samples: MtxSamples, profile: str) -> Track:
    """What a method makes of the samples."""
    if profile == "fischer2008":
        return fischer2008.walk_track(samples.t_s, samples.accel, samples.gyro, samples.orientation)
    return walk_track(samples.t_s, samples.accel, samples.gyro, mag=samples.mag)


def judge(track: Track, walked: Walk) -> JudgedTrack:
    """Compare a track with the walk that it was made of."""
    leaves = np.flatnonzero(walked.flat[:-1] & ~walked.flat[1:])
    leaves = np.append(leaves, int(track.t_s[-1] * RATE_HZ))
    at = np.minimum(np.searchsorted(track.t_s, leaves / RATE_HZ), len(track.t_s) - 1)
    yaw = walked.foot_rpy_rad[:, 2]
    c, s = math.cos(yaw[0]), math.sin(yaw[0])
    places = track.position_m[at, :2] @ np.array([[c, s], [-s, c]]) + walked.foot_m[0, :2]
    true = walked.foot_m[leaves, :2]
    turned = track.heading_rad[at] - (yaw[leaves] - yaw[0])
    return JudgedTrack(
        places,
        np.hypot(*(places - true).T),
        np.abs(np.angle(np.exp(1j * turned))),
        sum(math.hypot(*step.move_m[:2]) for step in track.steps),
        float(np.hypot(*np.diff(true, axis=0).T).sum()),
    )


COLUMNS = {
    "name": "trail/method",
    "distance_error_percent": "way %",
    "printed": "printed",
    "heading_error_deg": "turned",
    "max_m": "max",
    "ending_m": "end m",
    "lost": "lost",
}
LEGEND = (
    "way: error of the distance walked; printed: the paper's own; turned: rms error of the heading, degrees; max, end: error of the "
    "position, metres; lost: runs that end more than 3 m off."
)


@dataclass(frozen=True, slots=True, kw_only=True)
class TrailRun:
    """One method on one walk of a trail."""

    name: str
    profile: str
    rate_hz: int
    distance_m: float
    distance_error_percent: float
    heading_error_deg: float
    heading_max_deg: float
    errors_m: list[float]


@dataclass(frozen=True, slots=True, kw_only=True)
class PrintedRun(TrailRun):
    """The same by the paper's method, with the paper's figures of the trail."""

    printed: str
    printed_distance_error_percent: float | None


def one_run(seed: int) -> list[TrailRun]:
    """Rows of one run: every trail, rate and method."""
    rows = []
    for trail in TRAILS:
        walked = walk_trail(trail, seed)
        for rate_hz in RATES_HZ:
            samples = measure_trail(trail, walked, rate_hz, seed)
            rows += [_row(trail, rate_hz, profile, judge(track(samples, profile), walked)) for profile in METHODS]
    return rows


def _row(trail: Trail, rate_hz: int, profile: str, walked: JudgedTrack) -> TrailRun:
    degrees = np.degrees(walked.heading_errors_rad)
    row = TrailRun(
        name=f"{trail.name}/{profile}" + ("" if rate_hz == RATES_HZ[0] else f"/{rate_hz}Hz"),
        profile=profile,
        rate_hz=rate_hz,
        distance_m=walked.distance_m,
        distance_error_percent=100.0 * (walked.distance_m / walked.true_distance_m - 1.0),
        heading_error_deg=float(np.sqrt((degrees**2).mean())),
        heading_max_deg=float(degrees.max()),
        errors_m=walked.errors_m.round(4).tolist(),
    )
    if profile != "fischer2008":
        return row
    return PrintedRun(**as_dict(row), printed=trail.printed, printed_distance_error_percent=trail.printed_percent)


def summaries(rows: Sequence[TrailRun]) -> list[Row]:
    """One row for each trail, method and rate, over all runs."""
    return [_summary(group) for group in rows_by_name(rows)]


def _summary(rows: list[TrailRun]) -> Row:
    first = rows[0]
    off = [row.distance_error_percent for row in rows]
    common: Row = {
        **summary(first.name, first.profile, [row.errors_m for row in rows], []), "rate_hz": first.rate_hz,
        "distance_m": round(sum(row.distance_m for row in rows) / len(rows), 2),
        "distance_error_percent": round(sum(off) / len(off), 2), "distance_error_min_percent": round(min(off), 2),
        "distance_error_max_percent": round(max(off), 2),
        "heading_error_deg": round(sum(row.heading_error_deg for row in rows) / len(rows), 2),
        "heading_max_deg": round(max(row.heading_max_deg for row in rows), 2),
    }  # fmt: skip
    if not isinstance(first, PrintedRun):
        return common
    return common | {"printed": first.printed, "printed_distance_error_percent": first.printed_distance_error_percent}


def _tables(rows: list[Row], request: StudyRequest) -> list[Table]:
    """One table for each rate; below the last one the printed and simulated errors of the way."""
    tables = []
    for rate_hz in RATES_HZ:
        shown = [row | {"name": row["name"].removesuffix(f"/{rate_hz}Hz")} for row in rows if row["rate_hz"] == rate_hz]
        notes = (
            ("Printed and simulated error of the way: " + "; ".join(_ranges(rows)), LEGEND)
            if rate_hz == RATES_HZ[-1]
            else ()
        )
        title = f"Trails of Fischer et al. 2008, simulated: {request.runs} runs at {rate_hz} Hz"
        tables.append(Table(title, shown, COLUMNS, notes))
    return tables


def _ranges(rows: list[Row]) -> list[str]:
    """The printed distance errors, each with the range of the simulated walkers."""
    return [
        "{name} {printed}, {distance_error_min_percent:+.1f} to {distance_error_max_percent:+.1f} %".format(**row)
        for row in rows
        if row.get("printed_distance_error_percent") is not None
    ]


STUDY = Study("trails", (TrailRun, PrintedRun), one_run, summaries, _tables, parquet=None)
