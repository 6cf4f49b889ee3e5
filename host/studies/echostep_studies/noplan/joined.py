# SPDX-License-Identifier: MIT
"""Walks of several people that become one drawing: two through one building from unknown starts, and two through different buildings.

In: sites, walks, a seed. Out: rows. Owns nothing. The second walk is judged in the frame of the first, whose start is known.
"""

from __future__ import annotations

import numpy as np

from echostep.errors import EchostepError
from echostep.mapping.joining import join_walks
from echostep.mapping.mapper import solve_walk
from echostep.plan.routing import RoutePlace
from echostep_studies.anywhere.sites import Site
from echostep_studies.anywhere.tours import random_tour
from echostep_studies.anywhere.walks import SimulatedWalk
from echostep_studies.frame.report import Row
from echostep_studies.noplan.judgement import closure_columns, known_start, path_columns, true_path, wall_columns
from echostep_studies.noplan.walks import walked

OTHER_PERSON = 700_000  # added to the seed
MISPLACED_M = 2.0  # RMSE from which the second walk lies at a wrong place


def again(site: Site, length_m: float, seed: int) -> Site:
    """Another tour through the same building."""
    x, y = site.waypoints[0][:2]
    rng = np.random.default_rng([seed, 86])
    return Site(site.built, random_tour(site.built, RoutePlace(x, y), length_m, rng, anywhere=True))


def walked_pair(first: Site, second: Site, seed: int) -> tuple[SimulatedWalk, SimulatedWalk]:
    """Both walks, by different feet."""
    return walked(first, seed), walked(second, seed + OTHER_PERSON)


def joined_row(name: str, walks: tuple[SimulatedWalk, SimulatedWalk], seed: int) -> Row:
    """Two walks of one building: whether they were joined, rightly, and the errors of the second path in the frame of the first."""
    row: Row = {"name": name, "seed": seed, "joined": 0, "misplaced": 0}
    solved = [(f"walk {k + 1}", solve_walk(walk.segments)) for k, walk in enumerate(walks)]
    try:
        mapped, joins = join_walks(solved)
    except EchostepError:
        return row
    graph, second = mapped.graph, mapped.graph.nodes.begins[1]
    parts = np.split(graph.nodes.t_s, [second])
    truth = np.concatenate([true_path(walk, t_s) for walk, t_s in zip(walks, parts, strict=True)])
    pose = graph.pose[:, :2]
    frame = known_start(pose[:second], truth[:second])
    error = path_columns(frame.to_map(pose[second:]), truth[second:])["rmse_m"]
    walls = frame.to_map(mapped.drawing.walls.reshape(-1, 2)).reshape(-1, 4)
    drawn = wall_columns([walls], walks[1])
    row |= {
        "joined": 1,
        "misplaced": int(error > MISPLACED_M),
        "joined_rmse_m": error,
        "common_m": joins[0].place.common_m,
    }
    row |= {"drawn": drawn["drawn"], "wall_median_m": drawn.get("wall_median_m", np.nan)}
    return row | closure_columns(graph.closures, graph.pose, truth, frame)


def strangers_row(name: str, walks: tuple[SimulatedWalk, SimulatedWalk], seed: int) -> Row:
    """Two walks of different buildings: `joined` counts those that were taken for one."""
    solved = [(f"walk {k + 1}", solve_walk(walk.segments)) for k, walk in enumerate(walks)]
    try:
        join_walks(solved)
    except EchostepError:
        return {"name": name, "seed": seed, "joined": 0, "misplaced": 0}
    return {"name": name, "seed": seed, "joined": 1, "misplaced": 1}


def joined_summary(group: list[Row]) -> Row:
    """Counts, and means over the walks that were joined rightly."""
    right = [row for row in group if row["joined"] and not row["misplaced"] and "joined_rmse_m" in row]
    summary: Row = {"name": group[0]["name"], "runs": len(group)}
    summary |= {key: sum(row[key] for row in group) for key in ("joined", "misplaced")}
    summary |= {key: sum(row.get(key, 0) for row in group) for key in ("closures", "wrong")}
    if right:
        rmse = [row["joined_rmse_m"] for row in right]
        summary |= {"joined_rmse_m": float(np.mean(rmse)), "worst_rmse_m": max(rmse)}
        summary["drawn_pc"] = 100.0 * float(np.mean([row["drawn"] for row in right]))
    return summary
