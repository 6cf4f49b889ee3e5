# SPDX-License-Identifier: MIT
"""The walls of a solved graph.

In: a graph, its pings. Out: `Drawing`. Owns the order: first the lines that have the building's directions, then the others from the rest.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields, replace
from typing import NamedTuple

import numpy as np

from echostep.arrays import Bools, Floats, Ints, spans
from echostep.plan import is_no_plan
from echostep_app.mapping.graph.directions import ALONG_SD_RAD, course_of
from echostep_app.mapping.graph.graph import Graph
from echostep_app.mapping.graph.nodes import Pings
from echostep_app.mapping.walls.evidence import (
    Cells,
    add_crossings,
    add_sights,
    cell_counts,
    explained_by_ends,
    is_straight,
    ping_poses,
)
from echostep_app.mapping.walls.lines import Lines, find_lines, joined
from echostep_app.mapping.walls.place_sd import are_known, placed_pieces
from echostep_app.mapping.walls.segments import ACROSS, ANY, ASKEW, Run, find_runs, meets, segments_of
from echostep_app.mapping.walls.wall_sd import wall_sds

# Least wall on one line; shorter ones must be detected again, or be across the path. One passer-by in 15, in 70, goes along for longer, when
# one second is the mean
LONE_M, LONE_ASKEW_M = 2.5, 6.0
PASSAGE_M = 5.0  # of path, between two passages
ALONG_RAD = 2.0 * ALONG_SD_RAD  # of a piece from the course of the path, within which a person may have gone along


@dataclass(frozen=True, slots=True)
class Drawing:
    """`walls` (n, 4): x0, y0, x1, y1 in metres; `sd_m` (n,): standard deviation of the distance of each from nearby places.

    `doubtful` (d, 4), `doubtful_sd_m` (d,): the same of short walls that no second passage confirmed, and of walls whose place in the building is
    not known well enough. `place_sd` (p, 3): x, y of pieces of both, and the standard deviation per axis of their place in the building. `paths_m`:
    the corrected path (k, 2), or each piece of it on this level.
    """

    walls: Floats
    sd_m: Floats
    paths_m: tuple[Floats, ...]
    doubtful: Floats = field(default_factory=lambda: np.zeros((0, 4)))
    doubtful_sd_m: Floats = field(default_factory=lambda: np.zeros(0))
    place_sd: Floats = field(default_factory=lambda: np.zeros((0, 3)))

    @property
    def all_walls(self) -> Floats:
        """All walls with their standard deviation (n + d, 5)."""
        return np.concatenate(
            [np.column_stack([self.walls, self.sd_m]), np.column_stack([self.doubtful, self.doubtful_sd_m])]
        )


def draw(graph: Graph, pings: Pings) -> tuple[Drawing, ...]:
    """The walls that the echoes of a walk show, on each level."""
    levels = graph.levels
    if levels is None:
        return (_drawn(graph, pings, (graph.path,)),)
    walls = []
    for k in range(len(levels.height_m)):
        on = levels.of == k
        of = np.where(on[graph.fragments.node], graph.walls.of, -1)
        own = on[pings.node]
        paths = tuple(graph.path[a:b] for a, b in spans(on))
        part = replace(graph, walls=replace(graph.walls, of=of))
        walls.append(_drawn(part, Pings(*(getattr(pings, f.name)[own] for f in fields(pings))), paths))
    return tuple(walls)


class _Heard(NamedTuple):
    """Pings (k,): corrected place and axis (k, 3), length of the path so far, course of the path there."""

    poses: Floats
    way_m: Floats
    course_rad: Floats


def _drawn(graph: Graph, pings: Pings, paths: tuple[Floats, ...]) -> Drawing:
    """The walls that these pings show, beside these paths."""
    poses = ping_poses(graph, pings)
    way_m, ahead = graph.nodes.way_m[pings.node], is_straight(graph, pings)
    placed_pings = _Heard(poses, way_m, course_of(graph.pose, graph.nodes.way_m, way_m))
    lines, every = find_lines(graph), np.ones(len(poses), np.bool_)

    def counted(some: Lines, free: Bools) -> Cells:
        cells = cell_counts(some, poses, pings.range_m, free, ahead)
        add_crossings(some, paths, cells)
        add_sights(some, poses, pings.range_m, ahead, cells)
        return cells

    aligned = lines.aligned if lines.aligned.any() else np.ones(len(lines.rho_m), np.bool_)
    straight = _selected(lines, aligned)
    cells = counted(straight, every)
    candidates = find_runs(cells, ACROSS if lines.aligned.any() else ANY)
    runs = _without_lone(candidates, straight, LONE_M, placed_pings, cells.of)
    if not aligned.all():
        walls = segments_of(straight, runs, cells)
        free = (cells.of < 0) & ~explained_by_ends(walls, poses, pings.range_m)
        askew = _selected(lines, ~aligned)
        more = counted(askew, free)
        candidates = _without_lone(find_runs(more, ASKEW), askew, LONE_ASKEW_M, placed_pings, more.of)
        with_runs = sorted({run.line for run in candidates})
        runs += [run._replace(line=len(straight.rho_m) + with_runs.index(run.line)) for run in candidates]
        straight = joined(straight, _selected(askew, np.isin(np.arange(len(askew.rho_m)), with_runs)))
        cells = counted(straight, every)
    walls = segments_of(straight, runs, cells)
    sd_m = wall_sds(graph, pings, poses, straight, runs, cells.of)
    placed = placed_pieces(graph, pings, poses, straight, runs, cells.of)
    again = np.array([_is_confirmed(straight, run, placed_pings, cells.of) for run in runs], np.bool_)
    known = again & are_known(len(runs), placed)
    rows = np.array([(*piece.at_m, piece.sd_m) for piece in placed]).reshape(-1, 3)
    if is_no_plan(rows):
        known[:] = False
    return Drawing(walls[known], sd_m[known], paths, walls[~known], sd_m[~known], rows)


def _without_lone(runs: list[Run], lines: Lines, least_m: float, heard: _Heard, of: Ints) -> list[Run]:
    """Without pieces shorter than `least_m` in all on their line that meet no wall and that a person may have left; `of` (k,): line of each ping."""
    total = np.zeros(len(lines.rho_m))
    for run in runs:
        total[run.line] += run.high_m - run.low_m
    return [
        run
        for i, run in enumerate(runs)
        if meets(lines, runs, i) or total[run.line] >= least_m or not _is_of_a_person(run, lines, heard, of)
    ]


def _is_of_a_person(run: Run, lines: Lines, heard: _Heard, of: Ints) -> bool:
    """Whether a piece may be of a person: detected in one passage, and along the path or along no direction of the building."""
    own = _own(lines, run, heard, of)
    if _passages(heard.way_m[own]) > 1:
        return False
    normal = lines.normal_rad[run.line]
    off = np.abs((normal - heard.course_rad[own]) % math.pi - 0.5 * math.pi)
    return not lines.aligned[run.line] or bool(np.median(off) < ALONG_RAD)


def _is_confirmed(lines: Lines, run: Run, heard: _Heard, of: Ints) -> bool:
    """Whether a second passage detected a piece, or it is longer than a person's."""
    if run.high_m - run.low_m >= (LONE_M if lines.aligned[run.line] else LONE_ASKEW_M):
        return True
    return _passages(heard.way_m[_own(lines, run, heard, of)]) > 1


def _own(lines: Lines, run: Run, heard: _Heard, of: Ints) -> Ints:
    """The pings that detected a piece."""
    normal = lines.normal_rad[run.line]
    along = math.cos(normal) * heard.poses[:, 1] - math.sin(normal) * heard.poses[:, 0]
    return np.flatnonzero((of == run.line) & (along >= run.low_m) & (along <= run.high_m))


def _passages(way_m: Floats) -> int:
    """Number of passages in which pings at these lengths of the path (k,) were heard."""
    return int((np.diff(np.sort(way_m)) > PASSAGE_M).sum()) + min(len(way_m), 1)


def _selected(lines: Lines, which: Bools) -> Lines:
    return Lines._make(column[which] for column in lines)
