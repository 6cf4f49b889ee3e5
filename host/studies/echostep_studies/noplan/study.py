# SPDX-License-Identifier: MIT
"""The study `noplan`: each building drawn from one walk, beside the foot alone and FootSLAM on the same path; another person tracked on the drawing;
the trails of [Fischer 2008], which have no plan.

In: seeds; the public recordings for westport-house, real feet and real clutter. Out: the table, JSON, Parquet, a picture of each drawing of the
first seed. Owns nothing.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from echostep.arrays import Floats
from echostep.localization import Start
from echostep.plan import Plan
from echostep_app.mapping.graph.nodes import nodes_of
from echostep_app.mapping.mapper import map_walk
from echostep_app.mapping.picture import draw_picture
from echostep_app.mapping.plan import plan_in
from echostep_studies.bench.filtering import Claim, track
from echostep_studies.bench.judgement import TRACKING, TruePlaces, judge, true_levels
from echostep_studies.bench.recordings import hallways
from echostep_studies.bench.recordings.foot_metrics import rmse
from echostep_studies.bench.sites import Site, westport_in
from echostep_studies.bench.walks import SimulatedWalk
from echostep_studies.frame.parts import Part, study_of
from echostep_studies.frame.report import Row, as_dict
from echostep_studies.frame.study import Study, StudyRequest
from echostep_studies.frame.truth import at_times
from echostep_studies.noplan import real_clutter, sites, trails
from echostep_studies.noplan.columns import SUMMARIES, DrawnRun, RunRow, SecondRun, tables
from echostep_studies.noplan.footslam import footslam
from echostep_studies.noplan.judgement import (
    closure_columns,
    known_start,
    levels_of,
    path_columns,
    storey_columns,
    wall_columns,
)
from echostep_studies.noplan.walks import walked

SPEED_M_S = 0.93  # of a tour with its pauses and turns, as simulated
SECOND_M = 150.0  # way of the second person
MINUTES = (10, 60)
SITES = ("office", "corridors", "westport", "storeys")
REAL = ("westport", "storeys")  # of the public recordings


def names_of(data: Path | None) -> list[str]:
    """Names of the rows; without the recordings there is no westport-house."""
    known = [site for site in SITES if data or site not in REAL]
    return [f"{site}/{minutes}min" for minutes in MINUTES for site in known] + _real_names(data)


def _real_names(data: Path | None) -> list[str]:
    """Rows of real feet, and of real clutter."""
    if data is None:
        return []
    known = {"feet": hallways.names_in(data), "clutter": real_clutter.names_in(data)}
    return [f"{kind}/{name}" for kind, names in known.items() for name in names]


def drawn_names(data: Path | None, pictures: Path, first: int, names: tuple[str, ...], seed: int) -> list[RunRow]:
    """The rows of these names for the walk of this seed; pictures for the first seed."""
    rows: list[RunRow] = []
    for name in names:
        kind, minutes = name.split("/")
        picture = pictures / f"{name.replace('/', '-')}.png" if seed == first else None
        if kind in ("feet", "clutter"):
            assert data is not None
            rows.append(_real_row(name, seed, data, picture))
        else:
            site = _site(kind, seed, 60.0 * SPEED_M_S * int(minutes.removesuffix("min")), data)
            rows += drawn_rows(name, site, seed, picture)
    return rows


def _real_row(name: str, seed: int, data: Path, picture: Path | None) -> DrawnRun:
    """A recording with the echoes of this seed; a foot is judged at its footprints."""
    kind, recording = name.split("/")
    if kind == "clutter":
        return drawn_row(name, real_clutter.walked_log(real_clutter.names_in(data)[recording], seed), seed, picture)[0]
    hallway = hallways.read_hallway(hallways.names_in(data)[recording])
    walk = hallways.walked_hallway(hallway, seed)
    return drawn_row(name, walk, seed, picture, hallways.START_S + hallway.print_t_s)[0]


def _site(kind: str, seed: int, length_m: float, data: Path | None) -> Site:
    if kind in REAL:
        assert data is not None
        return {"westport": sites.westport, "storeys": sites.storeys}[kind](seed, length_m, data)
    return sites.office(seed, length_m) if kind == "office" else sites.corridors(seed, length_m)


def drawn_rows(name: str, site: Site, seed: int, picture: Path | None) -> tuple[DrawnRun, SecondRun]:
    """One walk drawn and judged; its drawing tried by a second person."""
    row, plan, levels = drawn_row(name, walked(site, seed), seed, picture)
    return row, _second(f"second/{name}", site, plan, levels, seed)


def drawn_row(
    name: str, walk: SimulatedWalk, seed: int, picture: Path | None, at_s: Floats | None = None
) -> tuple[DrawnRun, Plan, list[int]]:
    """One walk drawn and judged, its path at times `at_s` (k,), or at every node; its plan in the map, and the true level of each drawn one."""
    begin_s = time.process_time()
    mapped = map_walk(walk.segments)
    map_s = time.process_time() - begin_s
    nodes, pose = mapped.graph.nodes, mapped.graph.pose
    truth, levels = walk.places_at(nodes.t_s), levels_of(mapped, walk)
    frame = known_start(pose[:, :2], truth)
    drawn = [np.zeros((0, 4))] * len(walk.built.levels)
    for level, drawing in zip(levels, mapped.drawings, strict=True):
        walls = frame.to_map(drawing.walls.reshape(-1, 2)).reshape(-1, 4)
        drawn[level] = np.concatenate([drawn[level], walls])
    judged = (
        wall_columns(drawn, walk), storey_columns(mapped, walk), closure_columns(mapped.graph.closures, pose, truth, frame),
    )  # fmt: skip
    columns = {key: value for part in judged for key, value in as_dict(part).items()}
    at_s = nodes.t_s if at_s is None else at_s
    foot, _ = nodes_of(walk.segments)  # by foot and belt live: the mapper smooths, and takes a bias out of it
    paths = {"": pose, "foot_": foot.pose, "footslam_": footslam(foot, np.random.default_rng([seed, 85]))}
    for of, path in paths.items():
        placed = known_start(path[:, :2], truth).to_map(path[:, :2])
        at = at_times(at_s, nodes.t_s, placed)
        columns |= {of + key: value for key, value in as_dict(path_columns(at, walk.places_at(at_s))).items()}
    row = DrawnRun(name=name, seed=seed, map_s=map_s, shape_m=rmse(pose[:, :2], truth), **columns)
    plan, walked_m = plan_in(mapped, frame.to_map, walk.pose_at(float(nodes.t_s[0])), name)
    if picture is not None:
        picture.parent.mkdir(parents=True, exist_ok=True)
        draw_picture(picture, plan, walked_m, [walk.built.levels[level] for level in levels])
    return row, plan, levels


def _second(name: str, site: Site, drawn: Plan, levels: list[int], seed: int) -> SecondRun:
    """Another person on the drawing, from a known start, the other way round along the first one's tour.

    `levels`: the true level of each drawn one.
    """
    way, points = 0.0, [site.waypoints[-1]]
    for point in site.waypoints[-2::-1]:
        way += float(np.hypot(point[0] - points[-1][0], point[1] - points[-1][1]))
        points.append(point)
        if way > SECOND_M:
            break
    walk: SimulatedWalk = walked(Site(site.built, tuple(points)), seed + 500_000)
    begin = walk.pose_at(walk.segments[0].segment.t0_s)
    run = track(walk.segments, drawn, Start(replace(begin, level=levels.index(begin.level))), seed)
    return second_row(name, seed, walk, drawn, levels, run.claims)


def second_row(
    name: str, seed: int, walk: SimulatedWalk, drawn: Plan, levels: list[int], claims: Sequence[Claim]
) -> SecondRun:
    """The claims of another person against the truth, in the frame of the building."""
    t_s = np.array([c.t_s for c in claims])
    truth = walk.places_at(t_s)
    right = true_levels(truth, walk.heights_at(t_s), walk.built)[:, levels]
    judged = judge(claims, TruePlaces(truth, right), np.zeros(len(t_s)))
    error = np.hypot(*(np.array([(c.x_m, c.y_m) for c in claims]) - truth).T)
    return SecondRun(
        name=name, seed=seed, mean_m=float(error.mean()), end_m=float(error[-1]),
        tracking=float(np.mean(judged.status == TRACKING)), false_tracking=float(judged.false_tracking.mean()),
        beyond=float(judged.beyond_protection.mean()), refused=sum(level.is_refused for level in drawn.levels),
    )  # fmt: skip


def noplan_study(data: Path | None, pattern: str, request: StudyRequest) -> Study[Any, Row]:
    """The study of the rows whose names match a pattern; `data`: folder of the public recordings."""
    westport_in(data)
    run = partial(drawn_names, data, request.out, request.seed)
    return study_of("noplan", (Part(names_of(data), run, SUMMARIES, tables), trails.PART), pattern)
