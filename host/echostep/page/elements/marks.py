# SPDX-License-Identifier: MIT
"""Marks that commanders set, as pages show them: a cleared room, a hazard, a meeting point.

In: nothing. Out: the type. Owns nothing.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ShownMark:
    """A mark of kind `mark` at a place; `by`: who set it. The names are keys of the frame's JSON."""

    id: str
    mark: str
    x_m: float
    y_m: float
    level: int
    by: str
