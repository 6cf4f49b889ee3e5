# SPDX-License-Identifier: MIT
"""How flat the walls of a building are: shelves, niches and machines stand before them, so what seems one straight piece is several.

In: nodes and fragments. Out: the fragments with standard deviations of such walls, and the `Directions` by them. Owns the reliefs that are
tried. A piece's residuals are in its own standard deviations already; echoes come from the parts that stand out, so only other
pieces show the rest. The relief is the one by which the directions of all fragments are most probable.
"""

from __future__ import annotations

import math

import numpy as np

from echostep_app.mapping.graph.directions import LEAST_EVIDENCE, Directions, find_directions
from echostep_app.mapping.graph.fragments import SLOPE, Fragments
from echostep_app.mapping.graph.nodes import Nodes

# Standard deviation of the surface along a piece, beyond its residuals. In three real buildings, by laser: 0.01 to 0.10 m in all
RELIEFS_M = (0.01, 0.02, 0.03, 0.045, 0.065)


def find_relief(nodes: Nodes, fragments: Fragments) -> tuple[Fragments, Directions]:
    """The walls are flat unless another relief has the odds that two directions of the building need."""
    flat = best = fragments, find_directions(nodes, fragments)
    for relief_m in RELIEFS_M:
        tried = with_relief(fragments, relief_m)
        directions = find_directions(nodes, tried)
        if directions.evidence > max(best[1].evidence, flat[1].evidence + LEAST_EVIDENCE):
            best = tried, directions
    return best


def with_relief(fragments: Fragments, relief_m: float) -> Fragments:
    """The fragments of a surface with this standard deviation: it shifts a piece, and turns it the more the shorter it is."""
    turned_rad = SLOPE * relief_m / np.maximum(fragments.half_m, 0.5 * relief_m)
    return fragments._replace(
        sd_m=np.hypot(fragments.sd_m, relief_m), sd_rad=np.minimum(np.hypot(fragments.sd_rad, turned_rad), math.pi)
    )
