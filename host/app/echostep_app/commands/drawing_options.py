# SPDX-License-Identifier: MIT
"""Options of `plan import` that describe a drawing.

In: texts of the command line. Out: values of `Hints`, and rectangles. Owns their grammar; every error repeats the option.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from echostep.errors import EchostepError

FARTHEST = 1e12  # of a coordinate in drawing units: millimetres of a national grid are below 1e10


def unit_of(name: str | None) -> str | None:
    """A unit that drawings may have."""
    from echostep_app.plan.importers.dxf.frame import METRES

    if name is not None and name not in METRES:
        raise EchostepError(f"--units {name}: expected one of {', '.join(METRES)}")
    return name


def layers_of(texts: Sequence[str]) -> dict[str, list[str]]:
    """Patterns of layers by kind."""
    from echostep_app.plan.importers.dxf.layers import LAYERS

    layers: dict[str, list[str]] = {}
    for text in texts:
        kind, _, pattern = text.partition("=")
        if kind not in LAYERS or not pattern:
            raise EchostepError(f"--layer {text}: expected KIND=PATTERN with KIND one of {', '.join(LAYERS)}")
        layers.setdefault(kind, []).append(pattern)
    return layers


def scale_of(text: str | None, units: str | None) -> float | None:
    """Metres a unit: given as such, or as two points of the drawing and their distance in metres."""
    if text is None:
        return None
    if units is not None:
        raise EchostepError(f"--scale {text}: give --scale or --units, not both")
    points, equals, distance = text.partition("=")
    wrong = EchostepError(
        f"--scale {text}: expected metres a unit, as 0.0254, or two points and their distance, as 0,0,1250,0=8.5"
    )
    try:
        metres = float(distance if equals else text)
        x0, y0, x1, y1 = (float(part) for part in points.split(",")) if equals else (0.0, 0.0, 1.0, 0.0)
        scale = metres / math.dist((x0, y0), (x1, y1))
    except (ValueError, ZeroDivisionError) as error:
        raise wrong from error
    if not 1e-6 <= scale <= 1e4:
        raise wrong
    return scale


def windows_of(texts: Sequence[str]) -> list[tuple[float, float, float, float]]:
    """Rectangles in drawing units."""
    return [rectangle("--window", text, FARTHEST, "drawing units") for text in texts]


def rectangle(option: str, text: str, farthest: float, units: str) -> tuple[float, float, float, float]:
    """X0,Y0,X1,Y1 as numbers."""
    try:
        x0, y0, x1, y1 = (float(part) for part in text.split(","))
    except ValueError as error:
        raise EchostepError(f"{option} {text}: expected X0,Y0,X1,Y1 in {units}") from error
    if not (abs(x0) < farthest and abs(y0) < farthest and x0 < x1 < farthest and y0 < y1 < farthest):
        raise EchostepError(f"{option} {text}: expected X0 < X1 and Y0 < Y1")
    return x0, y0, x1, y1
