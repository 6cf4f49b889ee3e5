# SPDX-License-Identifier: MIT
"""Walks of several people that become one drawing: two through one building from unknown starts, and two through different buildings.

In: sites, walks, a seed. Out: rows. Owns nothing. The second walk is judged in the frame of the first, whose start is known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from msgspec import UNSET

from echostep.errors import EchostepError
from echostep_app.mapping.joining import join_walks
from echostep_app.mapping.mapper import solve_walk
from echostep_app.plan.routing import RoutePlace
from echostep_studies.bench.sites import Site
from echostep_studies.bench.tours import random_tour
from echostep_studies.bench.walks import SimulatedWalk
from echostep_studies.frame.report import Row, as_dict
from echostep_studies.noplan.judgement import closure_columns, known_start, path_columns, true_path, wall_columns
from echostep_studies.noplan.walks import walked

OTHER_PERSON = 700_000  # added to the seed
MISPLACED_M = 2.0  # RMSE from which the second walk lies at a wrong place


@dataclass(frozen=True, slots=True, kw_only=True)
class PairRun:
    """Two walks: whether they were joined, and at a wrong place."""

    name: str
    seed: int
    joined: int
    misplaced: int


@dataclass(frozen=True, slots=True, kw_only=True)
class JoinedRun(PairRun):
    """Two walks that were joined: the second path in the frame of the first, what is drawn of its walls, and closures."""

    joined_rmse_m: float
    common_m: float
    drawn: float
    wall_median_m: float
    closures: int
    wrong: int
    nodes: int


def again(site: Site, length_m: float, seed: int) -> Site:
    """Another tour through the same building."""
    x, y = site.waypoints[0][:2]
    rng = np.random.default_rng([seed, 86])
    return Site(site.built, random_tour(site.built, RoutePlace(x, y), length_m, rng, anywhere=True))


def walked_pair(first: Site, second: Site, seed: int) -> tuple[SimulatedWalk, SimulatedWalk]:
    """Both walks, by different feet."""
    return walked(first, seed), walked(second, seed + OTHER_PERSON)


def joined_row(name: str, walks: tuple[SimulatedWalk, SimulatedWalk], seed: int) -> PairRun:
    """Two walks of one building: whether they were joined, rightly, and the errors of the second path in the frame of the first."""
    solved = [(f"walk {k + 1}", solve_walk(walk.segments)) for k, walk in enumerate(walks)]
    try:
        mapped, joins = join_walks(solved)
    except EchostepError:
        return PairRun(name=name, seed=seed, joined=0, misplaced=0)
    graph, second = mapped.graph, mapped.graph.nodes.begins[1]
    parts = np.split(graph.nodes.t_s, [second])
    truth = np.concatenate([true_path(walk, t_s) for walk, t_s in zip(walks, parts, strict=True)])
    pose = graph.pose[:, :2]
    frame = known_start(pose[:second], truth[:second])
    error = path_columns(frame.to_map(pose[second:]), truth[second:]).rmse_m
    walls = frame.to_map(mapped.drawing.walls.reshape(-1, 2)).reshape(-1, 4)
    drawn = wall_columns([walls], walks[1])
    return JoinedRun(
        name=name, seed=seed, joined=1, misplaced=int(error > MISPLACED_M), joined_rmse_m=error,
        common_m=joins[0].place.common_m, drawn=drawn.drawn,
        wall_median_m=np.nan if drawn.wall_median_m is UNSET else drawn.wall_median_m,
        **as_dict(closure_columns(graph.closures, graph.pose, truth, frame)),
    )  # fmt: skip


def strangers_row(name: str, walks: tuple[SimulatedWalk, SimulatedWalk], seed: int) -> PairRun:
    """Two walks of different buildings: `joined` counts those that were taken for one."""
    solved = [(f"walk {k + 1}", solve_walk(walk.segments)) for k, walk in enumerate(walks)]
    try:
        join_walks(solved)
    except EchostepError:
        return PairRun(name=name, seed=seed, joined=0, misplaced=0)
    return PairRun(name=name, seed=seed, joined=1, misplaced=1)


def joined_summary(group: Sequence[PairRun]) -> Row:
    """The summary row of all pairs of a name."""
    joined = [row for row in group if isinstance(row, JoinedRun)]
    right = [row for row in joined if not row.misplaced]
    rmse = [row.joined_rmse_m for row in right]
    return {
        "name": group[0].name, "runs": len(group), "joined": sum(row.joined for row in group),
        "misplaced": sum(row.misplaced for row in group), "closures": sum(row.closures for row in joined),
        "wrong": sum(row.wrong for row in joined), "joined_rmse_m": float(np.mean(rmse)) if right else UNSET,
        "worst_rmse_m": max(rmse, default=UNSET),
        "drawn_pc": 100.0 * float(np.mean([row.drawn for row in right])) if right else UNSET,
    }  # fmt: skip
