# SPDX-License-Identifier: MIT
"""Log-likelihood of simulated pings by the tracker's echo model, and the settings that maximise it.

In: poses and ranges. Out: log-densities; fitted settings. Owns nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from echostep.arrays import Floats
from echostep.echoes.likelihood import EchoModel, EchoSettings, echo_model
from echostep.walls.echo_sources import Walls
from echostep_app.output.table import console
from echostep_studies.echoes.known_pings import KnownPings, known_pings, log_densities
from echostep_studies.simulation.marker_walk import lay_markers, walk_markers
from echostep_studies.simulation.sites import angled, otb, thousand

FITTED = ("sd_m", "slant_m", "rim_db", "soft_db", "edge_db", "corner_db", "stray")


def log_p(plan: Walls, pose: tuple[float, float, float], ranges_m: Floats, model: EchoModel) -> Floats:
    """Log-likelihood of ranges (n,) of the left ranger at a pose."""
    x, y, heading = (np.full(len(ranges_m), value) for value in pose)
    return log_densities(known_pings(plan, x, y, heading + 0.5 * math.pi, ranges_m), model, False)


@dataclass(frozen=True, slots=True, kw_only=True)
class SettingRow:
    """A setting as it is, and as simulated pings would choose it."""

    name: str
    set: float
    fitted: float


def fitted(seed: int) -> list[SettingRow]:
    """The settings that explain pings at true poses best, beside those in use: maximum likelihood over three simulated buildings."""
    from scipy.optimize import minimize

    seen = _at_true_poses(seed)
    start = np.log([getattr(EchoSettings(), name) for name in FITTED])

    def cost(x: Floats) -> float:
        chosen = dict(zip(FITTED, np.exp(x).tolist(), strict=True))
        if chosen["stray"] >= 0.95:
            return math.inf
        model = echo_model(replace(EchoSettings(), **chosen))
        return -float(np.concatenate([log_densities(pings, model, False) for pings in seen]).mean())

    best = minimize(cost, start, method="Nelder-Mead", options={"maxfev": 400, "xatol": 0.02, "fatol": 1e-4})
    console.print(
        f"fit on {sum(len(pings.range_m) for pings in seen)} simulated pings: mean log p {-cost(start):.3f} as set, {-best.fun:.3f} fitted"
    )
    return [
        SettingRow(name=f"fit: {name}", set=getattr(EchoSettings(), name), fitted=round(value, 4))
        for name, value in zip(FITTED, np.exp(best.x).tolist(), strict=True)
    ]


def _at_true_poses(seed: int) -> list[KnownPings]:
    seen = []
    for site in (otb(), angled(), thousand()):
        pings = walk_markers(lay_markers(site.route), site.built, 10_000 + seed).pings
        x, y, axis = pings.pose.T
        seen.append(known_pings(Walls(site.plan), x, y, axis, pings.range_m))
    return seen
