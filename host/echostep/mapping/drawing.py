# SPDX-License-Identifier: MIT
"""The walls of a solved graph.

In: a graph, its pings. Out: `Drawing`. Owns the order: first the lines that have the building's directions, then the others from what is left.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from echostep.arrays import Bools, Floats, Ints, spans
from echostep.mapping.evidence import add_crossings, cell_counts, explained_by_ends, is_straight, ping_poses
from echostep.mapping.graph import Graph
from echostep.mapping.lines import Lines, find_lines, joined
from echostep.mapping.nodes import Pings
from echostep.mapping.segments import ACROSS, ANY, ASKEW, Run, find_runs, meets, segments_of

# Of wall on one line, at least; shorter ones must be heard again. One passer-by in 15, in 70, goes along for longer, when one second is the mean
LONE_M, LONE_ASKEW_M = 2.5, 4.0
PASSAGE_M = 5.0  # of path, between two passages


@dataclass(frozen=True, slots=True)
class Drawing:
    """`walls` (n, 4): x0, y0, x1, y1 in metres; `sd_m` (n,): standard deviation of each across its line; `paths_m`: the corrected path (k, 2) of each
    walk, or each piece of it on this storey.
    """

    walls: Floats
    sd_m: Floats
    paths_m: tuple[Floats, ...]


def draw(graph: Graph, pings: Pings) -> tuple[Drawing, ...]:
    """The walls that the echoes of a walk show, on each storey."""
    storeys = graph.storeys
    if storeys is None:
        return (_drawn(graph, pings, graph.paths()),)
    found = []
    for k in range(len(storeys.height_m)):
        on = storeys.of == k
        of = np.where(on[graph.fragments.node], graph.walls.of, -1)
        own = on[pings.node]
        paths = tuple(piece for path in graph.paths() for piece in pieces_on(path, on))
        part = replace(graph, walls=replace(graph.walls, of=of))
        found.append(_drawn(part, Pings(*(getattr(pings, f.name)[own] for f in fields(pings))), paths))
    return tuple(found)


def pieces_on(path: Floats, on: Bools) -> list[Floats]:
    """The pieces (k, 2) of a path (n, 2) whose nodes are `on` (n,) a storey."""
    return [path[a:b] for a, b in spans(on)]


def _drawn(graph: Graph, pings: Pings, paths: tuple[Floats, ...]) -> Drawing:
    """The walls that these pings show, beside these paths."""
    poses = ping_poses(graph, pings)
    way_m, ahead = graph.nodes.way_m[pings.node], is_straight(graph, pings)
    lines = find_lines(graph)
    free = np.ones(len(poses), np.bool_)
    aligned = lines.aligned if lines.aligned.any() else np.ones(len(lines.rho_m), np.bool_)
    straight = _selected(lines, aligned)
    cells = cell_counts(straight, poses, pings.range_m, free, ahead)
    add_crossings(straight, paths, cells)
    runs = _without_lone(
        find_runs(cells, ACROSS if lines.aligned.any() else ANY),
        straight,
        straight.aligned | ~lines.aligned.any(),
        poses,
        way_m,
        cells.of,
    )
    walls, _ = segments_of(straight, runs, cells)
    if not aligned.all():
        free = (cells.of < 0) & ~explained_by_ends(walls, poses, pings.range_m)
        askew = _selected(lines, ~aligned)
        more = cell_counts(askew, poses, pings.range_m, free, ahead)
        add_crossings(askew, paths, more)
        none = np.zeros(len(askew.rho_m), np.bool_)
        found = _without_lone(find_runs(more, ASKEW), askew, none, poses, way_m, more.of)
        kept = sorted({run.line for run in found})
        both = joined(straight, _selected(askew, np.isin(np.arange(len(none)), kept)))
        runs += [run._replace(line=len(straight.rho_m) + kept.index(run.line)) for run in found]
        cells = cell_counts(both, poses, pings.range_m, np.ones(len(poses), np.bool_), ahead)
        add_crossings(both, paths, cells)
        straight = both
    walls, sd = segments_of(straight, runs, cells)
    return Drawing(walls, sd, paths)


def _without_lone(runs: list[Run], lines: Lines, aligned: Bools, poses: Floats, way_m: Floats, of: Ints) -> list[Run]:
    """Without short pieces that were heard in one passage, meet no wall and have none on their line: people stood or walked there."""
    total = np.zeros(len(lines.rho_m))
    for run in runs:
        total[run.line] += run.high_m - run.low_m
    kept = []
    for i, run in enumerate(runs):
        if not meets(lines, runs, i) and total[run.line] < (LONE_M if aligned[run.line] else LONE_ASKEW_M):
            c, s = np.cos(lines.normal_rad[run.line]), np.sin(lines.normal_rad[run.line])
            along = c * poses[:, 1] - s * poses[:, 0]
            own = np.sort(way_m[(of == run.line) & (along >= run.low_m) & (along <= run.high_m)])
            if not (np.diff(own) > PASSAGE_M).any():
                continue
        kept.append(run)
    return kept


def _selected(lines: Lines, which: Bools) -> Lines:
    return Lines(
        lines.normal_rad[which],
        lines.rho_m[which],
        lines.sd_m[which],
        lines.low_m[which],
        lines.high_m[which],
        lines.aligned[which],
    )
