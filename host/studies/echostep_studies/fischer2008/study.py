# SPDX-License-Identifier: MIT
"""The guided returns of [Fischer 2008, 4]: success of dead reckoning alone, the paper's fusion and the particle filter, also with worse beacons.

Simulated. The particle filter has the tracker's kernels, but some rules of its own: see `beacon_cloud` and `guidance`.
In: number of returns, seed. Out: rows `{name, success, low95, high95, runs}`, the paper's Figures 9 and 10, a picture of the sweeps. Return k of
every row is on the same ground: trail, beacons and sources of seed + k.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from echostep_app.output.table import Table
from echostep_simulation.world.beacon_ground import GroundSettings, ground
from echostep_studies.fischer2008.simulator import OURS, PAPER, PDR, Knowledge, guided_return
from echostep_studies.fischer2008.walker import EXACT, Obedience
from echostep_studies.frame.pictures import BLUE, ORANGE, axes_of, save
from echostep_studies.frame.report import Row, by_name
from echostep_studies.frame.study import Study, StudyRequest

LABELS = {
    "place_sd_m": "standard deviation of the beacons' places (m)",
    "axis_sd_deg": "standard deviation of the beacons' orientations (degrees)",
    "reach_m": "beacons' range (m)",
    "spacing_m": "distance between beacons (m)",
    "outliers": "share of ranges with 3 m added",
    "period_s": "time between measurements (s)",
}
BATCH = 50  # returns a task
INEXACT = Obedience(delay_s=0.6, heading_sd_deg=15.0, wrong_turns=0.03)  # assumed
SYSTEMS = {"pdr": PDR, "fischer2008": PAPER, "default": OURS}
NOMINAL = GroundSettings()
UNCERTAIN = replace(NOMINAL, place_sd_m=1.0, axis_sd_deg=15.0, outliers=0.2)
SWEEPS: dict[str, tuple[float, ...]] = {
    "place_sd_m": (0.5, 1.0, 2.0, 3.0),
    "axis_sd_deg": (15.0, 45.0, 90.0),
    "reach_m": (3.0, 5.0, 12.0),
    "spacing_m": (3.0, 8.0, 12.0),
    "outliers": (0.0, 0.2, 0.4),
    "period_s": (1.0, 2.0, 5.0),
}
SAMPLE = 20  # returns of a main row for each return of a sweep or of a rare condition
CLOSER = 4  # the same for the conditions that matter most
COLUMNS = {"name": "", "percent": "% out", "low_percent": "from", "high_percent": "to (95 %)", "runs": "runs"}


@dataclass(frozen=True, slots=True)
class Case:
    """A row: the system, the ground, the time between measurements, the person's obedience.

    `deployed`: the beacons' places are known from the way in alone. `every`: the row has one in `every` returns.
    """

    name: str
    system: int
    settings: GroundSettings = NOMINAL
    period_s: float = 0.2
    obedience: Obedience = EXACT
    deployed: bool = False
    every: int = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class BatchRun:
    """Number of returns of a row, and number of those that reached the exit."""

    name: str
    runs: int
    out: int


def cases() -> Iterator[Case]:
    """All rows of the study."""
    for name, system in SYSTEMS.items():
        yield Case(name, system)
    for name, system in list(SYSTEMS.items())[1:]:
        yield Case(f"{name}/known-to-1m", system, replace(UNCERTAIN, axis_sd_deg=0.0), every=CLOSER)
        yield Case(f"{name}/uncertain", system, UNCERTAIN, every=CLOSER)
        yield Case(f"{name}/people", system, obedience=INEXACT, every=CLOSER)
        yield Case(f"{name}/moved", system, replace(NOMINAL, moved=0.1), every=SAMPLE)
        yield Case(f"{name}/dead", system, replace(NOMINAL, dead=0.2), every=SAMPLE)
    yield Case("default/deployed", OURS, deployed=True, every=SAMPLE)
    yield Case("default/deployed-no-iron", OURS, replace(NOMINAL, sources=0), deployed=True, every=SAMPLE)
    for parameter, values in SWEEPS.items():
        for value in values:
            for name, system in list(SYSTEMS.items())[1:]:
                label = f"sweep/{parameter}={value:g}/{name}"
                if parameter == "period_s":
                    yield Case(label, system, period_s=value, every=SAMPLE)
                else:
                    changed: dict[str, Any] = {parameter: value}
                    yield Case(label, system, replace(NOMINAL, **changed), every=SAMPLE)


def fischer2008_study(runs: int, seed: int) -> Study[BatchRun, Row]:
    """The study of `runs` returns from `seed` on. Its runs are batches of returns: the seed of a run is the batch's index."""
    return Study(
        "fischer2008",
        (BatchRun,),
        partial(one_batch, first=seed, runs=runs),
        by_name(_summary),
        _tables,
        draw,
        seeds=range(math.ceil(runs / BATCH)),
        parquet="summary",
    )


def _tables(rows: list[Row], request: StudyRequest) -> list[Table]:
    """Success rates with 95 % intervals, in percent."""
    printed = [
        r | {"percent": 100 * r["success"], "low_percent": 100 * r["low95"], "high_percent": 100 * r["high95"]}
        for r in rows
    ]
    return [Table(f"People guided back to the exit in time, {request.runs} simulated returns", printed, COLUMNS)]


def one_batch(batch: int, first: int, runs: int) -> list[BatchRun]:
    """The returns [batch * BATCH, ...) of all rows: their number, and the number of those that reached the exit."""
    returns = range(batch * BATCH, min((batch + 1) * BATCH, runs))
    rows = []
    for case in cases():
        chosen = [k for k in returns if k % case.every == 0]
        if chosen:
            out = sum(one_return(case, first + k) for k in chosen)
            rows.append(BatchRun(name=case.name, runs=len(chosen), out=out))
    return rows


def one_return(case: Case, seed: int) -> bool:
    """Whether one person reaches the exit in time."""
    world = ground(case.settings, np.random.default_rng([seed, 1]))
    knowledge = Knowledge(case.settings.place_sd_m, math.radians(case.settings.axis_sd_deg), case.deployed)
    return guided_return(world, case.system, seed, case.period_s, case.obedience, knowledge).arrived


def _summary(batches: list[BatchRun]) -> Row:
    """The batches of one row added up: the success rate and its 95 % interval."""
    runs, out = sum(b.runs for b in batches), sum(b.out for b in batches)
    low, high = wilson95(out, runs)
    return {"name": batches[0].name, "success": out / runs, "low95": low, "high95": high, "runs": runs}


def wilson95(successes: int, runs: int) -> tuple[float, float]:
    """Interval that holds the true rate with 95 % confidence [Wilson 1927]."""
    z = 1.959963984540054
    share, part = successes / runs, z * z / runs
    middle = (share + part / 2) / (1 + part)
    half = z * math.sqrt(share * (1 - share) / runs + part / (4 * runs)) / (1 + part)
    return max(middle - half, 0.0), min(middle + half, 1.0)


def draw(out: Path, _seed: int, rows: list[Row]) -> None:
    """Success with its 95 % interval over each parameter that was varied, for the paper's fusion and the particle filter."""
    columns, by_label = 3, {row["name"]: row for row in rows}
    figure, axes = axes_of(-(-len(SWEEPS) // columns), columns, (4.2 * columns, 3.2 * -(-len(SWEEPS) // columns)))
    flat = [ax for line in axes for ax in line]
    for ax, (parameter, values) in zip(flat, SWEEPS.items(), strict=False):
        for name, colour in (("fischer2008", ORANGE), ("default", BLUE)):
            names = {getattr(NOMINAL, parameter, 0.2): name} | {v: f"sweep/{parameter}={v:g}/{name}" for v in values}
            points = [(v, by_label[label]) for v, label in sorted(names.items()) if label in by_label]
            x = [v for v, _ in points]
            y = np.array([100.0 * row["success"] for _, row in points])
            low = np.maximum(y - [100.0 * row["low95"] for _, row in points], 0.0)
            high = np.maximum([100.0 * row["high95"] for _, row in points] - y, 0.0)
            ax.errorbar(x, y, [low, high], color=colour, marker="o", ms=4, capsize=3, lw=1.2, label=name)
        ax.set_xlabel(LABELS[parameter], fontsize=8)
        ax.set_ylim(-3.0, 103.0)
        ax.tick_params(labelsize=7)
    flat[0].set_ylabel("exit reached (%)", fontsize=8)
    flat[0].legend(fontsize=8)
    figure.suptitle("Simulated: guided returns as beacons get worse, 95 % intervals")
    save(figure, out / "sweeps.png")
