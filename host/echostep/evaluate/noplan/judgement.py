# SPDX-License-Identifier: MIT
"""A drawing and a path against the building and the true path.

In: places in the walk's own frame, the truth. Out: columns of a row. Owns the definitions. Known are the start and the first place COURSE_M away from
it, as two taps state them: nothing else is aligned.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely

from echostep.arrays import Bools, Floats
from echostep.evaluate.anywhere.walks import SimulatedWalk, T, X, Y
from echostep.evaluate.report import Row
from echostep.mapping.graph import Closure

COURSE_M = 15.0  # the trunk's place over the foot errs by 4 cm, 0.2 degrees of it
SAMPLE_M = 0.05  # along walls
ABSENT_M = 0.5  # a drawn place farther from any wall is not there
DRAWN_M = ABSENT_M  # a wall nearer than this to a drawn one is drawn
PASSED_M = 2.5  # a wall in sight within this distance of the path was passed
LOOK_S = 1.0  # between two looks around
SHORT = 0.97  # of the way to a place: the wall itself hides nothing
WRONG_M = 0.5  # error of a closure along a direction that it claims to know


@dataclass(frozen=True, slots=True)
class Frame:
    """Rigid motion from the walk's own frame to the map: `turned` (2, 2), `moved` (2,)."""

    turned: Floats
    moved: Floats

    def to_map(self, points: Floats) -> Floats:
        """Points (n, 2) in the map."""
        found: Floats = points @ self.turned.T + self.moved
        return found


def true_path(walk: SimulatedWalk, t_s: Floats) -> Floats:
    """True places (n, 2) at times (n,)."""
    return np.column_stack([np.interp(t_s, walk.truth[:, T], walk.truth[:, k]) for k in (X, Y)])


def known_start(path: Floats, truth: Floats) -> Frame:
    """The frame of a path (n, 2) whose start is known."""
    away_m = np.hypot(*(truth - truth[0]).T)
    k = int(np.argmax(away_m > min(COURSE_M, 0.9 * away_m.max())))
    (vx, vy), (ux, uy) = path[k] - path[0], truth[k] - truth[0]
    turn = math.atan2(uy, ux) - math.atan2(vy, vx)
    turned = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    return Frame(turned, truth[0] - turned @ path[0])


def path_columns(path: Floats, truth: Floats) -> Row:
    """RMSE and greatest error of a path in the map."""
    error = np.hypot(*(path - truth).T)
    return {"rmse_m": float(np.sqrt(np.mean(error**2))), "max_m": float(error.max())}


def wall_columns(drawn: Floats, walk: SimulatedWalk) -> Row:
    """Errors of drawn walls (n, 4) in the map, and which of the walls that were passed are drawn."""
    built = walk.built.levels[0].solid
    places, true = sampled(drawn), sampled(built)
    passed = true[in_sight(true, built, walk)]
    if not len(places):
        return {"drawn": 0.0, "absent": 0.0, "drawn_m": 0.0}
    away_m, missed_m = distances(places, built), distances(passed, drawn)
    return {
        "wall_median_m": float(np.median(away_m)),
        "wall95_m": float(np.quantile(away_m, 0.95)),
        "drawn": float(np.mean(missed_m < DRAWN_M)),
        "absent": float(np.mean(away_m > ABSENT_M)),
        "drawn_m": len(places) * SAMPLE_M,
    }


def closure_columns(closures: list[Closure], pose: Floats, truth: Floats, frame: Frame) -> Row:
    """Closures right and wrong: along each direction that one claims to know, within WRONG_M of the truth."""
    wrong = sum(_is_wrong(closure, truth, frame) for closure in closures)
    return {"closures": len(closures), "wrong": wrong, "nodes": len(pose)}


def _is_wrong(closure: Closure, truth: Floats, frame: Frame) -> bool:
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
    found = np.full(len(places), np.inf)
    found[which] = away
    return found


def in_sight(places: Floats, built: Floats, walk: SimulatedWalk) -> Bools:
    """Which places (m, 2) on walls are in sight within PASSED_M of the true path at some time."""
    tree = shapely.STRtree(shapely.linestrings(built.reshape(-1, 2, 2)))
    looks = true_path(walk, np.arange(walk.truth[0, T], walk.truth[-1, T], LOOK_S))
    seen = np.zeros(len(places), np.bool_)
    for eye in looks:
        near = np.flatnonzero(~seen & (np.hypot(*(places - eye).T) < PASSED_M))
        rays = np.stack([np.repeat(eye[None], len(near), 0), eye + SHORT * (places[near] - eye)], axis=1)
        if len(near):
            hit = np.bincount(tree.query(shapely.linestrings(rays), predicate="intersects")[0], minlength=len(near))
            seen[near[hit == 0]] = True
    return seen
