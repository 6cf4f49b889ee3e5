# SPDX-License-Identifier: MIT
"""The experiment of [Girard 2011, 3.4 and 4] in simulation: the paper's three systems and the default filter on the same walks.

In: seeds. Out: rows in the form of the paper's Table 1, and the clouds of its Figures 10-13. Everything here is simulated: building, walker, sensors.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from echostep.arrays import Floats
from echostep.echoes.likelihood import EchoSettings
from echostep.localization import Building, FilterSettings, MapFilter, Start
from echostep.path import MeasuredSegment, PathSegment
from echostep.plan import Pose
from echostep.walls.echo_sources import Walls
from echostep_app.output.table import Table
from echostep_studies.frame.report import Row, as_dict, by_name, means, summary
from echostep_studies.frame.study import Study, StudyRequest
from echostep_studies.papers.girard2011 import Girard, GirardSettings
from echostep_studies.simulation.marker_walk import STEP_M, ImuModel, MarkerWalk, lay_markers, walk_markers
from echostep_studies.simulation.sites import (
    SimulatedSite,
    angled,
    displaced,
    furnished,
    hall,
    mistaken,
    otb,
    parallel,
    thousand,
    with_doors,
)

System = Callable[[SimulatedSite, MarkerWalk, int], Iterator["MethodOutput"]]

STEP_SD_M = 0.02  # of a careful step, per axis
AFTER_HALL_S = 10.0
HALL_X_M = 0.0
SITES: dict[str, Callable[[int], SimulatedSite]] = {
    "furniture": furnished,
    "doors": with_doors,
    "hall": lambda _: hall(),
    "plan": mistaken,
    "displaced": displaced,
    "parallel": lambda _: parallel(),
    "angles": lambda _: angled(),
    "thousand": lambda _: thousand(),
}
PAPER: tuple[dict[str, Any], ...] = (  # [Girard 2011, Table 1]
    {"name": "imu", "mean_m": 0.59, "sd_m": 0.35, "max_m": 1.47, "min_m": 0.01, "ending_m": 1.47},
    {"name": "model", "mean_m": 0.47, "sd_m": 0.30, "max_m": 1.06, "min_m": 0.01, "ending_m": 1.06},
    {"name": "ranging", "mean_m": 0.13, "sd_m": 0.07, "max_m": 0.40, "min_m": 0.03, "ending_m": 0.18},
)
COLUMNS = {
    "name": "", "mean_m": "mean", "sd_m": "sd", "max_m": "max", "min_m": "min", "ending_m": "ending", "worst_m": "worst", "ce95_m": "CE95",
    "coverage95": "in 95 %", "lost": "lost",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class MethodOutput:
    """Output of a system after a step: the estimate, and its cloud (n, 2) for the pictures; `inside` is None where it states no ellipse."""

    at_m: tuple[float, float]
    inside: bool | None
    cloud: Floats


@dataclass(frozen=True, slots=True, kw_only=True)
class MethodRun:
    """A method on a walk: its errors after each step, and whether its ellipses held the truth."""

    name: str
    profile: str
    seed: int
    errors_m: list[float]
    inside95: list[bool]


@dataclass(frozen=True, slots=True, kw_only=True)
class HallRun(MethodRun):
    """The same through a hall: how the errors grow in there, against dead reckoning, and the greatest one from AFTER_HALL_S after it on."""

    hall_growth_m: float
    foot_growth_m: float
    after_10s_m: float


def draw(folder: Path, seed: int, _rows: list[Row]) -> None:
    """The clouds after 9, 21 and 52 steps: without the plan, with it, with ranging, and the default filter [Girard 2011, Figures 10-13]."""
    from echostep_studies.frame.pictures import draw_clouds

    site = otb()
    walk = _walk(site, seed)
    systems: dict[str, System] = {
        "IMU only": partial(girard, model=False, ranging=False),
        "with model": SYSTEMS["model"],
        "with ranging": girard,
        "ours": default,
    }
    clouds, tracks = {}, {}
    for name, system in systems.items():
        seen = list(system(site, walk, seed))
        clouds[name] = {step: seen[step - 1].cloud for step in (9, 21, 52)}
        tracks[name] = np.vstack([walk.trunk_m[0], [s.at_m for s in seen]])
    draw_clouds(folder / "figures10-13.png", site.plan, walk.trunk_m, clouds, tracks)


def one_run(seed: int) -> list[MethodRun]:
    """All systems on the walk of this seed, and the default filter on every other site."""
    site = otb()
    walk = _walk(site, seed)
    rows = [method_run(name, "girard2011", seed, walk, system(site, walk, seed)) for name, system in SYSTEMS.items()]
    rows.append(method_run("default", "default", seed, walk, default(site, walk, seed)))
    for name, build in SITES.items():
        site = build(seed)
        walk = _walk(site, seed)
        row = method_run(f"default/{name}", "default", seed, walk, default(site, walk, seed))
        rows.append(_in_hall(walk, row) if name == "hall" else row)
    return rows


def dead_reckoned(_site: SimulatedSite, walk: MarkerWalk, _seed: int) -> Iterator[MethodOutput]:
    """Fixed steps in the measured directions [Girard 2011, Figure 10]."""
    way = np.column_stack([np.cos(walk.heading_rad), np.sin(walk.heading_rad)]) * STEP_M
    for x, y in (walk.trunk_m[0] + np.cumsum(way, axis=0)).tolist():
        yield MethodOutput((x, y), None, np.array([[x, y]]))


def girard(
    site: SimulatedSite, walk: MarkerWalk, seed: int, *, model: bool = True, ranging: bool = True,
    settings: GirardSettings | None = None,
) -> Iterator[MethodOutput]:  # fmt: skip
    """The paper's filter: on its plan or without, with one pair of pings a step or without."""
    walls = site.plan if model else None
    x0, y0 = walk.trunk_m[0].tolist()
    filter_ = Girard(settings or GirardSettings(), (x0, y0), walls, np.random.default_rng([seed, 20]))
    for k, heading in enumerate(walk.heading_rad.tolist()):
        pair = (float(walk.pair_m[k + 1, 0]), float(walk.pair_m[k + 1, 1])) if ranging else None
        at = filter_.step(STEP_M * math.cos(heading), STEP_M * math.sin(heading), heading, pair)
        yield MethodOutput(at, None, np.column_stack([filter_.x_m, filter_.y_m]))


def default(
    site: SimulatedSite, walk: MarkerWalk, seed: int, echo: EchoSettings | None = None
) -> Iterator[MethodOutput]:
    """The default filter: the same steps and headings, and every ping of the walk; `echo`: of other rangers than SRF02."""
    x0, y0 = walk.trunk_m[0].tolist()
    start = Start(Pose(x0, y0, walk.start_heading_rad))
    rng = np.random.default_rng([seed, 21])
    settings = FilterSettings(echo=echo or EchoSettings())
    map_filter = MapFilter(Building(Walls(site.plan)), start, walk.start_heading_rad, rng, settings)
    since_s = -math.inf
    for k, (turning, step) in enumerate(_segments(walk)):
        if turning is not None:
            map_filter.update(_measured_segment(turning, walk, since_s))
            since_s = turning.t1_s
        estimate = map_filter.update(_measured_segment(step, walk, since_s))
        since_s = step.t1_s
        cloud = np.column_stack([map_filter.cloud.x_m, map_filter.cloud.y_m])
        yield MethodOutput((estimate.x_m, estimate.y_m), estimate.holds(*walk.trunk_m[k + 1].tolist()), cloud)


SYSTEMS: dict[str, System] = {
    "imu": dead_reckoned,
    "model": partial(girard, ranging=False),
    "ranging": girard,
}


def _measured_segment(segment: PathSegment, walk: MarkerWalk, since_s: float) -> MeasuredSegment:
    """A segment of the path with the pings since the one before it."""
    p = walk.pings
    on_it = (p.t_s > since_s) & (p.t_s <= segment.t1_s)
    return MeasuredSegment(segment, p.t_s[on_it], p.ranger[on_it], p.range_m[on_it])


def _segments(walk: MarkerWalk) -> Iterator[tuple[PathSegment | None, PathSegment]]:
    """The turn on the spot before each step (None: no turn), and the step, with the covariance that the unit states."""
    sd_m = math.hypot(STEP_SD_M, STEP_M * math.radians(ImuModel().noise_deg))
    before = walk.start_heading_rad
    for k, heading in enumerate(walk.heading_rad.tolist()):
        t0, leaves, t1 = float(walk.t_s[k]), float(walk.leaves_s[k]), float(walk.t_s[k + 1])
        turn_sd = float(walk.turn_sd_rad[k])
        turns = leaves > t0
        turning = PathSegment(t0, leaves, 0.0, 0.0, before, heading, 0.0, turn_sd, k) if turns else None
        dx, dy = STEP_M * math.cos(heading), STEP_M * math.sin(heading)
        yield turning, PathSegment(leaves, t1, dx, dy, heading, heading, sd_m, 0.0 if turns else turn_sd, k + 1)
        before = heading


def _walk(site: SimulatedSite, seed: int) -> MarkerWalk:
    return walk_markers(lay_markers(site.route), site.built, seed, site.passers)


def method_run(name: str, profile: str, seed: int, walk: MarkerWalk, outputs: Iterable[MethodOutput]) -> MethodRun:
    """The row of a method with these outputs."""
    seen, true = list(outputs), walk.trunk_m[1:].tolist()
    errors = [math.hypot(s.at_m[0] - x, s.at_m[1] - y) for s, (x, y) in zip(seen, true, strict=True)]
    inside = [s.inside for s in seen if s.inside is not None]
    return MethodRun(name=name, profile=profile, seed=seed, errors_m=errors, inside95=inside)


def _in_hall(walk: MarkerWalk, run: MethodRun) -> HallRun:
    """How the error grows where no wall is in range, against dead reckoning from the same step on, and when it is over."""
    x, errors_m = walk.trunk_m[1:, 0], run.errors_m
    inside = np.flatnonzero(x > HALL_X_M)
    first, last = int(inside[0]), int(inside[-1])
    imu = np.array([s.at_m for s in dead_reckoned(hall(), walk, 0)]) - walk.trunk_m[1:]
    foot = np.hypot(*(imu - imu[first])[first : last + 1].T)
    after = walk.t_s[1:] >= walk.t_s[1 + last] + AFTER_HALL_S
    return HallRun(
        **as_dict(run),
        hall_growth_m=max(errors_m[first : last + 1]) - errors_m[first],
        foot_growth_m=float(foot.max()),
        after_10s_m=max(e for e, late in zip(errors_m, after.tolist(), strict=True) if late),
    )


def summarize(runs: list[MethodRun]) -> Row:
    """The summary row of one name."""
    row = summary(runs[0].name, runs[0].profile, [r.errors_m for r in runs], [r.inside95 for r in runs])
    halls = [r for r in runs if isinstance(r, HallRun)]
    return row | (means(halls, ("hall_growth_m", "foot_growth_m", "after_10s_m"), 4) if halls else {})


def _tables(rows: list[Row], request: StudyRequest) -> list[Table]:
    """The table, with the paper's rows at its end."""
    printed = [row | {"name": f"{row['name']}, the paper"} for row in PAPER]
    title = f"Position error in metres, {request.runs} simulated runs; below, the paper's one real run"
    return [Table(title, [*rows, *printed], COLUMNS)]


STUDY = Study(
    "girard2011",
    (MethodRun, HallRun),
    one_run,
    by_name(summarize),
    _tables,
    draw,
)
