# SPDX-License-Identifier: MIT
"""Fragments that continue each other, as one piece of wall.

In: a solved graph. Out: `Pieces`. Owns the gap. A fragment ends after 2 m of path wherever it is: such a cut is nothing that a later passage could
find again. A door is.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.mapping.graph import Graph
from echostep.mapping.matching import Pieces

GAP_M = 0.35  # along the wall, up to which it goes on: half of a door; cuts leave up to three pings, 0.25 m


def pieces(graph: Graph, which: Ints) -> Pieces:
    """Fragments `which` (k,) in the map, one by one."""
    f = graph.fragments
    centre, normal = graph.places()
    range_m = np.hypot(*(centre[which] - graph.pose[f.node[which], :2]).T)
    return Pieces(centre[which, 0], centre[which, 1], normal[which], f.half_m[which], f.sd_rad[which], range_m)


def stretches(graph: Graph, which: Ints) -> Pieces:
    """The same fragments; those of one wall with less than GAP_M between them are one piece."""
    single, of = pieces(graph, which), graph.walls.of[which]
    rows = [_row(single, np.array([k])) for k in np.flatnonzero(of < 0)]
    for wall in np.unique(of[of >= 0]).tolist():
        own = np.flatnonzero(of == wall)
        rows += [_row(single, part) for part in _parts(single, own, float(graph.walls.normal_rad[wall]))]
    return Pieces(*np.array(rows).reshape(-1, 6).T)


def _parts(single: Pieces, own: Ints, normal_rad: float) -> list[Ints]:
    """The pieces `own` (k,) of one wall in groups without a gap."""
    c, s = math.cos(normal_rad), math.sin(normal_rad)
    along = c * single.y_m[own] - s * single.x_m[own]
    order = np.argsort(along - single.half_m[own], kind="stable")
    low, high = (along - single.half_m[own])[order], (along + single.half_m[own])[order]
    begins = np.flatnonzero(low[1:] > np.maximum.accumulate(high)[:-1] + GAP_M) + 1
    return [own[part] for part in np.split(order, begins)]


def _row(single: Pieces, part: Ints) -> Floats:
    """One piece from all of `part` (k,): at their mean across the wall, from the first end to the last along it, free as far as from the nearest."""
    if len(part) == 1:
        return np.array([column[part[0]] for column in single])
    weight = single.half_m[part] / single.sd_rad[part] ** 2
    weight /= weight.sum()
    normal = single.normal_rad[part]
    mean = normal[0] + float(weight @ ((normal - normal[0] + math.pi) % (2.0 * math.pi) - math.pi))
    c, s = math.cos(mean), math.sin(mean)
    across, along = (c * single.x_m[part] + s * single.y_m[part], c * single.y_m[part] - s * single.x_m[part])
    low, high = float((along - single.half_m[part]).min()), float((along + single.half_m[part]).max())
    rho, middle = float(weight @ across), 0.5 * (low + high)
    sd_rad = 1.0 / math.sqrt(float((single.sd_rad[part] ** -2.0).sum()))
    x, y = c * rho - s * middle, s * rho + c * middle
    return np.array([x, y, mean, 0.5 * (high - low), sd_rad, float(single.range_m[part].min())])
