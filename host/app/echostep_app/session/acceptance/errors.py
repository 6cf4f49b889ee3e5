# SPDX-License-Identifier: MIT
"""Errors at the tapped points, by ISO/IEC 18305 and against the radius that was stated there.

In: a `Walked`. Out: `Scored` of all taps, of those standing and of those passing; the mean error at each point. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from echostep.errors import EchostepError
from echostep_app.scorecard.card import Scored, score
from echostep_app.scorecard.matching import PATH_S
from echostep_app.scorecard.own_track import track_of
from echostep_app.scorecard.track_columns import ScoredPath
from echostep_app.session.acceptance.walked import TimedTap, Walked


class PointError(NamedTuple):
    """A point by its name: taps, mean error vector and mean distance (m)."""

    name: str
    taps: int
    x_m: float
    y_m: float
    mean_m: float


def score_taps(walked: Walked, taps: Sequence[TimedTap]) -> Scored:
    """Compare the estimates with the points at the times of their taps; raises EchostepError when there is nothing to compare."""
    path, points, plan = walked.recording.path, walked.protocol.points, walked.plan
    if not taps or not walked.estimates:
        what = "no position" if taps else "no tap"
        raise EchostepError(f"{path}: {what} in it, so no error: echostep info {path} shows what was recorded")
    t_s = np.array([tap.t_s for tap in taps])
    if len(taps) > 1 and float(np.median(np.diff(t_s))) <= PATH_S:
        raise EchostepError(
            f"{path}: most taps came within {PATH_S:g} s of the one before: no walk from point to point"
        )
    at = [points[tap.point] for tap in taps]
    floors = len(plan.levels) > 1
    truth = ScoredPath(
        Path("points"), t_s, np.array([(p.x_m, p.y_m) for p in at]), np.zeros(len(taps), bool), {},
        height_m=np.array([plan.levels[p.level].height_m for p in at]) if floors else None,
        level=np.array([float(p.level) for p in at]) if floors else None,
    )  # fmt: skip
    return score(track_of(walked.estimates, str(path)), truth)


def by_point(walked: Walked, scored: Scored) -> list[PointError]:
    """The errors at each point that was tapped, in the order of the points."""
    at = scored.matched
    rows = []
    for point in walked.protocol.points:
        here = (at.true_xy_m == (point.x_m, point.y_m)).all(axis=1)
        if at.true_level is not None:
            here &= at.true_level == point.level
        if here.any():
            x_m, y_m = (at.xy_m - at.true_xy_m)[here].mean(axis=0).tolist()
            rows.append(PointError(point.name, int(here.sum()), x_m, y_m, float(at.error_m[here].mean())))
    return rows
