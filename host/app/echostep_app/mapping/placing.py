# SPDX-License-Identifier: MIT
"""Where a walk of unknown start lies on the drawing of another one.

In: fragments of both, each in its own map. Out: `Place`, with its odds. Owns the limits. The log-ratio of every turn and shift against two
places that have nothing in common is a correlation of the walls of each with the state of the other at a place (a wall seen from here, free floor,
unknown), summed by Fourier transforms over all shifts.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy import fft

from echostep.angles import wrap
from echostep.arrays import Floats, Ints
from echostep_app.mapping.graph.graph import Graph

CELL_M = 0.15
SIDES = 4  # directions from which a wall is seen, a right angle apart
OFF_SD_M = 0.15  # of one wall in two drawings: both bend
BAND_M = np.array([-0.3, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3])  # across a wall, where its ratio is above 1
CHANCE_M = 1.5  # half width within which another wall would lie anywhere
# Share of unexplained walls; ratio of a wall in space that was free [as in matching.py]
OUTLIER, FREE_RATIO = 0.1, math.log(0.15)
FREE_M = 0.35  # before a wall, from which the floor is free
POWER = 0.5  # of each metre of wall: errors of a stretch are shared
LEAST_HALF_M = 0.25  # of a fragment
APART_M, APART_RAD = 1.0, math.radians(10.0)  # two places nearer than this are one
MODES = 6  # places of each turn that are compared
RIVAL = 1000.0  # odds of the best place against another one, below which both are possible
ANY_TURN_RAD = np.radians(np.arange(0.0, 360.0, 3.0))  # tried where a building has no directions


class Scene(NamedTuple):
    """Evidence of a walk: places on walls (w, 2) with the direction from the path to the wall, the node of each; places of free floor (k, 2)."""

    wall_m: Floats
    normal_rad: Floats
    node: Ints
    free_m: Floats


class Place(NamedTuple):
    """The new map is turned by `turn_rad` about its origin, then moved by `shift_m` (2,).

    `log_odds`: against all other places and a new building together. `rivals`: other places within odds of RIVAL. `common_m`: length of new wall on
    known wall; `against_m`: length of walls of either in the free floor of the other. `node`: of the new walk, amid the stretch that fits best.
    """

    turn_rad: float
    shift_m: Floats
    log_odds: float
    rivals: int = 0
    common_m: float = 0.0
    against_m: float = 0.0
    node: int = 0

    def moved(self, points: Floats) -> Floats:
        """Points (n, 2) of the new map on the old one."""
        moved_points: Floats = points @ _turned(self.turn_rad).T + self.shift_m
        return moved_points


def scene_of(graph: Graph) -> Scene:
    """The places on the fragments of a solved graph, and on the floor before them, CELL_M apart."""
    f = graph.fragments
    centre, normal = graph.places()
    range_m = np.hypot(*(centre - graph.pose[f.node, :2]).T)
    walls, normals, nodes, free = [np.zeros((0, 2))], [np.zeros(0)], [np.zeros(0, np.int64)], [np.zeros((0, 2))]
    for k in np.flatnonzero(f.half_m > LEAST_HALF_M).tolist():
        ahead = np.array([math.cos(normal[k]), math.sin(normal[k])])
        along = np.arange(-f.half_m[k], f.half_m[k], 0.5 * CELL_M)
        on_wall = centre[k] + along[:, None] * [-ahead[1], ahead[0]]
        before = np.arange(FREE_M, range_m[k], 0.7 * CELL_M)
        walls.append(on_wall)
        normals.append(np.full(len(along), normal[k]))
        nodes.append(np.full(len(along), f.node[k]))
        free.append((on_wall[None] - before[:, None, None] * ahead).reshape(-1, 2))
    return Scene(np.concatenate(walls), np.concatenate(normals), np.concatenate(nodes), np.concatenate(free))


class _Images(NamedTuple):
    """Cells from `low` (2,) on: `wall` (SIDES, x, y): 1 where one is seen from this side; `ratio`: log-ratio of such a wall there by the scene."""

    low: Ints
    wall: Floats
    ratio: Floats


def _images(scene: Scene, turn_rad: float, base_rad: float) -> _Images:
    """Images of a turned scene; sides are counted from `base_rad`."""
    turned = _turned(turn_rad).T
    points = np.concatenate([scene.wall_m, scene.free_m]) @ turned
    low = np.floor(points.min(0) / CELL_M).astype(np.int64) - 4
    size = np.floor(points.max(0) / CELL_M).astype(np.int64) + 5 - low
    wall, ratio = np.zeros((2, SIDES, *size))
    side = np.round((scene.normal_rad + turn_rad - base_rad) / (2.0 * math.pi / SIDES)).astype(np.int64) % SIDES
    on_wall = points[: len(scene.wall_m)]
    x, y = _cells(points[len(scene.wall_m) :], low)
    ratio[:, x, y] = FREE_RATIO
    normal = scene.normal_rad + turn_rad
    ahead = np.column_stack([np.cos(normal), np.sin(normal)])
    bands = [_cells(on_wall + off * ahead, low) for off in BAND_M]
    for x, y in bands:
        ratio[:, x, y] = 0.0
    for off, (x, y) in zip(BAND_M, bands, strict=True):
        density = math.exp(-0.5 * (off / OFF_SD_M) ** 2) / (OFF_SD_M * math.sqrt(2.0 * math.pi))
        value = math.log(OUTLIER + (1.0 - OUTLIER) * density * 2.0 * CHANCE_M)
        np.maximum.at(ratio, (side, x, y), value)
    x, y = _cells(on_wall, low)
    wall[side, x, y] = 1.0
    return _Images(low, wall, ratio)


def find_place(old: Graph, new: Graph) -> Place | None:
    """The most probable place of `new` on `old`; None where either shows no wall."""
    scenes = scene_of(old), scene_of(new)
    if not all(len(scene.wall_m) for scene in scenes):
        return None
    base = 0.0 if old.base_rad is None else old.base_rad
    known = _images(scenes[0], 0.0, base)
    turns = ANY_TURN_RAD
    if old.base_rad is not None and new.base_rad is not None:
        turns = old.base_rad - new.base_rad + 0.5 * math.pi * np.arange(4)
    modes: list[Place] = []
    tried = 1.0
    for turn in turns.tolist():
        image = _images(scenes[1], turn, base)
        score = _scores(known, image)
        tried += float((np.abs(score) > 0.5).sum())
        modes += [Place(turn, _metres(known.low - image.low + cell), value) for value, cell in _modes(score)]
    best = max(modes, key=lambda mode: mode.log_odds)
    middle = scenes[1].wall_m.mean(0, keepdims=True)
    others = [mode.log_odds for mode in modes if _differ(mode, best, middle)]
    odds = best.log_odds - float(np.logaddexp.reduce([math.log(tried), *others]))
    rivals = sum(other > best.log_odds - math.log(RIVAL) for other in others)
    return _described(scenes[1], known, best._replace(log_odds=odds, rivals=rivals), base)


def _differ(a: Place, b: Place, middle: Floats) -> bool:
    """Whether two places are not one; `middle` (1, 2) of the new map."""
    turned = abs(wrap(a.turn_rad - b.turn_rad))
    return bool(np.hypot(*(a.moved(middle) - b.moved(middle))[0]) > APART_M) or turned > APART_RAD


def _scores(known: _Images, tried: _Images) -> Floats:
    """Log-ratio (x, y) of each shift of `tried`, in cells; shifts below zero are counted from the end."""
    size = [fft.next_fast_len(a + b) for a, b in zip(known.wall.shape[1:], tried.wall.shape[1:], strict=True)]
    spectrum = np.zeros((size[0], size[1] // 2 + 1), np.complex128)
    for side in range(SIDES):
        for a, b in ((known.ratio, tried.wall), (known.wall, tried.ratio)):
            spectrum += fft.rfft2(a[side], size) * np.conj(fft.rfft2(b[side], size))
    score: Floats = 0.5 * POWER * CELL_M * fft.irfft2(spectrum, size)
    return score


def _modes(score: Floats) -> list[tuple[float, Ints]]:
    """The greatest scores that are APART_M from each other, with their shifts in cells."""
    left, found, reach, size = score.copy(), [], round(APART_M / CELL_M), np.array(score.shape)
    for _ in range(MODES):
        cell = np.array(np.unravel_index(int(np.argmax(left)), score.shape))
        found.append((float(left[tuple(cell)]), np.where(cell > size // 2, cell - size, cell)))
        x, y = (np.arange(c - reach, c + reach + 1) % n for c, n in zip(cell, size, strict=True))
        left[np.ix_(x, y)] = -np.inf
    return found


def _described(new: Scene, known: _Images, place: Place, base_rad: float) -> Place:
    """The place with the lengths that agree and contradict, and the node amid the stretch that fits best."""
    tried = _images(new, place.turn_rad, base_rad)
    shift = np.round(place.shift_m / CELL_M).astype(np.int64)
    here = _looked_up(known, tried.wall, tried.low + shift)
    there = _looked_up(tried._replace(low=tried.low + shift), known.wall, known.low)
    common, against = float((here > 0.0).sum()), float((here < 0.0).sum() + (there < 0.0).sum())
    points = place.moved(new.wall_m)
    side = np.round((new.normal_rad + place.turn_rad - base_rad) / (2.0 * math.pi / SIDES)).astype(np.int64) % SIDES
    values = _values(known, side, points)
    by_node = np.bincount(new.node, values)
    smooth = np.convolve(by_node, np.ones(min(12, len(by_node))), "same")
    return place._replace(common_m=common * CELL_M, against_m=against * CELL_M, node=int(np.argmax(smooth)))


def _looked_up(images: _Images, wall: Floats, low: Ints) -> Floats:
    """The ratios of `images` at each cell of a wall image that begins at `low`."""
    side, x, y = np.nonzero(wall)
    return _values(images, side, _metres(np.column_stack([x, y]) + low) + 0.5 * CELL_M)


def _values(images: _Images, side: Ints, points: Floats) -> Floats:
    """Ratios at points (n, 2), zero outside the image."""
    x, y = _cells(points, images.low)
    inside = (x >= 0) & (y >= 0) & (x < images.ratio.shape[1]) & (y < images.ratio.shape[2])
    ratios = np.zeros(len(points))
    ratios[inside] = images.ratio[side[inside], x[inside], y[inside]]
    return ratios


def _cells(points: Floats, low: Ints) -> tuple[Ints, Ints]:
    x, y = (np.floor(points / CELL_M).astype(np.int64) - low).T
    return x, y


def _metres(cells: Ints) -> Floats:
    """Lower corners of cells."""
    return np.asarray(cells * CELL_M, np.float64)


def _turned(turn_rad: float) -> Floats:
    c, s = math.cos(turn_rad), math.sin(turn_rad)
    return np.array([[c, -s], [s, c]])
