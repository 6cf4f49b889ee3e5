# SPDX-License-Identifier: MIT
"""What a set of sweeps shows: shares of right, missing and wrong ranges, the log-score of the echo density, and places found.

In: a `SweepSet`. Out: rows. Owns the shares of the real sweeps that the simulated ones are compared with.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from echostep.arrays import Floats
from echostep.echoes.likelihood import EchoSettings, echo_model
from echostep.elementary import wrap
from echostep.walls.echo_sources import Walls
from echostep_studies.echoes.known_pings import KnownPings, known_pings, log_densities
from echostep_studies.echoes.placing import grid_table, place
from echostep_studies.echoes.sweeps import Sweep, SweepSet

RIGHT_M = 0.1  # of a range from the nearest wall's
NEAR_M, WIDE_DEG = 1.5, 60.0  # walls of the table by angle
# Right, none and too long in % of the real sweeps [reference: 92 sweeps of eight student groups], by degrees off the nearest wall's normal
REAL_SHARES = {
    (0, 5): (87, 3, 5), (20, 25): (86, 2, 11), (30, 35): (86, 3, 9), (35, 40): (74, 8, 14), (40, 45): (60, 12, 22), (45, 50): (38, 19, 32),
    (50, 55): (17, 28, 43), (55, 60): (4, 38, 45),
}  # fmt: skip
LIMITS_KNOWN = EchoSettings(maximum_m=2.0, minimum_m=0.03, sd_m=0.015)  # of the real sweeps' ranger


@dataclass(frozen=True, slots=True, kw_only=True)
class ShareRow:
    """Shares (%) of pings by the angle between axis and nearest wall's normal, beside those of the real sweeps."""

    name: str
    pings: int
    right: float
    none: float
    long: float
    real: str


@dataclass(frozen=True, slots=True, kw_only=True)
class SweepRow:
    """By one model: mean log-density of a ping, and share (%) of sweeps whose place was found within 10 cm."""

    name: str
    pings: int
    log_p: float
    all: float
    few: float
    known: float


def share_rows(data: SweepSet) -> Iterator[ShareRow]:
    """Walls below 1.5 m, by angle."""
    away, off = (
        np.concatenate(columns) for columns in zip(*(_nearest_walls(data.walls, s) for s in data.sweeps), strict=True)
    )
    range_m = np.nan_to_num(np.concatenate([s.range_m for s in data.sweeps]))
    for (low, high), real in REAL_SHARES.items():
        which = (away < NEAR_M) & (off >= low) & (off < high)
        z, d = range_m[which], away[which]
        shares = [np.abs(z - d) < RIGHT_M, z <= 0.0, z >= d + RIGHT_M]
        right, none, long = (round(100.0 * float(share.mean()), 1) if len(z) else 0.0 for share in shares)
        yield ShareRow(
            name=f"{low}-{high} degrees", pings=len(z), right=right, none=none, long=long, real="/".join(map(str, real))
        )


def _nearest_walls(walls: Floats, sweep: Sweep) -> tuple[Floats, Floats]:
    """For each ping (n,) the distance to the nearest wall whose normal is within WIDE_DEG of the axis (infinite: none), and that angle in degrees."""
    start, along = walls[:, :2], walls[:, 2:] - walls[:, :2]
    from_start = np.array([sweep.x_m, sweep.y_m]) - start
    share = (from_start * along).sum(1) / np.maximum((along**2).sum(1), np.finfo(float).tiny)
    foot = share[:, None] * along - from_start
    off = np.abs(wrap(np.arctan2(foot[:, 1], foot[:, 0]) - sweep.axis_rad[:, None]))  # (n, walls)
    faces = (share >= 0.0) & (share <= 1.0) & (off <= math.radians(WIDE_DEG))
    away = np.where(faces, np.hypot(*foot.T), np.inf)
    first, rows = np.argmin(away, axis=1), np.arange(len(away))
    return away[rows, first], np.degrees(off[rows, first])


def sweep_rows(data: SweepSet) -> Iterator[SweepRow]:
    """By the density as it is, and with the real ranger's limits."""
    yield _row("settings of an SRF02", data, EchoSettings())
    yield _row("limits known", data, LIMITS_KNOWN)


def _row(name: str, data: SweepSet, settings: EchoSettings) -> SweepRow:
    table, model = grid_table(data.walls), echo_model(settings)
    hits = [place(sweep, table, model) for sweep in data.sweeps]
    every, few, known = (100.0 * np.mean(np.array(hits, float), axis=0)).tolist()
    log_p = log_densities(_known(data), model)
    return SweepRow(
        name=name,
        pings=len(log_p),
        log_p=round(float(log_p.mean()), 3),
        all=round(every),
        few=round(few),
        known=round(known),
    )


def _known(data: SweepSet) -> KnownPings:
    """All pings of the sweeps at their true poses."""
    x, y = (np.concatenate([np.full(len(s.range_m), at) for s, at in zip(data.sweeps, places, strict=True)]) for places in (
        [s.x_m for s in data.sweeps], [s.y_m for s in data.sweeps]
    ))  # fmt: skip
    axis, range_m = (np.concatenate([getattr(s, name) for s in data.sweeps]) for name in ("axis_rad", "range_m"))
    return known_pings(Walls(data.walls), x, y, axis, np.nan_to_num(range_m))
