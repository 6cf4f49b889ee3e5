# SPDX-License-Identifier: MIT
"""The estimates of a walk as columns, and as track.csv.

In: estimates, a plan. Out: columns by name; a CSV file. Owns the names of the columns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from echostep.additions import added
from echostep.errors import EchostepError
from echostep.file_mode import write_csv
from echostep.localization import Estimate
from echostep.plan import Plan

Columns = dict[str, list[Any]]
COLUMNS = (
    "t_s", "x_m", "y_m", "heading_rad", "xx_m2", "xy_m2", "yy_m2", "heading_sd_rad", "step", "status", "level", "z_m", "z_sd_m",
    "protection_m", "right", "outside", "plan_fits",
)  # fmt: skip
HYPOTHESES = "hypotheses"  # the last column: probability:x,y,level of each place that fits
PLACE = ("longitude_deg", "latitude_deg")  # additional columns, where the plan has a georeference


def columns_of(estimates: list[Estimate], plan: Plan) -> Columns:
    """The estimates' fields by name; on a plan with a georeference longitude and latitude, empty without pyproj and where no place is claimed."""
    columns: Columns = {f.name: [getattr(e, f.name) for e in estimates] for f in fields(Estimate)}
    columns["status"] = [e.status.value for e in estimates]
    columns["hypotheses"] = [" ".join(map(str, e.hypotheses)) for e in estimates]
    if plan.georeference and (earth_of := added("earth")):
        columns |= dict.fromkeys(PLACE, [None] * len(estimates))
        if earth := earth_of(plan):  # pyproj is installed
            degrees = earth.degrees(np.array([(e.x_m, e.y_m) for e in estimates]))
            for name, column in zip(PLACE, degrees.T.tolist(), strict=True):
                columns[name] = [v if e.claims_place else None for v, e in zip(column, estimates, strict=True)]
    return columns


def refuse_none(estimates: list[Estimate], path: Path) -> None:
    """Raises EchostepError for a recording without estimates."""
    if not estimates:
        raise EchostepError(f"{path}: no estimate: the foot never stood still, or no bytes of its sensor came")


def write_track(path: Path, estimates: Sequence[Estimate]) -> None:
    """Write estimates as CSV; numbers read back to the same bits."""
    rows = ([*(getattr(e, name) for name in COLUMNS), " ".join(map(str, e.hypotheses))] for e in estimates)
    write_csv(path, [*COLUMNS, HYPOTHESES], rows)
