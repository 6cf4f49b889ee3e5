# SPDX-License-Identifier: MIT
"""`echostep evaluate legs --data`: real legs against the way of both feet, by what is known of the wearer.

In: the folder of recordings. Out: rows `{set, recording, known, walked_m, found_m, error_m, error_percent, sd_m, error_over_sd, stairs}`, a row a leg
and a method and a row two legs and a method, then the means of each method. Owns nothing. Nothing is chosen by these recordings: one setting for all.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import fmean

import numpy as np

from echostep.legs.kinematics import LegLengths
from echostep.legs.stride import Flag, Stride, StrideSettings
from echostep_app.offline.leg_csv import LegSamples
from echostep_app.offline.leg_gyros import walking_axis
from echostep_app.offline.leg_pair import track_pair
from echostep_app.offline.leg_side import distance_sd_m
from echostep_app.offline.leg_track import track_default
from echostep_app.output.table import Table
from echostep_studies.bench.recordings.legs import SETS, LegRecording
from echostep_studies.frame.recordings import recordings_in
from echostep_studies.frame.report import Row, as_dicts
from echostep_studies.frame.study import Study, StudyRequest

NOTHING, LENGTHS, SCALE = "nothing", "leg lengths", "first 20 m"
LEFT, RIGHT = "left", "right"  # ends of the names of recordings
BOTH = ", both legs"
SCALE_M = 20.0  # of the walk, from which the scale is taken
LEAST_REST_M = 5.0  # to be judged after that
COLUMNS = {
    "set": "set", "recording": "leg", "known": "known", "walked_m": "true m", "found_m": "found m", "error_m": "error m",
    "error_percent": "error %", "sd_m": "sd m", "error_over_sd": "error / sd", "stairs": "stairs",
}  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class LegRow:
    """One method by a leg, or by both, against the way of both feet."""

    set: str
    recording: str
    known: str
    walked_m: float
    found_m: float
    error_m: float
    error_percent: float
    sd_m: float
    error_over_sd: float | None
    stairs: int


def recordings_study(folder: Path) -> Study[LegRow, Row]:
    """The study of the recordings in this folder; raises EchostepError without any."""
    recordings = recordings_in(folder, SETS)
    return Study(
        "legs-recordings",
        (LegRow,),
        lambda _seed: [row for legs in (*((r,) for r in recordings), *pairs(recordings)) for row in rows_of(*legs)],
        lambda rows: [*as_dicts(rows), *method_means(rows)],
        _tables,
        runs=1,
        seeds=range(1),
        parquet=None,
    )


def pairs(recordings: Sequence[LegRecording]) -> list[tuple[LegRecording, LegRecording]]:
    """Both legs of each person, left and right."""
    by_name = {(r.group, r.name): r for r in recordings}
    wanted = [(r, (r.group, r.name.removesuffix(LEFT) + RIGHT)) for r in recordings if r.name.endswith(LEFT)]
    return [(left, by_name[right]) for left, right in wanted if right in by_name]


def rows_of(*legs: LegRecording) -> list[LegRow]:
    """One row for each method that this leg allows, or both legs of a person."""
    first, words = legs[0], "" if len(legs) == 1 else BOTH
    begin_s, end_s = first.walk_s()
    strides = strides_of(legs, StrideSettings())
    rows = [_row(first, NOTHING + words, strides, begin_s, end_s)]
    lengths = [(r.lengths.thigh_m, r.lengths.shank_m) for r in legs if r.lengths is not None]
    if lengths:
        known = strides_of(legs, StrideSettings(LegLengths(*np.mean(lengths, axis=0).tolist())))
        rows.append(_row(first, LENGTHS + words, known, begin_s, end_s))
    known_s = float(np.interp(first.walked_m(-math.inf, begin_s) + SCALE_M, first.way_m, first.way_s))
    measured_m = found_m(strides, begin_s, known_s)
    if measured_m > 0.0 and first.walked_m(known_s, end_s) > LEAST_REST_M:
        scale = first.walked_m(begin_s, known_s) / measured_m
        scaled = strides_of(legs, StrideSettings(LegLengths(scale=scale), calibrated=True))
        rows.append(_row(first, SCALE + words, scaled, known_s, end_s))
    if len(legs) > 1:
        rows = [replace(row, recording=first.name.removesuffix(LEFT) + "both") for row in rows]
    return rows


def strides_of(legs: Sequence[LegRecording], settings: StrideSettings) -> tuple[Stride, ...]:
    """What the method finds by one leg or both with the axes of walking of their sensors and the belt."""
    samples = [_samples(leg) for leg in legs]
    if len(samples) == 2:
        return track_pair(samples[0], samples[1], settings).strides
    return track_default(samples[0], settings).strides


def _samples(r: LegRecording) -> LegSamples:
    thigh, shank = (rates @ walking_axis(r.t_s, rates).axis for rates in (r.thigh, r.shank))
    return LegSamples(r.t_s, thigh, shank, r.belt, np.full(len(r.t_s), np.nan))


def found_m(strides: tuple[Stride, ...], begin_s: float, end_s: float) -> float:
    """Length of the strides between two times; one across an end counts in part."""
    return sum(s.length_m * _share(s, begin_s, end_s) for s in strides)


def _share(stride: Stride, begin_s: float, end_s: float) -> float:
    """The part of a stride's time between two times."""
    inside = min(stride.t_end_s, end_s) - max(stride.t_start_s, begin_s)
    return max(inside, 0.0) / max(stride.t_end_s - stride.t_start_s, 1e-9)


def _row(recording: LegRecording, known: str, strides: tuple[Stride, ...], begin_s: float, end_s: float) -> LegRow:
    inside = [s for s in strides if _share(s, begin_s, end_s) > 0.5]
    walked, measured_m, sd = recording.walked_m(begin_s, end_s), found_m(strides, begin_s, end_s), distance_sd_m(inside)
    error = measured_m - walked
    return LegRow(
        set=recording.group,
        recording=recording.name,
        known=known,
        walked_m=round(walked, 3),
        found_m=round(measured_m, 3),
        error_m=round(error, 3),
        error_percent=round(100.0 * error / walked, 2),
        sd_m=round(sd, 3),
        error_over_sd=round(error / sd, 2) if sd > 0.0 else None,
        stairs=sum(bool(s.flags & (Flag.STAIRS_UP | Flag.STAIRS_DOWN)) for s in inside),
    )


def method_means(rows: Sequence[LegRow]) -> list[Row]:
    """Of each method: mean absolute errors, the rms of error / sd, all strides that were read as stairs."""
    summaries = []
    for known in (known + words for words in ("", BOTH) for known in (NOTHING, LENGTHS, SCALE)):
        same = [row for row in rows if row.known == known]
        if not same:
            continue
        ratios = [row.error_over_sd for row in same if row.error_over_sd is not None]
        sizes = {
            key: round(fmean(abs(getattr(row, key)) for row in same), 3)
            for key in ("walked_m", "error_m", "error_percent")
        }
        summaries.append({
            "set": "all", "recording": f"mean absolute of {len(same)}, rms of error / sd", "known": known, **sizes,
            "error_over_sd": round(math.sqrt(fmean(r * r for r in ratios)), 2) if ratios else None,
            "stairs": sum(row.stairs for row in same),
        })  # fmt: skip
    return summaries


def _tables(rows: list[Row], _request: StudyRequest) -> list[Table]:
    note = "Real legs, one setting for all. known: what was known of the wearer; after the first 20 m only the rest is judged."
    return [Table("Legs on real recordings against the way of both feet", rows, COLUMNS, (note,))]
