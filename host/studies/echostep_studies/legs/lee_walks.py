# SPDX-License-Identifier: MIT
"""The rows `lap/...`, `storeys...` and `floors`: the three experiments of [Lee 2010], by the method of the paper and by ours.

In: seeds. Out: a lap of 40 x 30 m, and the way down from the 5th floor to the 1st with its 3D track; a row a method. Owns nothing.
Everything is simulated, from the bytes of the simulated board on: frames, clock and counts are read as live. Each run is another person in another
magnetic field. All methods are given the place and the heading of the start, and the wearer's legs to within a centimetre; with the plan the wearer
is calibrated by a walk of 10 m before.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from msgspec import UNSET, UnsetType

from echostep.arrays import Floats
from echostep.legs.kinematics import LegLengths
from echostep.legs.stride import StrideSettings
from echostep.legs.trunk_path import WearerSettings
from echostep.plan import Plan, Pose
from echostep.ports.chunks import Chunk
from echostep.settings import Settings
from echostep.tracker import Tracker
from echostep_app.offline.leg_track import track_default
from echostep_app.output.table import Table
from echostep_simulation.people.walker import Walk, walk
from echostep_studies.bench.walks import tracked
from echostep_studies.frame.parts import Part
from echostep_studies.frame.report import Row, means, named
from echostep_studies.frame.study import StudyRequest
from echostep_studies.frame.truth import at_times
from echostep_studies.legs.board_walks import (
    STOREY_M,
    STOREYS,
    MeasuredWalk,
    chunks_of,
    descent_of,
    lap_of,
    lap_plan,
    measure,
    person_of,
    start_of,
    storeys,
)
from echostep_studies.papers import lee2010

PRINTED: tuple[dict[str, Any], ...] = ({"name": "lap, the paper", "ending_m": 8.0},)
COLUMNS = {
    "name": "", "ending_m": "ending", "ending_max_m": "worst", "mean_m": "mean", "distance_error_percent": "way %", "floor_right": "floor right",
}  # fmt: skip
LEGEND = "ending, mean: error of the place at the end and on the way; way: error of the distance walked. Simulated."
CALIBRATION_M = 10.0
KNOWN_S = 2.0  # of standing on the floor where the walk begins: its pressure is the reference


@dataclass(frozen=True, slots=True, kw_only=True)
class LeeRun:
    """One method with one person: errors at the end and on the way; the row `floors` has no distance, those of the lap no floors."""

    name: str
    profile: str
    seed: int
    ending_m: float
    mean_m: float
    distance_error_percent: float | UnsetType = UNSET
    floor_right: float | UnsetType = UNSET


@dataclass(frozen=True, slots=True)
class MethodTrack:
    """A method's track (n, 3) t_s, x, y from the true start on, and the distance walked that it reports."""

    track: Floats
    distance_m: float


def lee_rows(names: Sequence[str], seed: int) -> list[LeeRun]:
    """The rows of these names for one person."""
    laps, descents = ([name for name in names if (name in LAPS) is on_lap] for on_lap in (True, False))
    return (lap_rows(laps, seed) if laps else []) + (descent_rows(descents, seed) if descents else [])


def lap_rows(names: Sequence[str], seed: int) -> list[LeeRun]:
    """The lap of one person by these methods."""
    lap, plan = lap_of(seed), lap_plan()
    chunks = chunks_of(lap, plan.levels, seed)
    measured, by_plan = measure(chunks, seed), partial(with_plan, plan, chunks, seed)
    return [_row(name, seed, lap, (LAPS[name] or by_plan)(measured, start_of(lap))) for name in names]


def descent_rows(names: Sequence[str], seed: int) -> list[LeeRun]:
    """The way down of one person by these methods, and the floors of the paper's rule."""
    descent = descent_of(seed)
    measured = measure(chunks_of(descent, storeys(), seed), seed)
    floors = floors_of(measured.pressure)
    height_m = np.interp(floors[:, 0], descent.t_s, descent.height_m)
    right = float((floors[:, 1] == np.rint(height_m / STOREY_M)).mean())
    rows = []
    for name in names:
        if name == "floors":
            off_m = np.abs(floors[:, 1] * STOREY_M - height_m)
            row = LeeRun(name=name, profile="lee2010", seed=seed, ending_m=float(off_m[-1]), mean_m=float(off_m.mean()))
        else:
            row = _row(name, seed, descent, DESCENTS[name](measured, start_of(descent)))
        rows.append(replace(row, floor_right=right))
    return rows


def _row(name: str, seed: int, walked: Walk, method: MethodTrack) -> LeeRun:
    off = np.hypot(*(method.track[:, 1:] - at_times(method.track[:, 0], walked.t_s, walked.trunk_m)).T)
    way = float(np.hypot(*np.diff(walked.foot_m[::50, :2], axis=0).T).sum())
    return LeeRun(
        name=name, profile="default" if "default" in name else "lee2010", seed=seed, ending_m=float(off[-1]),
        mean_m=float(off.mean()), distance_error_percent=100.0 * (method.distance_m / way - 1.0),
    )  # fmt: skip


def by_lee(measured: MeasuredWalk, start: tuple[float, float, float]) -> MethodTrack:
    """The paper's method: its equations at 10 Hz."""
    s = measured.samples
    settings = lee2010.LeeSettings(legs=lee2010.Lee2010Legs(measured.segments.thigh_m, measured.segments.shank_m))
    walker = lee2010.Walker(settings)
    walker.heading = lee2010.Fused(start[2], 0.0)
    return _dead_reckoned(walker.feed(s.t_s, s.thigh, s.shank, s.belt, s.compass), start)


def by_default(measured: MeasuredWalk, start: tuple[float, float, float]) -> MethodTrack:
    """The default method: strides and fused heading by dead reckoning."""
    return _dead_reckoned(
        track_default(measured.samples, StrideSettings(measured.segments), start[2]).rows[::20], start
    )


def _dead_reckoned(rows: Floats, start: tuple[float, float, float]) -> MethodTrack:
    """The track of rows (n, >= 6) with time, distance and place in columns 0, 1, 4 and 5."""
    return MethodTrack(np.column_stack([rows[:, 0], rows[:, 4] + start[0], rows[:, 5] + start[1]]), float(rows[-1, 1]))


def with_plan(
    plan: Plan, chunks: Sequence[Chunk], seed: int, measured: MeasuredWalk, start: tuple[float, float, float]
) -> MethodTrack:
    """The default method on the plan: the tracker on the board's bytes, with legs and pings, without foot."""
    scale = scale_of(measured.segments, seed)
    wearer = WearerSettings(measured.segments.thigh_m, measured.segments.shank_m, scale)
    tracker = Tracker(plan, Pose(*start), Settings(wearer=wearer), seed)
    track = np.array([(e.t_s, e.x_m, e.y_m) for e in tracked(tracker, chunks)])
    return MethodTrack(track, float(np.hypot(*np.diff(track[:, 1:], axis=0).T).sum()))


def scale_of(segments: LegLengths, seed: int) -> float:
    """What `echostep calibrate` finds of this person on 10 m straight on."""
    walked = walk(((0.0, 0.0), (CALIBRATION_M, 0.0)), person_of(seed), np.random.default_rng([seed, 36]))
    measured = measure(chunks_of(walked, storeys()[:1], seed), seed)
    return CALIBRATION_M / float(track_default(measured.samples, StrideSettings(segments), 0.0).rows[-1, 1])


def floors_of(pressure: Floats) -> Floats:
    """(n, 2) t_s and number of the floor from 0, by the paper's rule, when the first reading's floor is known: the highest."""
    heights = [k * STOREY_M for k in range(STOREYS)]
    reference = float(np.median(pressure[pressure[:, 0] < pressure[0, 0] + KNOWN_S, 1]))
    floors = [lee2010.floor_of(p, heights, reference, STOREYS - 1) for p in pressure[:, 1].tolist()]
    return np.column_stack([pressure[:, 0], floors])


def _summary(rows: Sequence[LeeRun]) -> Row:
    columns = means(rows, ("ending_m", "mean_m", "distance_error_percent", "floor_right"), 4)
    worst = round(max(row.ending_m for row in rows), 4)
    return named(rows) | {"profile": rows[0].profile, "ending_max_m": worst} | columns


def _tables(rows: list[Row], request: StudyRequest) -> list[Table]:
    shown = [row for row in rows if "ending_max_m" in row]
    title = f"Lee and Lee 2010: {request.runs} simulated runs, metres; last, the paper's one real lap"
    return [Table(title, [*shown, *PRINTED] if shown else (), COLUMNS, (LEGEND,))]


Method = Callable[[MeasuredWalk, tuple[float, float, float]], MethodTrack]
LAPS: dict[str, Method | None] = {"lap/lee2010": by_lee, "lap/default": by_default, "lap/default+plan": None}
DESCENTS: dict[str, Method] = {"storeys": by_lee, "storeys/default": by_default}
PART = Part([*LAPS, *DESCENTS, "floors"], lee_rows, {LeeRun: _summary}, _tables)
