# SPDX-License-Identifier: MIT
"""Echoes of simulated rangers, effect by effect [Girard 2011, 2.6, Figures 1-5], and how well the tracker's likelihood predicts them.

In: a seed, or a folder of sweeps. Out: rows of each effect, shares and places of sweeps, and on demand the settings that explain simulated pings
best. The simulation and the likelihood share nothing but the plan: one computes levels of sound from mirror images, the other has a handful of
numbers.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from msgspec import UNSET, UnsetType

from echostep.echoes.likelihood import EchoSettings, echo_model
from echostep.walls.echo_sources import Walls
from echostep_app.output.table import Table
from echostep_simulation.world.acoustics import SRF02, directivity_db
from echostep_studies.echoes.effects import Effect, pipe_range_m, simulated_effects
from echostep_studies.echoes.likelihood import SettingRow, fitted, log_p
from echostep_studies.echoes.sweep_rows import ShareRow, SweepRow, share_rows, sweep_rows
from echostep_studies.echoes.sweeps import SweepSet, read_sweeps, simulated_sweeps
from echostep_studies.frame.report import as_dicts
from echostep_studies.frame.study import Study, StudyRequest
from echostep_studies.simulation.marker_walk import lay_markers, walk_markers
from echostep_studies.simulation.sites import otb


def _half_heard(effect: Effect) -> str:
    share = np.array([np.mean(~np.isnan(h.range_m)) for h in effect.heard])
    lost = effect.heard[int(np.argmax(share < 0.5))].place
    return f"half of the echoes are lost at {lost:.0f} degrees"


def _post_heard(effect: Effect) -> str:
    near = [h.place for h in effect.heard if np.nanmedian(h.range_m) < h.place + 0.3]
    return f"a thin post is heard up to {max(near, default=0.0):.1f} m, the wall behind it at 3 m"


def _detour(effect: Effect) -> str:
    medians = [(h.place, float(np.nanmedian(h.range_m))) for h in effect.heard if np.mean(~np.isnan(h.range_m)) > 0.5]
    far = [(angle, z) for angle, z in medians if z > 1.2]
    if not far:
        return "no echo by two walls"
    return f"beyond {far[0][0]:.0f} degrees {far[0][1]:.1f} m are reported, the wall is at 1.0 m"


def _limits(effect: Effect) -> str:
    received = [h for h in effect.heard if np.mean(~np.isnan(h.range_m)) > 0.5]
    return f"between {np.nanmin(received[0].range_m):.2f} m and {received[-1].place:.2f} m"


def _signature(effect: Effect) -> str:
    medians = np.array([np.nanmedian(h.range_m) for h in effect.heard])
    return f"an open door lengthens the range by {np.max(medians[medians < 2.5]) - np.min(medians):.2f} m before its frame is passed"


FINDINGS: dict[str, Callable[[Effect], str]] = {
    "incidence": _half_heard, "near and far": _post_heard, "oblique": _detour, "limits": _limits, "door frames": _signature,
}  # fmt: skip


UNIFORM = -math.log(6.0)  # log-density of a range of which nothing is known
COLUMNS = {
    "name": "effect", "pings": "pings", "heard": "heard", "log_p": "mean log p", "uniform": "of a uniform", "finding": "finding",
}  # fmt: skip
SHARE_COLUMNS = {
    "name": "off the wall's normal", "pings": "pings", "right": "right, %", "none": "none, %", "long": "too long, %", "real": "real sweeps"
}  # fmt: skip
SWEEP_COLUMNS = {
    "name": "model", "pings": "pings", "log_p": "mean log p", "all": "found, %", "few": "by 12 pings, %", "known": "heading within 20 deg, %"
}  # fmt: skip
SETTINGS_COLUMNS = {"name": "setting", "set": "as set", "fitted": "fitted"}


@dataclass(frozen=True, slots=True, kw_only=True)
class EchoRow:
    """Pings of one effect: their number, the share with an echo, their mean log-likelihood, and a sentence about the effect."""

    name: str
    pings: int | UnsetType = UNSET
    heard: float | UnsetType = UNSET
    log_p: float | UnsetType = UNSET
    uniform: float | UnsetType = UNSET
    finding: str


EchoesRow = EchoRow | ShareRow | SweepRow | SettingRow


def echoes_study(*, fit: bool, sweeps: Path | None = None) -> Study[EchoesRow, EchoesRow]:
    """The study, which has one run; `fit`: also fit the likelihood's settings to simulated pings, which takes minutes.

    `sweeps`: a folder of measured sweeps, which alone are judged.
    """
    measured = None if sweeps is None else read_sweeps(sweeps)
    return Study(
        "echoes",
        (EchoRow, ShareRow, SweepRow, SettingRow),
        partial(one_run, fit=fit) if measured is None else partial(measured_run, measured),
        lambda rows: rows,
        partial(_tables, is_real=measured is not None),
        parquet=None,
    )


def one_run(seed: int, *, fit: bool) -> list[EchoesRow]:
    """Rows of the effects, of the angular response, of the schedules, and of the fitted settings."""
    rows = [*(_row(effect) for effect in simulated_effects(seed)), _cone(), *_schedules(seed)]
    sweeps = simulated_sweeps(seed)
    rows_of_sweeps: list[EchoesRow] = [*share_rows(sweeps), *sweep_rows(sweeps)]
    settings: list[EchoesRow] = [*fitted(seed)] if fit else []
    return [*rows, *rows_of_sweeps, *settings]


def measured_run(sweeps: SweepSet, _seed: int) -> list[EchoesRow]:
    """Rows of measured sweeps."""
    return [*share_rows(sweeps), *sweep_rows(sweeps)]


def _tables(rows: list[EchoesRow], _request: StudyRequest, *, is_real: bool) -> list[Table]:
    origin = "Measured" if is_real else "Simulated"
    kinds: tuple[tuple[type[EchoesRow], str, dict[str, str]], ...] = (
        (EchoRow, "Simulated pings, and how the likelihood expects them", COLUMNS),
        (
            ShareRow,
            f"{origin} sweeps: pings by the angle off the nearest wall, beside right/none/too long of real ones",
            SHARE_COLUMNS,
        ),
        (SweepRow, f"{origin} sweeps: the density, and places found within 10 cm from one sweep", SWEEP_COLUMNS),
        (SettingRow, "Echo settings", SETTINGS_COLUMNS),
    )
    tables = [
        Table(title, as_dicts(row for row in rows if isinstance(row, kind)), columns) for kind, title, columns in kinds
    ]
    return [table for table in tables if table.rows]


def _row(effect: Effect) -> EchoRow:
    plan, model = Walls(effect.plan), echo_model(EchoSettings())
    explained = np.concatenate([log_p(plan, h.pose, h.range_m, model) for h in effect.heard])
    ranges = np.concatenate([h.range_m for h in effect.heard])
    return EchoRow(
        name=effect.name,
        pings=len(ranges),
        heard=round(float(np.mean(~np.isnan(ranges))), 3),
        log_p=round(float(explained.mean()), 3),
        uniform=round(UNIFORM, 3),
        finding=FINDINGS[effect.name](effect),
    )


def _cone() -> EchoRow:
    angles = np.radians(np.arange(0.0, 50.0, 0.1))
    level = np.array([directivity_db(float(a), SRF02.size) for a in angles])
    six = math.degrees(float(angles[int(np.argmax(level < -6.0))]))
    finding = f"-6 dB at {six:.1f} degrees; the pipe is heard to {pipe_range_m(0.0):.1f} m ahead, {pipe_range_m(math.radians(25.0)):.1f} m at 25"
    return EchoRow(name="angular response", finding=finding)


def _schedules(seed: int) -> list[EchoRow]:
    """Pings answered by the other ranger's sound, in the paper's building, by schedule."""
    site, rows = otb(), []
    for name, offset_s in (("both at once", 0.0), ("concurrent", 0.033), ("sequential", 0.07)):
        pings = walk_markers(lay_markers(site.route), site.built, seed, offset_s=offset_s).pings
        share = float(np.mean(pings.cross))
        finding = f"{100 * share:.1f} % are the other ranger's sound; {len(pings.t_s) / pings.t_s[-1]:.0f} pings/s"
        rows.append(EchoRow(name=f"schedule: {name}", pings=len(pings.t_s), finding=finding))
    return rows
