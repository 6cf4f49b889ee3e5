# SPDX-License-Identifier: MIT
"""Errors of estimates against the truth, where it is known.

In: truth.csv (`t_s,x,y,heading_rad`, the trunk, map frame) and estimates. Out: `Errors`. Owns nothing.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.localization import Estimate
from echostep.offline.csv_table import GREATEST
from echostep_app.printing.lines import as_error
from echostep_app.scorecard.error_statistics import error_statistics

NEARBY_S = 2.5  # estimates come at each step, and twice a second while standing


@dataclass(frozen=True, slots=True)
class Truth:
    """True positions of the trunk: `t_s` (n,), `xy_m` (n, 2)."""

    t_s: Floats
    xy_m: Floats

    def at(self, t_s: Floats) -> Floats:
        """Positions (m, 2) at times (m,), linear between the rows."""
        return np.column_stack([np.interp(t_s, self.t_s, self.xy_m[:, k]) for k in (0, 1)])

    def between(self, estimates: Sequence[Estimate]) -> Floats:
        """True positions (n, 2) near the times of estimates; NaN where no estimate is within NEARBY_S."""
        t_s = np.array([e.t_s for e in estimates])
        if not len(t_s):
            return np.zeros((0, 2))
        after = np.abs(self.t_s - t_s[np.clip(np.searchsorted(t_s, self.t_s), 0, len(t_s) - 1)])
        before = np.abs(self.t_s - t_s[np.clip(np.searchsorted(t_s, self.t_s) - 1, 0, len(t_s) - 1)])
        positions: Floats = np.where((np.minimum(after, before) < NEARBY_S)[:, None], self.xy_m, np.nan)
        return positions


@dataclass(frozen=True, slots=True)
class Errors:
    """Horizontal error in metres over the estimates; `coverage95`: share of them whose 95 % ellipse holds the truth."""

    mean_m: float
    sd_m: float
    max_m: float
    min_m: float
    ending_m: float
    rmse_m: float
    coverage95: float


def load_truth(path: Path | str) -> Truth:
    """Truth from a CSV file; raises EchostepError that names the file."""
    try:
        # Warnings of a file without rows: reported below
        with as_error(f"{path}: cannot read the truth"), warnings.catch_warnings(action="ignore"):
            table = np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2)
    except ValueError as error:
        why = "no text" if isinstance(error, UnicodeError) else error
        raise EchostepError(f"{path}: not a truth file (t_s,x,y,...): {why}") from error
    if table.shape[1] < 3 or not len(table) or not (np.abs(table) <= GREATEST).all():
        raise EchostepError(
            f"{path}: not a truth file: rows of t_s,x,y[,heading_rad] expected, numbers up to {GREATEST:g}"
        )
    return Truth(table[:, 0], table[:, 1:3])


def errors(estimates: Sequence[Estimate], truth: Truth) -> Errors | None:
    """Errors over the estimates within the truth's time, or None."""
    inside = [e for e in estimates if truth.t_s[0] <= e.t_s <= truth.t_s[-1]]
    if not inside:
        return None
    true_xy_m = truth.at(np.array([e.t_s for e in inside]))
    off = np.array([(e.x_m, e.y_m) for e in inside]) - true_xy_m
    distance = np.hypot(off[:, 0], off[:, 1])
    held = [e.holds(x, y) for e, (x, y) in zip(inside, true_xy_m.tolist(), strict=True)]
    statistics = error_statistics(distance)
    return Errors(
        statistics.mean_m,
        statistics.sd_m,
        statistics.max_m,
        statistics.min_m,
        statistics.ending_m,
        statistics.rms_m,
        float(np.mean(held)),
    )
