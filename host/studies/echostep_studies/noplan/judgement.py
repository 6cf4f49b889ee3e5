# SPDX-License-Identifier: MIT
"""A drawing and a path against the building and the true path.

In: places in the walk's own frame, the truth. Out: columns of a row. Owns the definitions. Known are the start and the first place COURSE_M away from
it, as two taps state them: nothing else is aligned.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from msgspec import UNSET, UnsetType

from echostep.arrays import Bools, Floats
from echostep_app.mapping.graph.graph import Closure
from echostep_app.mapping.graph.levels import BETWEEN
from echostep_app.mapping.mapper import Mapped
from echostep_studies.bench.walks import SimulatedWalk, T, Z

COURSE_M = 15.0  # the trunk's place over the foot errs by 4 cm, 0.2 degrees of it
SAMPLE_M = 0.05  # along walls
ABSENT_M = 0.5  # a drawn place farther from any wall is not there
DRAWN_M = ABSENT_M  # a wall nearer than this to a drawn one is drawn
PASSED_M = 2.5  # a wall in sight within this distance of the path was passed
LOOK_S = 1.0  # between two looks around
SHORT = 0.97  # of the way to a place: the wall itself hides nothing
LEVEL_M = 0.5  # of height from a level, within which the path is on it
WRONG_M = 0.5  # error of a closure along a direction that it claims to know


@dataclass(frozen=True, slots=True)
class WalkFrame:
    """Rigid motion from the walk's own frame to the map: `turned` (2, 2), `moved` (2,)."""

    turned: Floats
    moved: Floats

    def to_map(self, points: Floats) -> Floats:
        """Points (n, 2) in the map."""
        mapped: Floats = points @ self.turned.T + self.moved
        return mapped


@dataclass(frozen=True, slots=True, kw_only=True)
class PathColumns:
    """RMSE and greatest error of a path in the map."""

    rmse_m: float
    max_m: float


@dataclass(frozen=True, kw_only=True)
class StoreyColumns:
    """Share of the nodes on a level that are drawn on another one, and how many storeys are drawn of how many walked."""

    wrong_storey: float
    storeys: int
    storeys_walked: int


@dataclass(frozen=True, kw_only=True)
class WallColumns:
    """Errors of the drawn walls, if there are any, which of the walls that were passed are drawn, and what is drawn where nothing is."""

    wall_median_m: float | UnsetType = UNSET
    wall95_m: float | UnsetType = UNSET
    drawn: float
    absent: float
    drawn_m: float


@dataclass(frozen=True, kw_only=True)
class ClosureColumns:
    """Closures, those that are wrong, and nodes."""

    closures: int
    wrong: int
    nodes: int


def known_start(path: Floats, truth: Floats) -> WalkFrame:
    """The frame of a path (n, 2) whose start is known."""
    away_m = np.hypot(*(truth - truth[0]).T)
    k = int(np.argmax(away_m > min(COURSE_M, 0.9 * away_m.max())))
    (vx, vy), (ux, uy) = path[k] - path[0], truth[k] - truth[0]
    turn = math.atan2(uy, ux) - math.atan2(vy, vx)
    turned = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    return WalkFrame(turned, truth[0] - turned @ path[0])


def path_columns(path: Floats, truth: Floats) -> PathColumns:
    """RMSE and greatest error of a path in the map."""
    error = np.hypot(*(path - truth).T)
    return PathColumns(rmse_m=float(np.sqrt(np.mean(error**2))), max_m=float(error.max()))


def levels_of(mapped: Mapped, walk: SimulatedWalk) -> list[int]:
    """The true level of each drawn storey: the nearest one in height above the start."""
    storeys, start = mapped.graph.levels, float(walk.truth[0, Z])
    above = np.zeros(1) if storeys is None else storeys.height_m
    true = np.array([level.height_m for level in walk.built.levels])
    return [int(np.argmin(np.abs(true - start - height))) for height in above]


def storey_columns(mapped: Mapped, walk: SimulatedWalk) -> StoreyColumns:
    """The storeys of a drawing."""
    z = walk.heights_at(mapped.graph.nodes.t_s)
    on = np.array([np.abs(z - level.height_m) < LEVEL_M for level in walk.built.levels])
    storey = mapped.graph.level_of(np.arange(len(z)))
    level = np.array(levels_of(mapped, walk))[np.maximum(storey, 0)]
    wrong = on.any(0) & (storey != BETWEEN) & ~on[level, np.arange(len(z))]
    return StoreyColumns(
        wrong_storey=float(wrong.mean()), storeys=len(mapped.drawings), storeys_walked=int(on.any(1).sum())
    )


def wall_columns(drawn: Sequence[Floats], walk: SimulatedWalk) -> WallColumns:
    """The drawn walls (n, 4) of each level in the map."""
    t_s = np.arange(walk.truth[0, T], walk.truth[-1, T], LOOK_S)
    looks, z = walk.places_at(t_s), walk.heights_at(t_s)
    away, missed = [], []
    for level, walls in zip(walk.built.levels, drawn, strict=True):
        true = sampled(level.solid)
        passed = true[in_sight(true, level.solid, looks[np.abs(z - level.height_m) < LEVEL_M])]
        away.append(distances(sampled(walls), level.solid))
        missed.append(distances(passed, walls))
    away_m, missed_m = np.concatenate(away), np.concatenate(missed)
    if not len(away_m):
        return WallColumns(drawn=0.0, absent=0.0, drawn_m=0.0)
    return WallColumns(
        wall_median_m=float(np.median(away_m)),
        wall95_m=float(np.quantile(away_m, 0.95)),
        drawn=float(np.mean(missed_m < DRAWN_M)),
        absent=float(np.mean(away_m > ABSENT_M)),
        drawn_m=len(away_m) * SAMPLE_M,
    )


def closure_columns(closures: list[Closure], pose: Floats, truth: Floats, frame: WalkFrame) -> ClosureColumns:
    """Closures right and wrong: along each direction that one claims to know, within WRONG_M of the truth."""
    wrong = sum(_is_wrong(closure, truth, frame) for closure in closures)
    return ClosureColumns(closures=len(closures), wrong=wrong, nodes=len(pose))


def _is_wrong(closure: Closure, truth: Floats, frame: WalkFrame) -> bool:
    apart = (truth[closure.new] - truth[closure.old]) @ frame.turned
    value, vector = np.linalg.eigh(closure.information[:2, :2])
    off = np.abs((closure.between[:2] - apart) @ vector)
    return bool((off[value > 1e-6] > WRONG_M).any())


def sampled(walls: Floats) -> Floats:
    """Places (m, 2) along walls (n, 4), SAMPLE_M apart."""
    pieces = [np.zeros((0, 2))]
    for x0, y0, x1, y1 in walls.tolist():
        count = max(1, round(math.hypot(x1 - x0, y1 - y0) / SAMPLE_M))
        share = (np.arange(count) + 0.5) / count
        pieces.append(np.column_stack([x0 + share * (x1 - x0), y0 + share * (y1 - y0)]))
    return np.concatenate(pieces)


def distances(places: Floats, walls: Floats) -> Floats:
    """Distance of places (m, 2) from the nearest of walls (n, 4), infinite without any."""
    if not len(walls):
        return np.full(len(places), np.inf)
    tree = shapely.STRtree(shapely.linestrings(walls.reshape(-1, 2, 2)))
    (which, _), away = tree.query_nearest(shapely.points(places), return_distance=True, all_matches=False)
    away_m = np.full(len(places), np.inf)
    away_m[which] = away
    return away_m


def in_sight(places: Floats, built: Floats, looks: Floats) -> Bools:
    """Which places (m, 2) on walls are in sight within PASSED_M of one of the true places (k, 2)."""
    tree = shapely.STRtree(shapely.linestrings(built.reshape(-1, 2, 2)))
    seen = np.zeros(len(places), np.bool_)
    for eye in looks:
        near = np.flatnonzero(~seen & (np.hypot(*(places - eye).T) < PASSED_M))
        rays = np.stack([np.repeat(eye[None], len(near), 0), eye + SHORT * (places[near] - eye)], axis=1)
        if len(near):
            hit = np.bincount(tree.query(shapely.linestrings(rays), predicate="intersects")[0], minlength=len(near))
            seen[near[hit == 0]] = True
    return seen
