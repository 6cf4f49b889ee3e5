# SPDX-License-Identifier: MIT
"""Evaluation points: where a track and the truth are compared.

In: a track, a true path. Out: `Matched`: both at the same moments. Owns nothing.

A true path with rows close together is known at every moment: the points are the track's rows, the truth linear in between. Surveyed points are known
at their moments alone: the points are theirs, the track linear between two rows that are at most GAP_S apart.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echostep.arrays import Bools, Floats, Ints
from echostep.errors import EchostepError
from echostep_app.scorecard.track_columns import ScoredPath

PATH_S = 0.5  # median distance of a path's rows, above which they are surveyed points: less than a step
# Time without a row after which a track has no position: rows come at each step, and twice a second while standing
GAP_S = 2.5


@dataclass(frozen=True, slots=True)
class Matched:
    """A track and the truth at n points: places (n, 2) in metres, heights (n,), floors (n,); None where one of the two does not state them.

    `row` (n,): the track's row at the point, or the newest one before it.
    """

    t_s: Floats
    xy_m: Floats
    true_xy_m: Floats
    row: Ints
    height_m: Floats | None
    true_height_m: Floats | None
    level: Floats | None
    true_level: Floats | None

    @property
    def error_m(self) -> Floats:
        """Horizontal errors (n,)."""
        return np.asarray(np.hypot(*(self.xy_m - self.true_xy_m).T))


def is_surveyed(truth: ScoredPath) -> bool:
    """Whether the truth is surveyed points, not a path."""
    return len(truth.t_s) < 2 or float(np.median(np.diff(truth.t_s))) > PATH_S


def match(track: ScoredPath, truth: ScoredPath) -> Matched:
    """The evaluation points; raises EchostepError where the two have no moment in common."""
    surveyed = is_surveyed(truth)
    grid, other = (truth, track) if surveyed else (track, truth)
    chosen = np.flatnonzero((grid.t_s >= other.t_s[0]) & (grid.t_s <= other.t_s[-1]))
    if surveyed:
        chosen = chosen[_near(track.t_s, truth.t_s[chosen])]
    if not len(chosen):
        raise EchostepError(
            f"{track.path}: no row within the time of {truth.path} ({truth.t_s[0]:g} to {truth.t_s[-1]:g} s; "
            f"the track's is {track.t_s[0]:g} to {track.t_s[-1]:g} s): both need the same clock"
        )
    t_s = grid.t_s[chosen]
    row = np.searchsorted(track.t_s, t_s, side="right") - 1 if surveyed else chosen
    true_row = chosen if surveyed else np.searchsorted(truth.t_s, t_s, side="right") - 1
    levels = track.level is not None and truth.level is not None
    heights = track.height_m is not None and truth.height_m is not None
    return Matched(
        t_s,
        np.column_stack([_at(track, track.xy_m[:, k], t_s, row, exact=not surveyed) for k in (0, 1)]),
        np.column_stack([_at(truth, truth.xy_m[:, k], t_s, true_row, exact=surveyed) for k in (0, 1)]),
        row,
        _at(track, track.height_m, t_s, row, exact=not surveyed) if heights else None,
        _at(truth, truth.height_m, t_s, true_row, exact=surveyed) if heights else None,
        track.level[row] if levels and track.level is not None else None,
        truth.level[true_row] if levels and truth.level is not None else None,
    )


def _at(path: ScoredPath, values: Floats | None, t_s: Floats, row: Ints, *, exact: bool) -> Floats:
    """Values of a path at times (m,): the rows' values (m,) if they are exact, else linear between the rows."""
    assert values is not None
    return values[row] if exact else np.asarray(np.interp(t_s, path.t_s, values))


def _near(t_s: Floats, at: Floats) -> Bools:
    """Which times lie between two rows that are at most GAP_S apart."""
    after = np.clip(np.searchsorted(t_s, at, side="left"), 0, len(t_s) - 1)
    before = np.clip(np.searchsorted(t_s, at, side="right") - 1, 0, len(t_s) - 1)
    return np.asarray(t_s[after] - t_s[before] <= GAP_S)


def known(track: ScoredPath, t_s: Floats) -> Bools:
    """At which times (m,) a track has a row at most GAP_S old that is not marked lost."""
    row = np.searchsorted(track.t_s, t_s, side="right") - 1
    fresh = (row >= 0) & (t_s - track.t_s[np.maximum(row, 0)] <= GAP_S)
    return np.asarray(fresh & ~track.lost[np.maximum(row, 0)])
