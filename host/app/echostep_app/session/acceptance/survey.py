# SPDX-License-Identifier: MIT
"""Surveyed points: along the middle of a corridor whose lengths were measured with a tape, or in a file beside a plan.

In: the lengths of a corridor; a plan and a file of points. Out: `Protocol`. Owns the places of the points in a corridor. Every error is one line.
"""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np

from echostep.errors import EchostepError
from echostep.plan import Level, Plan, Pose
from echostep_app.plan.importers.limited import open_limited
from echostep_app.plan.writer import plan_json
from echostep_app.ports.tap import MOST_POINTS
from echostep_app.scorecard.csv_columns import CsvColumns, read_csv
from echostep_app.session.acceptance.protocol import Point, Protocol

# Assumed, all of them.
LENGTH_M, WIDTH_M = (6.0, 200.0), (0.8, 20.0)  # of a corridor
POINTS, FROM_END_M = 5, 1.0  # of a corridor; of the first and the last point
NEEDED = ("name", "x_m", "y_m")  # columns of a file of points


def corridor(text: str) -> Protocol:
    """The protocol of LENGTHxWIDTH in metres: five points along the middle, the first and the last 1 m from the ends. Raises EchostepError."""
    match = re.fullmatch(r"(\d{1,3}(?:\.\d{1,3})?)x(\d{1,3}(?:\.\d{1,3})?)", text)
    length_m, width_m = (float(part) for part in match.groups()) if match else (0.0, 0.0)
    if not (LENGTH_M[0] <= length_m <= LENGTH_M[1] and WIDTH_M[0] <= width_m <= WIDTH_M[1]):
        raise EchostepError(
            f"--corridor {text}: expected LENGTHxWIDTH in metres, as 20x2.05: length {LENGTH_M[0]:g} to {LENGTH_M[1]:g}, "
            f"width {WIDTH_M[0]:g} to {WIDTH_M[1]:g}"
        )
    corners = [(0.0, 0.0), (length_m, 0.0), (length_m, width_m), (0.0, width_m)]
    walls = np.array([(*a, *b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True)])
    along = np.linspace(FROM_END_M, length_m - FROM_END_M, POINTS).round(3)
    points = tuple(Point(str(k), x_m, 0.5 * width_m) for k, x_m in enumerate(along.tolist(), 1))
    return _starting(Plan(f"corridor {length_m:g} x {width_m:g} m", (Level("", 0.0, walls),), None, ""), points)


def surveyed(plan_path: Path, points_path: Path) -> Protocol:
    """The protocol of a building: its plan, and a CSV file with the columns name, x_m, y_m, and level on several. Raises EchostepError."""
    plan, table = open_limited(plan_path), read_csv(points_path)
    for name in NEEDED:
        if name not in table.names:
            raise EchostepError(
                f"{points_path}:1: no column {name}: expected name,x_m,y_m and, on several floors, level"
            )
    if not 2 <= len(table.rows) <= MOST_POINTS:
        raise EchostepError(f"{points_path}: {len(table.rows)} points, expected 2 to {MOST_POINTS}")
    places = zip(
        table.texts("name"), *(table.numbers(axis).tolist() for axis in NEEDED[1:]), _levels(table, plan), strict=True
    )
    return _starting(plan, tuple(_point(table, row, *place) for row, place in enumerate(places)))


def _point(table: CsvColumns, row: int, name: str, x_m: float, y_m: float, level: int) -> Point:
    try:
        return msgspec.convert({"name": name, "x_m": x_m, "y_m": y_m, "level": level}, Point)
    except msgspec.ValidationError as error:
        raise EchostepError(f"{table.path}:{table.lines[row]}: not a point: {error}") from error


def _levels(table: CsvColumns, plan: Plan) -> list[int]:
    """Level of each point, by name or by index; the first one without a column."""
    if "level" not in table.names:
        return [0] * len(table.rows)
    index = {str(k): k for k in range(len(plan.levels))} | {level.name: k for k, level in enumerate(plan.levels)}
    levels = []
    for row, text in enumerate(table.texts("level")):
        if text not in index:
            raise table.error(row, "level", f"{text[:40]!r} is no level of the plan: it has {', '.join(index)}")
        levels.append(index[text])
    return levels


def _starting(plan: Plan, points: tuple[Point, ...]) -> Protocol:
    """The protocol with the start at the first point, looking to the second."""
    first, second = points[:2]
    heading_rad = math.atan2(second.y_m - first.y_m, second.x_m - first.x_m)
    start = Pose(first.x_m, first.y_m, heading_rad, first.level)
    return Protocol(points, plan_json(replace(plan, start=start)))
