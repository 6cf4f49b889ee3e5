# SPDX-License-Identifier: MIT
"""The rows `trail/...`: the trails of [Fischer 2008, section 3.2], walked in simulation without a plan, by the paper's method and by ours.

In: seeds. Out: rows for each trail, method and rate. Owns nothing. All results are simulated. The magnitudes of the
paper's errors were used to set the model of the MTx's filter (`xsens.onboard_filter`) and the machines, so they test the method, not the MTx.
A track begins at the true first position and heading of the foot; nothing else of the truth is used.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache, partial

import numpy as np

from echostep.arrays import Floats
from echostep.foot.steps import Track, walk_track
from echostep_app.output.table import Table
from echostep_simulation.devices.mtx import MtxSamples
from echostep_simulation.people.walker import RATE_HZ, Walk
from echostep_studies.bench.recordings.foot_metrics import from_true_start
from echostep_studies.frame.parts import Part
from echostep_studies.frame.report import Row, as_dict, means, summary
from echostep_studies.frame.study import StudyRequest
from echostep_studies.papers import fischer2008
from echostep_studies.simulation.fischer_trails import TRAILS, measure_trail, walk_trail

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
    places = from_true_start(track, walked, at)
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


NAMES = {
    f"trail/{trail.name}/{profile}" + ("" if rate_hz == RATES_HZ[0] else f"/{rate_hz}Hz"): (trail, profile, rate_hz)
    for trail in TRAILS for rate_hz in RATES_HZ for profile in METHODS
}  # fmt: skip


def trail_rows(names: Sequence[str], seed: int) -> list[TrailRun]:
    """The rows of these names for one person; a trail is walked once, and measured once at each rate."""
    walks = cache(partial(walk_trail, seed=seed))
    measured = cache(lambda trail, rate_hz: measure_trail(trail, walks(trail), rate_hz, seed))
    rows = []
    for name in names:
        trail, profile, rate_hz = NAMES[name]
        rows.append(_row(name, judge(track(measured(trail, rate_hz), profile), walks(trail))))
    return rows


def _row(name: str, walked: JudgedTrack) -> TrailRun:
    trail, profile, rate_hz = NAMES[name]
    degrees = np.degrees(walked.heading_errors_rad)
    row = TrailRun(
        name=name,
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


def summarize(rows: Sequence[TrailRun]) -> Row:
    """The summary row of one trail, method and rate, over all runs."""
    first = rows[0]
    off = [row.distance_error_percent for row in rows]
    common: Row = {
        **summary(first.name, first.profile, [row.errors_m for row in rows], []), "rate_hz": first.rate_hz,
        **means(rows, ("distance_m", "distance_error_percent", "heading_error_deg"), 2),
        "distance_error_min_percent": round(min(off), 2), "distance_error_max_percent": round(max(off), 2),
        "heading_max_deg": round(max(row.heading_max_deg for row in rows), 2),
    }  # fmt: skip
    if not isinstance(first, PrintedRun):
        return common
    return common | {"printed": first.printed, "printed_distance_error_percent": first.printed_distance_error_percent}


def _tables(rows: list[Row], request: StudyRequest) -> list[Table]:
    """One table for each rate; below the last one the printed and simulated errors of the way."""
    ours = [row for row in rows if "rate_hz" in row]
    tables = []
    for rate_hz in RATES_HZ:
        shown = [row | {"name": row["name"].removesuffix(f"/{rate_hz}Hz")} for row in ours if row["rate_hz"] == rate_hz]
        title = f"Trails of Fischer et al. 2008, simulated: {request.runs} runs at {rate_hz} Hz"
        tables.append(Table(title, shown, COLUMNS, (*_ranges(shown), LEGEND)))
    return tables


def _ranges(rows: Iterable[Row]) -> list[str]:
    """The printed distance errors, each with the range of the simulated walkers."""
    known = [row for row in rows if row.get("printed_distance_error_percent") is not None]
    ranges = "; ".join(
        "{name} {printed}, {distance_error_min_percent:+.1f} to {distance_error_max_percent:+.1f} %".format(**row)
        for row in known
    )
    return [f"Printed and simulated error of the way: {ranges}"] if known else []


PART = Part(list(NAMES), trail_rows, {TrailRun: summarize, PrintedRun: summarize}, _tables)
