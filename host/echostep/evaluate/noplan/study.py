# SPDX-License-Identifier: MIT
"""The study `noplan`: each building drawn from one walk, beside the foot alone and FootSLAM on the same path; another person tracked on the drawing.

In: seeds; the public recordings for westport-house. Out: the table, JSON, Parquet, a picture of each drawing of the first seed. Owns nothing.
"""

from __future__ import annotations

import time
from dataclasses import replace
from fnmatch import fnmatch
from functools import partial
from pathlib import Path

import numpy as np

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.evaluate.anywhere.filtering import track
from echostep.evaluate.anywhere.sites import Site, plan_of
from echostep.evaluate.anywhere.walks import SimulatedWalk
from echostep.evaluate.noplan import sites
from echostep.evaluate.noplan.footslam import footslam
from echostep.evaluate.noplan.joined import again, joined_row, joined_summary, strangers_row, walked_pair
from echostep.evaluate.noplan.judgement import closure_columns, known_start, path_columns, true_path, wall_columns
from echostep.evaluate.noplan.walks import walked
from echostep.evaluate.report import LOST_M, Row, Table, rows_by_name
from echostep.evaluate.study import Study, StudyRequest
from echostep.localization.start import Start
from echostep.mapping.mapper import map_walk
from echostep.mapping.picture import draw_picture
from echostep.plan.gaps import door_gaps

SPEED_M_S = 0.93  # of a tour with its pauses and turns, as simulated
SECOND_M = 150.0  # way of the second person
MINUTES = (10, 60)
SITES = ("office", "corridors", "westport")
JOINED_MIN = 5  # of each of two walks
STRANGERS = {"office": "corridors", "corridors": "westport", "westport": "office"}  # another building
COLUMNS = {
    "name": "row", "rmse_m": "RMSE m", "worst_rmse_m": "worst", "foot_m": "foot alone", "footslam_m": "FootSLAM", "wall_median_m": "walls m",
    "wall95_m": "95 %", "drawn_pc": "drawn %", "absent_pc": "not there %", "closures": "closures", "wrong": "wrong", "map_s": "s",
}  # fmt: skip
JOINED_COLUMNS = {
    "name": "row", "joined": "joined", "misplaced": "misplaced", "runs": "runs", "joined_rmse_m": "RMSE m", "worst_rmse_m": "worst",
    "drawn_pc": "drawn %", "closures": "closures", "wrong": "wrong",
}  # fmt: skip
SECOND_COLUMNS = {"name": "row", "mean_m": "mean m", "worst_m": "worst mean m", "lost": "lost", "runs": "runs"}


def names_of(data: Path | None) -> list[str]:
    """Names of the rows; without the recordings there is no westport-house."""
    known = [site for site in SITES if data or site != "westport"]
    pairs = [f"{kind}/{site}" for kind in ("joined", "strangers") for site in known]
    if not data:
        pairs.remove("strangers/corridors")
    return [f"{site}/{minutes}min" for minutes in MINUTES for site in known] + pairs


def one_run(names: tuple[str, ...], data: Path | None, pictures: Path, first: int, seed: int) -> list[Row]:
    """The rows of these names for the walk of this seed; pictures for the first seed."""
    rows = []
    for name in names:
        kind, minutes = name.split("/")
        if kind in ("joined", "strangers"):
            rows.append(_pair_row(name, seed, data))
            continue
        site = _site(kind, seed, 60.0 * SPEED_M_S * int(minutes.removesuffix("min")), data)
        picture = pictures / f"{name.replace('/', '-')}.png" if seed == first else None
        rows += drawn_rows(name, site, seed, picture)
    return rows


def _pair_row(name: str, seed: int, data: Path | None) -> Row:
    """Two walks of JOINED_MIN through one building, or through two."""
    pairing, kind = name.split("/")
    length_m = 60.0 * SPEED_M_S * JOINED_MIN
    site = _site(kind, seed, length_m, data)
    if pairing == "joined":
        return joined_row(name, walked_pair(site, again(site, length_m, seed), seed), seed)
    return strangers_row(name, walked_pair(site, _site(STRANGERS[kind], seed, length_m, data), seed), seed)


def _site(kind: str, seed: int, length_m: float, data: Path | None) -> Site:
    if kind == "westport":
        assert data is not None
        return sites.westport(seed, length_m, data)
    return sites.office(seed, length_m) if kind == "office" else sites.corridors(seed, length_m)


def drawn_rows(name: str, site: Site, seed: int, picture: Path | None) -> list[Row]:
    """One walk drawn and judged; its drawing tried by a second person."""
    walk = walked(site, seed)
    begin_s = time.process_time()
    mapped = map_walk(walk.segments)
    map_s = time.process_time() - begin_s
    nodes, pose = mapped.graph.nodes, mapped.graph.pose
    truth = true_path(walk, nodes.t_s)
    frame = known_start(pose[:, :2], truth)
    walls = frame.to_map(mapped.drawing.walls.reshape(-1, 2)).reshape(-1, 4)
    row: Row = {"name": name, "seed": seed, "map_s": map_s} | path_columns(frame.to_map(pose[:, :2]), truth)
    row |= wall_columns(walls, walk) | closure_columns(mapped.graph.closures, pose, truth, frame)
    peers = {"foot": nodes.pose[:, :2], "footslam": footslam(nodes, np.random.default_rng([seed, 85]))}
    for peer, path in peers.items():
        row[f"{peer}_m"] = path_columns(known_start(path, truth).to_map(path), truth)["rmse_m"]
    if picture is not None:
        picture.parent.mkdir(parents=True, exist_ok=True)
        plan = plan_of(name, walls)
        draw_picture(picture, plan, [[frame.to_map(pose[:, :2])]], walk.built.levels[0])
    sd_m = float(np.sqrt(np.mean(mapped.drawing.sd_m**2)))
    return [row, {"name": f"second/{name}", "seed": seed} | _second(site, walls, sd_m, seed)]


def _second(site: Site, walls: Floats, sd_m: float, seed: int) -> Row:
    """Another person, from a known start, the other way round along the first one's tour."""
    way, points = 0.0, [site.waypoints[-1]]
    for point in site.waypoints[-2::-1]:
        way += float(np.hypot(point[0] - points[-1][0], point[1] - points[-1][1]))
        points.append(point)
        if way > SECOND_M:
            break
    walk: SimulatedWalk = walked(Site(site.built, tuple(points)), seed + 500_000)
    plan = plan_of("drawn", walls)
    level = replace(plan.levels[0], doors=door_gaps(plan.levels[0]))
    drawn = replace(plan, levels=(level,), uncertainty_m=sd_m)
    run = track(walk.segments, drawn, Start(walk.pose_at(walk.segments[0].segment.t0_s)), seed)
    places = np.array([(c.x_m, c.y_m) for c in run.claims])
    error = np.hypot(*(places - true_path(walk, np.array([c.t_s for c in run.claims]))).T)
    return {"mean_m": float(error.mean()), "end_m": float(error[-1])}


def _summaries(rows: list[Row]) -> list[Row]:
    """Means over the runs; of the errors also the worst."""
    return [SUMMARIES.get(group[0]["name"].split("/")[0], _summary)(group) for group in rows_by_name(rows)]


def _summary(group: list[Row]) -> Row:
    def mean(key: str) -> float:
        return float(np.mean([row[key] for row in group if key in row]))

    row: Row = {"name": group[0]["name"], "runs": len(group)}
    row |= {key: mean(key) for key in ("rmse_m", "foot_m", "footslam_m", "wall_median_m", "wall95_m", "map_s")}
    row |= {
        "worst_rmse_m": max(r["rmse_m"] for r in group),
        "drawn_pc": 100.0 * mean("drawn"),
        "absent_pc": 100.0 * mean("absent"),
    }
    return row | {key: sum(r[key] for r in group) for key in ("closures", "wrong")}


def _second_summary(group: list[Row]) -> Row:
    means = [row["mean_m"] for row in group]
    lost = sum(row["end_m"] > LOST_M for row in group)
    return {
        "name": group[0]["name"],
        "runs": len(group),
        "mean_m": float(np.mean(means)),
        "worst_m": max(means),
        "lost": lost,
    }


SUMMARIES = {"second": _second_summary, "joined": joined_summary, "strangers": joined_summary}


def _tables(rows: list[Row], request: StudyRequest) -> list[Table]:
    first = [row for row in rows if "rmse_m" in row]
    second = [row for row in rows if "mean_m" in row]
    pairs = [row for row in rows if "joined" in row]
    title = f"Drawn without a plan: {request.runs} simulated walks a row"
    tables = [
        Table(title, first, COLUMNS),
        Table("Another person, tracked on the drawing", second, SECOND_COLUMNS),
        Table("Two walks of unknown start, of one building and of two", pairs, JOINED_COLUMNS),
    ]
    return [table for table in tables if table.rows]


def noplan_study(data: Path | None, pattern: str, request: StudyRequest) -> Study:
    """The study of the rows whose names match a pattern; `data`: folder of the public recordings."""
    if data is not None and not (data / "maps" / "westport-house").is_dir():
        raise EchostepError(f"{data / 'maps' / 'westport-house'}: not there: without --data its rows are left out")
    every = names_of(data)
    names = tuple(name for name in every if fnmatch(name, pattern))
    if not names:
        raise EchostepError(f"--rows {pattern}: no row is named so; there are: {', '.join(every)}")
    return Study("noplan", partial(one_run, names, data, request.out, request.seed), _summaries, _tables)
