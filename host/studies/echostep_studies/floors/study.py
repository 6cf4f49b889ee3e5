# SPDX-License-Identifier: MIT
"""Floors by pressure, simulated: how often the right floor is named, and for how long a wrong one.

In: seeds. Out: rows `floors/...`. A run is 20 minutes about five storeys under weather of 1 hPa/h (`simulation.vertical_day`,
`simulation.air_pressure`).

The true floor is the storey nearest to the wearer: on stairs and in a lift it changes at the middle between two. Within a quarter of
a metre of the middle both count as right (`floor_right`), because landings lie there; `strict_right` gives nothing away. Each floor is that of the
whole record, as `echostep floors` names it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from echostep.arrays import Bools, Floats, Ints, spans
from echostep_app.offline.floors.floors import Floors, record_floors
from echostep_app.offline.floors.pressure_csv import Pressures
from echostep_app.offline.floors.stays import height_record
from echostep_app.output.table import Table
from echostep_simulation.devices.board_sensors import PRESSURE_NOISE_PA, Mode
from echostep_studies.frame.report import Row, by_name, means, named
from echostep_studies.frame.study import Study, StudyRequest
from echostep_studies.simulation.air_pressure import Weather, device_temperatures, pressures
from echostep_studies.simulation.vertical_day import VerticalMove, climb

STOREYS_M = (0.0, 3.5, 7.0, 10.5, 14.0)
RUN_S = 1200.0
LANDING_TIE_M = 0.25
COUNTS_PA = 0.25
MODE_HZ: dict[Mode, float] = {"high-speed": 9.0, "high-resolution": 1.8}


STORM = Weather()


@dataclass(frozen=True, slots=True)
class FloorScene:
    """`known_start`: the first floor is given."""

    ways: Literal["stairs", "lift", "both"] = "both"
    weather: Weather = STORM
    mode: Mode = "high-speed"
    known_start: bool = True


SCENES = {
    "floors/stairs": FloorScene("stairs"),
    "floors/lift": FloorScene("lift"),
    "floors/both": FloorScene(),
    "floors/pulses": FloorScene(weather=replace(STORM, doors_s=30.0, fan_s=90.0, fan_pa=15.0)),
    "floors/high-resolution": FloorScene(mode="high-resolution"),
    "floors/unknown-start": FloorScene(known_start=False),
}
COLUMNS = {
    "name": "", "runs": "runs", "floor_right": "right %", "strict_right": "strict %", "worst_right": "worst run %",
    "longest_wrong_s": "longest wrong s",    "changes": "changes",
}  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class FloorRun:
    """One run: shares of right floors, with ties and strict, the longest time without a right one, changes of the true floor."""

    name: str
    seed: int
    floor_right: float
    strict_right: float
    longest_wrong_s: float
    changes: int


def one_run(seed: int) -> list[FloorRun]:
    """Every scene with the person and the weather of this seed."""
    return [_row(name, scene, seed) for name, scene in SCENES.items()]


def _row(name: str, scene: FloorScene, seed: int) -> FloorRun:
    rng = np.random.default_rng([seed, 50])
    way = climb(STOREYS_M, RUN_S, rng, scene.ways)
    sign = float(rng.choice((-1.0, 1.0)))
    weather = replace(scene.weather, trend_pa_h=sign * scene.weather.trend_pa_h, air_c=float(rng.uniform(17.0, 26.0)))
    at, samples = _measured(way, weather, scene, rng)
    heights = np.array(STOREYS_M)
    away = np.abs(way.height_m[at][:, None] - heights)
    true = away.argmin(axis=1)
    start = int(true[0]) if scene.known_start else None
    return judge(record_floors(samples.t_s, height_record(samples), heights, start), away, name, seed)


def _measured(
    way: VerticalMove, weather: Weather, scene: FloorScene, rng: np.random.Generator
) -> tuple[Ints, Pressures]:
    """What the SCP1000 reports of it, in counts and back, and which times of the walk these are."""
    air = pressures(way.t_s, way.height_m, way.in_shaft, weather, rng)
    device = device_temperatures(way.t_s, weather.air_c, rng)
    rate = 1.0 / float(way.t_s[1] - way.t_s[0])
    at = np.floor(np.arange(0.0, RUN_S, 1.0 / MODE_HZ[scene.mode]) * rate).astype(np.int64)
    noisy = air[at] + PRESSURE_NOISE_PA[scene.mode] * rng.standard_normal(len(at))
    return at, Pressures(way.t_s[at], COUNTS_PA * np.rint(noisy / COUNTS_PA), np.rint(20.0 * device[at]) / 20.0)


def judge(floors: Floors, away_m: Floats, name: str, seed: int) -> FloorRun:
    """The row of a run; `away_m`: (n, k) from each storey."""
    n = np.arange(len(floors.floor))
    ties = away_m <= away_m.min(axis=1, keepdims=True) + 2.0 * LANDING_TIE_M
    wrong = ~ties[n, floors.floor]
    true = away_m.argmin(axis=1)
    return FloorRun(
        name=name, seed=seed, floor_right=float(1.0 - wrong.mean()), strict_right=float((floors.floor == true).mean()),
        longest_wrong_s=longest_s(floors.t_s, wrong), changes=int(np.count_nonzero(np.diff(true))),
    )  # fmt: skip


def longest_s(t_s: Floats, wrong: Bools) -> float:
    """The longest time without a right sample, to the first right one."""
    return max((float(t_s[min(b, len(t_s) - 1)] - t_s[a]) for a, b in spans(wrong).tolist()), default=0.0)


def _summary(rows: Sequence[FloorRun]) -> Row:
    return {
        **named(rows), **means(rows, ("floor_right", "strict_right"), 5),
        "worst_right": round(min(row.floor_right for row in rows), 5),
        "longest_wrong_s": round(max(row.longest_wrong_s for row in rows), 5),
        "late_runs": sum(row.longest_wrong_s > 10.0 for row in rows), "changes": sum(row.changes for row in rows),
    }  # fmt: skip


def _tables(rows: list[Row], request: StudyRequest) -> list[Table]:
    shown = [{k: 100.0 * v if k.endswith("right") else v for k, v in row.items()} for row in rows]
    title = f"Floors by pressure, {request.runs} simulated runs of 20 minutes, weather of 1 hPa/h"
    return [Table(title, shown, COLUMNS)]


STUDY = Study("floors", (FloorRun,), one_run, by_name(_summary), _tables)
