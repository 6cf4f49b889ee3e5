# SPDX-License-Identifier: MIT
"""Lengths of a drawing in its own units, by which its units are judged.

In: entities by kind. Out: lengths by the keys of `units.USUAL`. Owns how each is measured.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from echostep.arrays import Floats
from echostep_app.plan.importers.dxf.entities import parts
from echostep_app.plan.importers.dxf.frame import corners
from echostep_app.plan.importers.dxf.layers import parallels

MOST_PIECES = 5000  # the longest ones, whose distances are measured
MOST_SYMBOLS = 500  # of doors that are measured
INNER = (0.02, 0.98)  # quantiles of the corners that count, without stray lines
STRAY = 1000.0  # a piece this many times longer than the median is not a wall, but an error of the drawing; assumed
THIN = 0.08  # ratio of distance to length of parallel lines below which they are the faces of a wall, not of a room; assumed
Box = tuple[float, float, float, float]


def lengths_of(by_kind: Mapping[str, Sequence[Any]], file: Path) -> dict[str, float]:
    """The lengths that the drawing has, in its units."""
    lengths: dict[str, float] = {}
    pieces = pieces_of_entities(by_kind["walls"])
    if len(pieces):
        low, high = np.quantile(pieces.reshape(-1, 2), INNER, axis=0)
        lengths["size"] = float((high - low).max())
        length = np.hypot(*(pieces[:, 2:] - pieces[:, :2]).T)
        lengths["wall"] = median(length, length)
        longest = np.argsort(-length)[:MOST_PIECES]
        spacing, _ = parallels(pieces[longest], 2 * THIN * lengths["wall"])
        thickness = median(spacing, length[longest])
        if thickness < THIN * lengths["wall"]:
            lengths["thickness"] = thickness
    radii = [radius for entity in by_kind["doors"][:MOST_SYMBOLS] for radius in _radii(entity, file)]
    if radii:
        lengths["door"] = float(np.median(radii))
    heights = [height for entity in by_kind["rooms"] if (height := _height(entity)) > 0.0]
    if heights:
        lengths["text"] = float(np.median(heights))
    return lengths


def pieces_of_entities(entities: Sequence[Any]) -> Floats:
    """The straight pieces (n, 4) of entities, in drawing units, without stray ones."""
    rows = [np.concatenate((points[:-1], points[1:]), axis=1) for entity in entities for points in corners(entity)]
    pieces = np.concatenate((np.zeros((0, 4)), *rows))
    length = np.hypot(*(pieces[:, 2:] - pieces[:, :2]).T)
    pieces, length = pieces[length > 0.0], length[length > 0.0]
    return pieces[length <= STRAY * np.sort(length)[(len(length) - 1) // 2]] if len(length) else pieces


def median(values: Floats, weights: Floats) -> float:
    """The weighted median: half of the weight lies at values as small or smaller."""
    order = np.argsort(values)
    return float(values[order][np.searchsorted(np.cumsum(weights[order]), 0.5 * weights.sum())])


def _radii(entity: Any, file: Path) -> Iterator[float]:
    """Radii of the swings of a door symbol."""
    if entity.dxftype() == "INSERT":
        inner = [radius for part in parts(entity, file) if part.dxftype() == "ARC" for radius in _radii(part, file)]
        yield from [max(inner)] if inner else []  # the leaf's radius; smaller ones belong to its handle
    elif entity.dxftype() == "ARC":
        sweep = (entity.dxf.end_angle - entity.dxf.start_angle) % 360.0
        radius = float(entity.dxf.radius)
        if 60.0 <= sweep <= 120.0 and math.isfinite(radius) and radius > 0.0:
            yield radius


def _height(entity: Any) -> float:
    """Height of the letters of a text; 0 for other entities."""
    name = {"TEXT": "height", "ATTRIB": "height", "MTEXT": "char_height"}.get(entity.dxftype())
    value = float(entity.dxf.get(name, 0.0)) if name else 0.0
    return value if math.isfinite(value) else 0.0
