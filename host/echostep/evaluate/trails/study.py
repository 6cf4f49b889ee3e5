"""`echostep evaluate trails`: the trails of [Fischer 2008, section 3.2], walked in simulation, by the paper's method and by ours.

In: a number of runs, a seed. Out: rows for each trail, method and rate; pictures as its Figures 3-6 (`trail_pictures`). Owns nothing.
Both tracks are laid on the truth by where the foot stood and pointed at first, and nothing else. All results are simulated. The magnitudes
of the paper's errors were used to set the model of the MTx's filter (`onboard`) and the machines, so they test the method, not the MTx.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from echostep.arrays import Floats
from echostep.evaluate.study import Row, Study, console, print_table, summary, write_json
from echostep.foot.steps import Track, walk_track
from echostep.papers import fischer2008
from echostep.simulation.devices.mtx import MtxSamples
from echostep.simulation.people.fischer_trails import TRAILS, Trail, measure_trail, walk_trail
from echostep.simulation.people.walker import RATE_HZ, Walk

RATES_HZ = (100, 50)
METHODS = ("fischer2008", "default")
COLUMNS = {
    "name": "trail/method",
    "distance_error_percent": "way %",
    "printed": "printed",
    "heading_error_deg": "turned",
    "max_m": "max",
    "ending_m": "end m",
    "lost": "lost",
}


@dataclass(frozen=True, slots=True)
class Walked:
    """One method on one walk, judged whenever the foot is about to leave the ground: `places_m` (k, 2) on the map, what is wrong with them."""

    places_m: Floats
    errors_m: Floats
    heading_errors_rad: Floats
    distance_m: float
    true_distance_m: float


def trails(runs: int, seed: int, folder: Path, json_path: Path | None, scheduler: str | None) -> list[Row]:
    """Run the study, print it beside the printed figures, draw the first run."""
    from echostep.evaluate.trails.pictures import draw_trails

    study = Study("trails", runs, seed, one, folder, scheduler)
    rows = summaries(study.rows())
    if json_path:
        write_json(json_path, "trails", runs, seed, rows)
    for rate_hz in RATES_HZ:
        shown = [row | {"name": row["name"].removesuffix(f"/{rate_hz}Hz")} for row in rows if row["rate_hz"] == rate_hz]
        print_table(f"Trails of Fischer et al. 2008, simulated: {runs} runs at {rate_hz} Hz", shown, COLUMNS)
    console.print("Printed and simulated error of the way: " + "; ".join(_ranges(rows)))
    console.print(
        "way: error of the distance walked; printed: the paper's own; turned: rms error of the heading, degrees; max, end: error of the "
        "position, metres; lost: runs that end more than 3 m off."
    )
    draw_trails(folder, seed)
    return rows


def one(seed: int) -> list[Row]:
    """Rows of one run: every trail, rate and method."""
    rows = []
    for trail in TRAILS:
        walked = walk_trail(trail, seed)
        for rate_hz in RATES_HZ:
            samples = measure_trail(trail, walked, rate_hz, seed)
            rows += [_row(trail, rate_hz, profile, judge(track(samples, profile), walked)) for profile in METHODS]
    return rows


def track(samples: MtxSamples, profile: str) -> Track:
    """What a method makes of the samples."""
    if profile == "fischer2008":
        return fischer2008.walk_track(samples.t_s, samples.accel, samples.gyro, samples.orientation)
    return walk_track(samples.t_s, samples.accel, samples.gyro, mag=samples.mag)


def judge(found: Track, walked: Walk) -> Walked:
    """Compare a track with the walk that it was made of."""
    leaves = np.flatnonzero(walked.flat[:-1] & ~walked.flat[1:])
    leaves = np.append(leaves, int(found.t_s[-1] * RATE_HZ))
    at = np.minimum(np.searchsorted(found.t_s, leaves / RATE_HZ), len(found.t_s) - 1)
    yaw = walked.foot_rpy_rad[:, 2]
    c, s = math.cos(yaw[0]), math.sin(yaw[0])
    places = found.position_m[at, :2] @ np.array([[c, s], [-s, c]]) + walked.foot_m[0, :2]
    true = walked.foot_m[leaves, :2]
    turned = found.heading_rad[at] - (yaw[leaves] - yaw[0])
    return Walked(
        places,
        np.hypot(*(places - true).T),
        np.abs(np.angle(np.exp(1j * turned))),
        sum(math.hypot(*step.move_m[:2]) for step in found.steps),
        float(np.hypot(*np.diff(true, axis=0).T).sum()),
    )


def summaries(rows: list[Row]) -> list[Row]:
    """One row for each trail, method and rate, over all runs."""
    names = dict.fromkeys(row["name"] for row in rows)
    return [_summary([row for row in rows if row["name"] == name]) for name in names]


def _ranges(rows: list[Row]) -> list[str]:
    """The printed distance errors, each with the range of the simulated walkers."""
    return [
        f"{row['name']} {row['printed']}, {row['distance_error_min_percent']:+.1f} to {row['distance_error_max_percent']:+.1f} %"
        for row in rows
        if row.get("printed_distance_error_percent") is not None
    ]


def _summary(rows: list[Row]) -> Row:
    first = rows[0]
    off = [row["distance_error_percent"] for row in rows]
    found = summary(first["name"], first["profile"], [row["errors_m"] for row in rows], [])
    found |= {
        "rate_hz": first["rate_hz"],
        "distance_m": round(sum(row["distance_m"] for row in rows) / len(rows), 2),
        "distance_error_percent": round(sum(off) / len(off), 2),
        "distance_error_min_percent": round(min(off), 2),
        "distance_error_max_percent": round(max(off), 2),
        "heading_error_deg": round(sum(row["heading_error_deg"] for row in rows) / len(rows), 2),
        "heading_max_deg": round(max(row["heading_max_deg"] for row in rows), 2),
    }
    printed = {key: first[key] for key in ("printed", "printed_distance_error_percent") if key in first}
    return found | printed


def _row(trail: Trail, rate_hz: int, profile: str, walked: Walked) -> Row:
    degrees = np.degrees(walked.heading_errors_rad)
    row: Row = {
        "name": f"{trail.name}/{profile}" + ("" if rate_hz == RATES_HZ[0] else f"/{rate_hz}Hz"),
        "profile": profile,
        "rate_hz": rate_hz,
        "distance_m": walked.distance_m,
        "distance_error_percent": 100.0 * (walked.distance_m / walked.true_distance_m - 1.0),
        "heading_error_deg": float(np.sqrt((degrees**2).mean())),
        "heading_max_deg": float(degrees.max()),
        "errors_m": walked.errors_m.round(4).tolist(),
    }
    if profile == "fischer2008":
        row |= {"printed": trail.printed, "printed_distance_error_percent": trail.printed_percent}
    return row
