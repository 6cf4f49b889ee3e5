# SPDX-License-Identifier: MIT
"""Leave-one-out check: errors on each set of recordings with constants chosen on the other sets only.

In: recordings. Out: for each set with a close truth the choice and the rows of its recordings under that choice. Owns nothing. Every combination
of the constants' halves and doubles is tried; the best has the least mean error of the sets, each error taken relative to that of the default.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from statistics import fmean

from msgspec import UNSET, UnsetType
from rich.progress import track as progress

from echostep.foot.ins import Noise
from echostep.foot.steps import Track
from echostep_app.output.table import console
from echostep_studies.bench.recordings.feet import FootRecording


@dataclass(frozen=True, slots=True, kw_only=True)
class FigureRow:
    """A figure in metres, or as the metric says; `left_out`: the same under the constants that the other sets would choose, where that was asked."""

    set: str
    recording: str
    metric: str
    value: float
    distance_m: float | None
    peer: float | None
    peer_name: str | None
    left_out: float | UnsetType | None = UNSET


CONSTANTS = ("accel", "gyro_share", "change_share", "lever_m")
FACTORS = (0.5, 1.0, 2.0)
LOOSE = ("mtw", "stairs")  # sets whose truth is too loose to choose by

TrackOf = Callable[[FootRecording, Noise | None], Track]


def leave_one_out(recordings: list[FootRecording], track_of: TrackOf) -> dict[str, Noise]:
    """For each set the constants that the other sets would choose."""
    close = [recording for recording in recordings if recording.group not in LOOSE]
    candidates = [_scaled(factors) for factors in itertools.product(FACTORS, repeat=len(CONSTANTS))]
    tried = progress(candidates, "leave one out", console=console)
    scores = [_errors(close, noise, track_of) for noise in tried]
    default = _errors(close, Noise(), track_of)
    groups = dict.fromkeys(recording.group for recording in recordings)
    return {group: candidates[_best(scores, default, without=group)] for group in groups}


def describe(noise: Noise) -> str:
    """Names and values of the constants."""
    return ", ".join(f"{name} {getattr(noise, name):g}" for name in CONSTANTS)


def with_left_out(rows: list[FigureRow], chosen: dict[str, list[FigureRow]]) -> list[FigureRow]:
    """Each figure under the other sets' choice beside the figure of the one setting, as `left_out`."""
    values = {(r.set, r.recording, r.metric): r.value for part in chosen.values() for r in part}
    return [replace(row, left_out=values.get((row.set, row.recording, row.metric))) for row in rows]


def _scaled(factors: tuple[float, ...]) -> Noise:
    default = Noise()
    return default._replace(**{name: k * getattr(default, name) for name, k in zip(CONSTANTS, factors, strict=True)})


def _errors(recordings: list[FootRecording], noise: Noise, track_of: TrackOf) -> dict[str, list[float]]:
    """The first figure of each recording, by set."""
    by_group: dict[str, list[float]] = {}
    for recording in recordings:
        first = recording.judge(track_of(recording, noise))[0]
        by_group.setdefault(recording.group, []).append(abs(first.value))
    return by_group


def _best(scores: list[dict[str, list[float]]], default: dict[str, list[float]], without: str) -> int:
    """Index of the candidate with the least mean logarithm of the errors against the default's, over the sets but one."""
    others = [group for group in default if group != without] or list(default)

    def score(errors: dict[str, list[float]]) -> float:
        return fmean(
            fmean(math.log(max(a, 1e-6) / max(b, 1e-6)) for a, b in zip(errors[g], default[g], strict=True))
            for g in others
        )

    return min(range(len(scores)), key=lambda k: score(scores[k]))
