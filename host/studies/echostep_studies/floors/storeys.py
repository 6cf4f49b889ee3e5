# SPDX-License-Identifier: MIT
"""Walks through all floors of a building, tracked on its plan: by foot and board, by the board alone, from an unknown floor.

In: seeds, and westport-house where it is at hand. Out: rows `storeys/...`. Everything is simulated but the plan. The whole tracker runs, from the
bytes of the simulated board and MTx.

The true floor is the one nearest to the wearer, of those where the lift stops during a ride; within half a metre of the middle between two floors
both are right (`floor_right`); `strict_right` gives nothing away.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from shapely import Point, Polygon

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.localization import Estimate, TrackStatus
from echostep.plan import ANY_LEVEL, Plan, Pose, load_plan
from echostep.ports.chunks import MTX
from echostep.tracker import Tracker
from echostep_app.guidance.tours import tour as tour_of
from echostep_app.output.table import Table
from echostep_app.plan.routing import RoutePlace, Routes
from echostep_app.scorecard.error_statistics import error_statistics
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.people.walker import Person, Waypoint
from echostep_simulation.scenario import Scenario
from echostep_simulation.world.tower import tour, tower
from echostep_studies.bench.sites import westport_in
from echostep_studies.bench.walks import CORNER_M, T, X, Y, Z, tracked
from echostep_studies.frame.report import LOST_END_M, Row, by_name, means, named
from echostep_studies.frame.study import Study, StudyRequest
from echostep_studies.frame.truth import at_times

STOREYS = 5
REAL = "storeys/westport"  # name of the row of the real plan
TIE_M = 0.5
AWAY_M = (8.0, 30.0)  # of a place to visit from the stairs, as one walks
COLUMNS = {
    "name": "", "runs": "runs", "mean_m": "mean m", "ce95_m": "CE95 m", "max_m": "max m", "ending_m": "end m", "floor_right": "right %",
    "strict_right": "strict %", "longest_wrong_s": "longest wrong s", "coverage95": "in 95 % ellipse", "lost": "lost",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class BuildingScene:
    """`foot`: an MTx is worn; `known`: the floor of the start is given."""

    foot: bool = True
    known: bool = True


SCENES = {"": BuildingScene(), "-legs": BuildingScene(foot=False), "-any": BuildingScene(known=False)}


@dataclass(frozen=True, slots=True, kw_only=True)
class StoreysRun:
    """The errors of one walk, and how often its floor was right."""

    name: str
    profile: str
    seed: int
    mean_m: float
    sd_m: float
    max_m: float
    min_m: float
    ending_m: float
    ce95_m: float
    coverage95: float
    lost: int
    said_lost: float
    floor_right: float
    strict_right: float
    longest_wrong_s: float
    floors: int


def one_run(real: Path | None, seed: int) -> list[StoreysRun]:
    """Every scene with the person of this seed."""
    rows = [_row(f"storeys/tower{name}", scene, tower(STOREYS), tour(STOREYS), seed) for name, scene in SCENES.items()]
    if real is not None:
        plan = load_plan(real)
        rows.append(_row(REAL, BuildingScene(), plan, through(plan, seed), seed))
    return rows


def through(plan: Plan, seed: int) -> list[Waypoint]:
    """A place on each floor, one after the other by the nearest stairs or lift, and back to the first."""
    rng, routes, places = np.random.default_rng([seed, 60]), Routes(plan), list[RoutePlace]()
    stairs = next(c for c in plan.connectors if len(c.levels) == len(plan.levels))
    x, y = stairs.outline_m.mean(axis=0).tolist()
    low, high = plan.levels[0].solid.reshape(-1, 2).min(0), plan.levels[0].solid.reshape(-1, 2).max(0)
    while len(places) < len(plan.levels):
        k = len(places)
        at = rng.uniform(np.maximum(low, [x - 25.0, y - 25.0]), np.minimum(high, [x + 25.0, y + 25.0]))
        try:
            route = routes.way(RoutePlace(x, y, k), RoutePlace(float(at[0]), float(at[1]), k))
        except EchostepError:
            continue
        line = route.stretches[-1].line_m
        if len(route.stretches) == 1 and len(line) > 2 and AWAY_M[0] < route.length_m < AWAY_M[1]:
            places.append(RoutePlace(float(line[-2, 0]), float(line[-2, 1]), k))
    return tour_of(plan, [*places, places[0]])


def _row(name: str, scene: BuildingScene, plan: Plan, way: Sequence[Waypoint], seed: int) -> StoreysRun:
    scenario = Scenario(plan, way, seed, PythonBoard(seed), Person(corner_m=CORNER_M))
    chunks = [c for c in scenario.chunks() if scene.foot or c.port != MTX]
    start = scenario.start
    tracker = Tracker(
        plan, Pose(start.x_m, start.y_m, start.heading_rad, start.level if scene.known else ANY_LEVEL), seed=seed
    )
    return judge(plan, scenario.truth, tracked(tracker, chunks), name, seed)


def judge(plan: Plan, truth: Floats, estimates: Sequence[Estimate], name: str, seed: int) -> StoreysRun:
    """Errors of a walk; `truth` (n, 5): t_s, x, y, heading, height."""
    t_s = np.array([e.t_s for e in estimates])
    x, y, z = at_times(t_s, truth[:, T], truth[:, [X, Y, Z]]).T
    error = np.hypot(x - [e.x_m for e in estimates], y - [e.y_m for e in estimates])
    places = list(zip(estimates, x.tolist(), y.tolist(), z.tolist(), strict=True))
    right = np.array([_right(plan, e, (px, py, pz), TIE_M) for e, px, py, pz in places])
    strict = np.array([_right(plan, e, (px, py, pz), 0.0) for e, px, py, pz in places])
    wrong_s, since = 0.0, None
    for t, good in zip(t_s.tolist(), right.tolist(), strict=True):
        since = None if good else t if since is None else since
        wrong_s = max(wrong_s, 0.0 if since is None else t - since)
    statistics = error_statistics(error)
    return StoreysRun(
        name=name, profile="default", seed=seed, mean_m=statistics.mean_m, sd_m=statistics.sd_m, max_m=statistics.max_m,
        min_m=statistics.min_m, ending_m=statistics.ending_m, ce95_m=statistics.p95_m,
        coverage95=float(np.mean([e.holds(px, py) for e, px, py, _ in places])),
        lost=int(error[-1] > LOST_END_M), said_lost=float(np.mean([e.status is TrackStatus.LOST for e in estimates])),
        floor_right=float(right.mean()), strict_right=float(strict.mean()), longest_wrong_s=wrong_s,
        floors=len({e.level for e in estimates}),
    )  # fmt: skip


def _right(plan: Plan, e: Estimate, at_m: tuple[float, float, float], tie_m: float) -> bool:
    """Whether an estimate's floor is the nearest to a place, or as good."""
    x, y, z = at_m
    lifts = (c for c in plan.connectors if c.kind == "lift")
    served = {k for c in lifts if Polygon(c.outline_m).buffer(0.3).contains(Point(x, y)) for k in c.levels}
    away = {k: abs(z - plan.levels[k].height_m) for k in served or range(len(plan.levels))}
    return e.level in away and away[e.level] <= min(away.values()) + 2.0 * tie_m


def _summary(rows: Sequence[StoreysRun]) -> Row:
    keys = ("mean_m", "sd_m", "ending_m", "ce95_m", "coverage95", "floor_right", "strict_right")
    return {
        **named(rows), "profile": "default", **means(rows, keys, 4),
        "max_m": round(max(row.max_m for row in rows), 4), "min_m": round(min(row.min_m for row in rows), 4),
        "lost": sum(row.lost for row in rows), "longest_wrong_s": round(max(row.longest_wrong_s for row in rows), 4),
    }  # fmt: skip


def _tables(rows: list[Row], request: StudyRequest) -> list[Table]:
    shown = [{k: 100.0 * v if k.endswith("right") or k == "coverage95" else v for k, v in row.items()} for row in rows]
    real = any(row["name"] == REAL for row in rows)
    notes = () if real else ("Without --data westport-house is left out.",)
    return [Table(f"All floors of a building, {request.runs} simulated walks", shown, COLUMNS, notes)]


def storeys_study(data: Path | None) -> Study[StoreysRun, Row]:
    """The study; `data`: folder of the public recordings, which holds the plan of westport-house."""
    return Study("storeys", (StoreysRun,), partial(one_run, westport_in(data)), by_name(_summary), _tables)
