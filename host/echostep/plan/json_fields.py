# SPDX-License-Identifier: MIT
"""Checks of fields in untrusted JSON.

In: a value and its path in the file, as `levels[0].doors[2].line`. Out: the value with its type, or a ValueError that begins with the path.
Owns nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain, groupby
from typing import Any

import numpy as np

from echostep.arrays import Floats

MOST_CORNERS = 10_000  # of an outline: a room of a drawing with arcs has hundreds
LIMIT_M = 1e5  # greatest coordinate: 100 km, more than any site


def number(value: Any, where: str, limit: float = LIMIT_M, unit: str = "m") -> float:
    """A finite number within +-limit."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= limit:
        raise ValueError(f"{where}: {_short(value)} is not a finite number within {limit:.0f} {unit}")
    return float(value)


def text(value: Any, where: str) -> str:
    """A string that can be written as UTF-8."""
    if not isinstance(value, str) or any("\ud800" <= letter <= "\udfff" for letter in value):
        raise ValueError(f"{where}: {_short(value)} is not a text")
    return value


def choice(value: Any, where: str, words: Sequence[str]) -> str:
    """One of these words."""
    if not isinstance(value, str) or value not in words:
        raise ValueError(f"{where}: {_short(value)} is none of {', '.join(words)}")
    return value


def typed(value: Any, where: str, kind: type) -> Any:
    """A value of type `kind`: list, or dict (an object)."""
    if not isinstance(value, kind):
        raise ValueError(f"{where}: expected {'a list' if kind is list else 'an object'}, found {type(value).__name__}")
    return value


def point(value: Any, where: str) -> tuple[float, float]:
    """[x, y] in metres."""
    if len(typed(value, where, list)) != 2:
        raise ValueError(f"{where}: expected [x, y]")
    return number(value[0], where), number(value[1], where)


def outline(value: Any, where: str) -> Floats:
    """An outline of at least three corners -> (n, 2) float64; corners repeated one after the other are one."""
    rows = typed(value, where, list)
    if len(rows) > MOST_CORNERS:
        raise ValueError(f"{where}: {len(rows)} corners, expected {MOST_CORNERS} at most")
    points = [point(row, f"{where}[{i}]") for i, row in enumerate(rows)]
    corners = [corner for corner, _ in groupby(points)]
    if len(corners) > 1 and corners[0] == corners[-1]:
        corners.pop()
    if len(set(corners)) < 3:
        raise ValueError(f"{where}: an outline needs at least three different corners")
    return np.array(corners, dtype=np.float64)


def segments(rows: Any, where: str) -> Floats:
    """Lists [x0, y0, x1, y1] -> (n, 4) float64; each segment must have a length."""
    rows = typed(rows, where, list)
    valid = _all_valid(rows)
    return _checked(rows, where) if valid is None else valid


def _all_valid(rows: list[Any]) -> Floats | None:
    """All segments when all are valid, else None. Checks them at once, because a plan of a city has a million walls."""
    if set(map(type, rows)) != {list} or set(map(len, rows)) != {4}:
        return None
    if not set(map(type, chain.from_iterable(rows))) <= {int, float}:
        return None
    try:
        values = np.array(rows, dtype=np.float64)
    except OverflowError:
        return None
    within = (np.abs(values) <= LIMIT_M).all() and (values[:, :2] != values[:, 2:]).any(1).all()
    return values if within else None


def _checked(rows: list[Any], where: str) -> Floats:
    """Check one segment after the other, so that the error names the invalid one."""
    for i, row in enumerate(rows):
        segment(row, f"{where}[{i}]")
    return np.array(rows, dtype=np.float64).reshape(-1, 4)


def segment(row: Any, where: str) -> tuple[float, float, float, float]:
    """[x0, y0, x1, y1] in metres, with a length."""
    if not isinstance(row, list) or len(row) != 4:
        raise ValueError(f"{where}: expected [x0, y0, x1, y1] in metres")
    x0, y0, x1, y1 = (number(value, where) for value in row)
    if (x0, y0) == (x1, y1):
        raise ValueError(f"{where}: a wall without length: both ends are the same point")
    return x0, y0, x1, y1


def _short(value: Any) -> str:
    """The value as shown in an error, at most 60 characters."""
    if isinstance(value, int) and not isinstance(value, bool) and value.bit_length() > 1000:
        return "a huge number"
    shown = repr(value)
    return shown if len(shown) <= 60 else shown[:57] + "..."
