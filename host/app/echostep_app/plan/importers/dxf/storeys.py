# SPDX-License-Identifier: MIT
"""Storeys of drawings by their walls: several side by side in one drawing, over each other, or apart.

In: walls of levels. Out: windows of a drawing, the move that lays one level over another. Owns the tests of storeys side by side and over each other.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely
from shapely.geometry import LineString

from echostep.arrays import Bools, Floats
from echostep_app.plan.importers.straight import pieces_of

APART = 0.05  # least distance between storeys beside each other, as a share of the drawing's size; assumed
LEAST_APART_M = 2.0
BORDER_M = 0.6  # a border is further from what it frames: more than a thick wall; assumed
LEAST_SHARE_APART = 0.25  # of that distance: a detail may lie close to a storey; assumed
LEAST_SHARE = 0.1  # of the longest group of walls: smaller groups are details; assumed
ALIKE = 0.4  # two storeys of one building differ by less than this share of their size; assumed
OVER = 0.3  # share of the smaller level's rectangle that lies over the other one's, in one building; assumed
GRID_M = 0.02  # step of the search for the move that aligns two levels
MOST_CELLS = 200_000
MOST_STOREYS = 12  # beside each other on one sheet; more are rooms; assumed
DOOR_M = 1.3  # widest door that a room may have; assumed
SAME_M, DEEP_M = 0.01, 0.5  # between walls that coincide; so far both walls go on beyond a crossing; assumed
COINCIDE, CROSSINGS = 0.1, 3  # share of the shorter storey's walls, number; from which two are over each other; assumed
Box = tuple[float, float, float, float]


def storey_boxes(walls: Sequence[LineString]) -> list[Box]:
    """Rectangles (m) of groups of walls that look like storeys drawn side by side; one rectangle when there is one group."""
    lines = np.array(list(walls), dtype=object)
    lines = lines[~_is_border(lines)]
    return _storeys(lines, _groups(lines, LEAST_SHARE_APART))


def beside_house(walls: Sequence[LineString]) -> tuple[int, Box] | None:
    """Number of lines outside the longest group of walls, and the group's rectangle (m): a frame, a title block, a north arrow."""
    lines = np.array(list(walls), dtype=object)
    x0, y0, x1, y1 = shapely.total_bounds(lines)
    around = np.abs(shapely.bounds(lines) - (x0, y0, x1, y1)).max(axis=1) < APART * max(x1 - x0, y1 - y0)
    if around.all():
        return None
    groups = _groups(lines[~around], 0.5)
    which, group = shapely.STRtree(groups).query(lines[~around], predicate="intersects")
    house = shapely.envelope(groups[np.bincount(group, shapely.length(lines[~around])[which]).argmax()])
    beside = shapely.distance(lines, house) > np.where(around, BORDER_M, 0.0)
    return (int(beside.sum()), house.bounds) if beside.any() else None


def _is_border(lines: np.ndarray[Any, Any]) -> Bools:
    """Which lines (n,) frame all others, and touch none: the border of a sheet."""
    x0, y0, x1, y1 = shapely.total_bounds(lines)
    around = np.abs(shapely.bounds(lines) - (x0, y0, x1, y1)).max(axis=1) < APART * max(x1 - x0, y1 - y0)
    if not around.any() or around.all():
        return np.zeros(len(lines), dtype=bool)
    apart = shapely.distance(shapely.union_all(lines[around]), shapely.multilinestrings(lines[~around]))
    return np.asarray(around & (apart > BORDER_M))


def _groups(lines: np.ndarray[Any, Any], share: float) -> np.ndarray[Any, Any]:
    """Areas (k,) around groups of lines (n,), at least this share of the usual distance apart."""
    x0, y0, x1, y1 = shapely.total_bounds(lines)
    margin = share * max(LEAST_APART_M, APART * max(x1 - x0, y1 - y0)) / 2
    blots = shapely.union_all(shapely.box(*(shapely.bounds(lines) + (-margin, -margin, margin, margin)).T))
    return np.asarray(shapely.get_parts(blots))


def _storeys(lines: np.ndarray[Any, Any], groups: np.ndarray[Any, Any]) -> list[Box]:
    """Rectangles of the groups of about the same size as the largest."""
    lengths = np.zeros(len(groups))
    which, group = shapely.STRtree(groups).query(lines, predicate="intersects")
    np.add.at(lengths, group, shapely.length(lines)[which])
    large = groups[lengths >= LEAST_SHARE * lengths.max()]
    first = large[np.argmax(shapely.area(large))] if len(large) else None
    storeys = [g for g in large if first is not None and _alike(g.bounds, first.bounds)]
    if 1 < len(storeys) <= MOST_STOREYS:
        storeys = [g for g in storeys if has_room(lines[shapely.intersects(lines, g)])]
    return sorted(g.bounds for g in storeys) if len(storeys) <= MOST_STOREYS else []


def has_room(lines: Sequence[LineString] | np.ndarray[Any, Any]) -> bool:
    """Whether walls enclose a space, but for doors."""
    if not len(lines):
        return False
    closed = shapely.union_all(shapely.buffer(np.asarray(lines, dtype=object), DOOR_M / 2, quad_segs=2))
    return any(part.interiors for part in shapely.get_parts(closed))


def drawn_over(one: Sequence[LineString], other: Sequence[LineString], most: float = math.inf) -> bool:
    """Whether walls are those of two storeys over each other: they cross well before their ends, or coincide, by up to the share `most`."""
    a, b = (shapely.linestrings(pieces_of(lines).reshape(-1, 2, 2)) for lines in (one, other))
    tree = shapely.STRtree(b)
    near = np.unique(tree.query(a, predicate="dwithin", distance=SAME_M)[1])
    bands = shapely.union_all(shapely.buffer(b[near], SAME_M, cap_style="flat"))
    shared_m = shapely.length(shapely.intersection(shapely.union_all(a), bands))
    if COINCIDE < shared_m / min(shapely.length(shapely.union_all(walls)) for walls in (a, b)) < most:
        return True
    i, j = tree.query(a, predicate="crosses")
    at = shapely.intersection(a[i], b[j])
    deep = [shapely.distance(at, shapely.boundary(line)) > DEEP_M for line in (a[i], b[j])]
    return int((deep[0] & deep[1]).sum()) >= CROSSINGS


def _alike(one: Box, other: Box) -> bool:
    sizes = [(one[k + 2] - one[k], other[k + 2] - other[k]) for k in (0, 1)]
    return all(abs(a - b) < ALIKE * max(a, b) for a, b in sizes)


def lies_over(one: Box, other: Box) -> bool:
    """Whether two levels' rectangles cover each other as levels of one building do."""
    a, b = shapely.box(*one), shapely.box(*other)
    return bool(a.intersection(b).area >= OVER * min(a.area, b.area))


def bounds_of(walls: Sequence[LineString]) -> Box:
    """The rectangle around lines."""
    x0, y0, x1, y1 = shapely.total_bounds(np.array(list(walls), dtype=object))
    return float(x0), float(y0), float(x1), float(y1)


def alignment(walls: Sequence[LineString], below: Sequence[LineString]) -> tuple[float, float]:
    """The move (m) that fits walls best to the level below: in x and in y separately, by the correlation of their length profiles."""
    return _shift(walls, below, 0), _shift(walls, below, 1)


def _shift(walls: Sequence[LineString], below: Sequence[LineString], axis: int) -> float:
    """The move along one axis: the peak of the correlation of both profiles."""
    (a, u), (b, v) = _profile_of(walls, axis), _profile_of(below, axis)
    origin_a, origin_b = float(a.min()), float(b.min())
    step = max(GRID_M, (np.ptp(a) + np.ptp(b)) / MOST_CELLS)
    first, second = (np.bincount(((p - p.min()) / step).astype(int), w) for p, w in ((a, u), (b, v)))
    blur = np.array([0.25, 0.5, 1.0, 0.5, 0.25])
    first, second = np.convolve(first, blur), np.convolve(second, blur)
    size = 1 << (len(first) + len(second)).bit_length()
    peaks = np.fft.irfft(np.conj(np.fft.rfft(first, size)) * np.fft.rfft(second, size), size)
    best = int(np.argmax(peaks))
    lag = best - size if best > size // 2 else best
    return round(origin_b - origin_a + lag * step, 3)


def _profile_of(walls: Sequence[LineString], axis: int) -> tuple[Floats, Floats]:
    """Positions (n,) along an axis of the pieces that run across it, and their lengths; of all pieces if none does."""
    pieces = pieces_of(walls)
    step = pieces[:, 2:] - pieces[:, :2]
    across = np.abs(step[:, axis]) < 0.02 * np.hypot(*step.T)
    chosen = pieces[across] if across.any() else pieces
    weights = np.hypot(*(chosen[:, 2:] - chosen[:, :2]).T)
    return (chosen[:, axis] + chosen[:, axis + 2]) / 2, weights


def window_words(boxes: Sequence[Box], scale_m: float) -> str:
    """Options --window for rectangles in metres, in drawing units."""
    windows = [[value / scale_m for value in box] for box in boxes]
    digits = max(0, 2 - math.floor(math.log10(max(abs(value) for window in windows for value in window) or 1.0)))
    return " ".join("--window " + ",".join(f"{value:.{digits}f}" for value in window) for window in windows)
