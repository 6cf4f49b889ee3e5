# SPDX-License-Identifier: MIT
"""The walls of a solved graph.

In: a graph, its pings. Out: `Drawing`. Owns the order: first the lines that have the building's directions, then the others from what is left.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echostep.arrays import Floats
from echostep.mapping.evidence import add_crossings, cell_counts, explained_by_ends, ping_poses
from echostep.mapping.graph import Graph
from echostep.mapping.lines import Lines, find_lines
from echostep.mapping.nodes import Pings
from echostep.mapping.segments import find_runs, segments_of


@dataclass(frozen=True, slots=True)
class Drawing:
    """`walls` (n, 4): x0, y0, x1, y1 in metres; `sd_m` (n,): standard deviation of each across its line; `path_m` (k, 2): the corrected path."""

    walls: Floats
    sd_m: Floats
    path_m: Floats


def draw(graph: Graph, pings: Pings) -> Drawing:
    """The walls that the echoes of a walk show."""
    poses, path = ping_poses(graph, pings), graph.pose[:, :2]
    lines = find_lines(graph)
    free = np.ones(len(poses), np.bool_)
    aligned = lines.aligned if lines.aligned.any() else np.ones(len(lines.rho_m), np.bool_)
    straight = _selected(lines, aligned)
    cells = cell_counts(straight, poses, pings.range_m, free)
    add_crossings(straight, path, cells)
    runs = find_runs(cells, np.ones(len(straight.rho_m), np.bool_))
    walls, _ = segments_of(straight, runs, cells)
    if not aligned.all():
        free = (cells.of < 0) & ~explained_by_ends(walls, poses, pings.range_m)
        askew = _selected(lines, ~aligned)
        more = cell_counts(askew, poses, pings.range_m, free)
        add_crossings(askew, path, more)
        found = find_runs(more, np.zeros(len(askew.rho_m), np.bool_))
        kept = sorted({run.line for run in found})
        both = Lines(*(np.concatenate([a, b[kept]]) for a, b in zip(straight, askew, strict=True)))
        runs += [run._replace(line=len(straight.rho_m) + kept.index(run.line)) for run in found]
        cells = cell_counts(both, poses, pings.range_m, np.ones(len(poses), np.bool_))
        add_crossings(both, path, cells)
        straight = both
    walls, sd = segments_of(straight, runs, cells)
    return Drawing(walls, sd, path)


def _selected(lines: Lines, which: np.ndarray) -> Lines:
    return Lines(*(column[which] for column in lines))
