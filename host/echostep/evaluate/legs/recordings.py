# SPDX-License-Identifier: MIT
"""`echostep evaluate legs --data`: real legs against the way of both feet, by what is known of the wearer.

In: the folder of recordings. Out: rows `{set, recording, known, walked_m, found_m, error_m, error_percent, sd_m, error_over_sd, stairs}`, a row a leg
and a method, then the means of each method. Owns nothing. Nothing is chosen by these recordings: one setting for all.
"""

from __future__ import annotations

import math
from pathlib import Path
from statistics import fmean

import numpy as np

from echostep.evaluate.legs.datasets import SETS, LegRecording
from echostep.evaluate.recordings import recordings_in
from echostep.evaluate.report import Row, Table
from echostep.evaluate.study import Study, StudyRequest
from echostep.legs.kinematics import LegLengths
from echostep.legs.mounting import walking_axis
from echostep.legs.stride import Flag, Stride, StrideSettings, distance_sd_m
from echostep.offline.leg_csv import LegSamples
from echostep.offline.leg_track import track_default

NOTHING, LENGTHS, SCALE = "nothing", "leg lengths", "first 20 m"
SCALE_M = 20.0  # of the walk, from which the scale is taken
LEAST_REST_M = 5.0  # to be judged after that
COLUMNS = {
    "set": "set", "recording": "leg", "known": "known", "walked_m": "true m", "found_m": "found m", "error_m": "error m",
    "error_percent": "error %", "sd_m": "sd m", "error_over_sd": "error / sd", "stairs": "stairs",
}  # fmt: skip


def recordings_study(folder: Path) -> Study:
    """The study of the recordings in this folder; raises EchostepError without any."""
    recordings = recordings_in(folder, SETS)
    return Study(
        "legs-recordings",
        lambda _seed: [row for recording in recordings for row in rows_of(recording)],
        lambda rows: rows + means(rows),
        _tables,
        seeds=range(1),
        journal=False,
        parquet=None,
    )


def rows_of(recording: LegRecording) -> list[Row]:
    """One row for each method that this recording allows."""
    begin_s, end_s = recording.walk_s()
    strides = strides_of(recording, StrideSettings())
    rows = [_row(recording, NOTHING, strides, begin_s, end_s)]
    if recording.lengths is not None:
        rows.append(_row(recording, LENGTHS, strides_of(recording, StrideSettings(recording.lengths)), begin_s, end_s))
    known_s = float(np.interp(recording.walked_m(-math.inf, begin_s) + SCALE_M, recording.way_m, recording.way_s))
    found = found_m(strides, begin_s, known_s)
    if found > 0.0 and recording.walked_m(known_s, end_s) > LEAST_REST_M:
        scale = recording.walked_m(begin_s, known_s) / found
        scaled = strides_of(recording, StrideSettings(LegLengths(scale=scale), calibrated=True))
        rows.append(_row(recording, SCALE, scaled, known_s, end_s))
    return rows


def strides_of(recording: LegRecording, settings: StrideSettings) -> tuple[Stride, ...]:
    """What the method finds with the axes of walking of both sensors and the belt."""
    r = recording
    thigh, shank = (rates @ walking_axis(r.t_s, rates).axis for rates in (r.thigh, r.shank))
    samples = LegSamples(r.t_s, thigh, shank, r.belt, np.full(len(r.t_s), np.nan))
    return track_default(samples, settings).strides


def found_m(strides: tuple[Stride, ...], begin_s: float, end_s: float) -> float:
    """Length of the strides between two times; one across an end counts in part."""
    return sum(s.length_m * _share(s, begin_s, end_s) for s in strides)


def _share(stride: Stride, begin_s: float, end_s: float) -> float:
    """The part of a stride's time between two times."""
    inside = min(stride.t_end_s, end_s) - max(stride.t_start_s, begin_s)
    return max(inside, 0.0) / max(stride.t_end_s - stride.t_start_s, 1e-9)


def _row(recording: LegRecording, known: str, strides: tuple[Stride, ...], begin_s: float, end_s: float) -> Row:
    inside = [s for s in strides if _share(s, begin_s, end_s) > 0.5]
    walked, found, sd = recording.walked_m(begin_s, end_s), found_m(strides, begin_s, end_s), distance_sd_m(inside)
    error = found - walked
    return {
        "set": recording.group,
        "recording": recording.name,
        "known": known,
        "walked_m": round(walked, 3),
        "found_m": round(found, 3),
        "error_m": round(error, 3),
        "error_percent": round(100.0 * error / walked, 2),
        "sd_m": round(sd, 3),
        "error_over_sd": round(error / sd, 2) if sd > 0.0 else None,
        "stairs": sum(bool(s.flags & (Flag.STAIRS_UP | Flag.STAIRS_DOWN)) for s in inside),
    }


def means(rows: list[Row]) -> list[Row]:
    """Of each method: mean absolute errors, the rms of error / sd, all strides that were read as stairs."""
    found: list[Row] = []
    for known in (NOTHING, LENGTHS, SCALE):
        same = [row for row in rows if row["known"] == known]
        if not same:
            continue
        ratios = [row["error_over_sd"] for row in same if row["error_over_sd"] is not None]
        found.append(
            {"set": "all", "recording": f"mean absolute of {len(same)}, rms of error / sd", "known": known}
            | {key: round(fmean(abs(row[key]) for row in same), 3) for key in ("walked_m", "error_m", "error_percent")}
            | {"error_over_sd": round(math.sqrt(fmean(r * r for r in ratios)), 2) if ratios else None}
            | {"found_m": None, "sd_m": None, "stairs": sum(row["stairs"] for row in same)}
        )
    return found


def _tables(rows: list[Row], _request: StudyRequest) -> list[Table]:
    note = "Real legs, one setting for all. known: what was known of the wearer; after the first 20 m only the rest is judged."
    return [Table("Legs on real recordings against the way of both feet", rows, COLUMNS, (note,))]
