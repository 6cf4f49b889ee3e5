# SPDX-License-Identifier: MIT
"""The place that one sweep tells, by maximum likelihood on a grid of places and headings.

In: a sweep, walls, an echo model. Out: error (m) with the heading unknown or roughly known. Owns nothing.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.echoes.likelihood import EchoModel
from echostep.elementary import wrap
from echostep.walls.echo_sources import Walls
from echostep_studies.echoes.known_pings import KnownPings, known_pings, log_densities
from echostep_studies.echoes.sweeps import Sweep

GRID_M, HEADINGS = 0.04, 120  # 4 cm, 3 degrees: those of the figures that this is compared with
KNOWN_RAD = math.radians(20.0)
FEW = 12  # pings, evenly chosen
HIT_M = 0.1


class Placing(NamedTuple):
    """Whether the place was found within HIT_M: by all pings, by FEW of them, and by all with the heading known within 20 degrees."""

    all: bool
    few: bool
    known: bool


class GridTable(NamedTuple):
    """Places (n,) of a grid, and sources before each (n, HEADINGS, ...) as in `KnownPings`."""

    x_m: Floats
    y_m: Floats
    sources: KnownPings


def grid_table(walls: Floats) -> GridTable:
    """The grid over the walls, and what could answer at each place and along each axis."""
    low, high = walls.reshape(-1, 2).min(0), walls.reshape(-1, 2).max(0)
    x, y = (
        column.ravel()
        for column in np.meshgrid(*(np.arange(a + 0.5 * GRID_M, b, GRID_M) for a, b in zip(low, high, strict=True)))
    )
    axis = np.arange(HEADINGS) * (2.0 * math.pi / HEADINGS)
    count = len(x)
    sources = known_pings(
        Walls(walls), np.repeat(x, HEADINGS), np.repeat(y, HEADINGS), np.tile(axis, count), np.zeros(count * HEADINGS)
    )
    return GridTable(x, y, sources)


def place(sweep: Sweep, table: GridTable, model: EchoModel) -> Placing:
    """The errors of the likeliest places."""
    step = 2.0 * math.pi / HEADINGS
    offset = np.rint(sweep.bearing_rad / step).astype(np.int64)
    every = np.arange(len(offset))
    few = every[:: max(len(every) // FEW, 1)][:FEW]
    ranges_m, which_range = np.unique(
        np.round(np.nan_to_num(sweep.range_m), 2), return_inverse=True
    )  # their errors are more
    of_range = np.array([_by_axis(z, table, model) for z in ranges_m.tolist()])
    near = np.abs([wrap(h * step - sweep.heading_rad) for h in range(HEADINGS)]) <= KNOWN_RAD
    totals = [_total(of_range, which_range, offset, which) for which in (every, few)]
    return Placing(
        _hits(sweep, table, totals[0]),
        _hits(sweep, table, totals[1]),
        _hits(sweep, table, np.where(near, totals[0], -np.inf)),
    )


def _by_axis(range_m: float, table: GridTable, model: EchoModel) -> Floats:
    """Log-density (places, HEADINGS) of one range along every axis."""
    pings = table.sources._replace(range_m=np.full(len(table.sources.listed), range_m))
    return log_densities(pings, model).reshape(-1, HEADINGS)


def _total(of_range: Floats, which_range: Ints, offset: Ints, which: Ints) -> Floats:
    """Log-likelihood (places, HEADINGS) of the chosen pings."""
    total = np.zeros(of_range.shape[1:])
    for k in which.tolist():
        total += np.roll(of_range[which_range[k]], -int(offset[k]), axis=1)
    return total


def _hits(sweep: Sweep, table: GridTable, total: Floats) -> bool:
    cell = int(np.argmax(total)) // HEADINGS
    return math.hypot(table.x_m[cell] - sweep.x_m, table.y_m[cell] - sweep.y_m) <= HIT_M
