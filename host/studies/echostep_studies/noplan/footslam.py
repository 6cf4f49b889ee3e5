# SPDX-License-Identifier: MIT
"""FootSLAM: particles that each keep a map of the transitions between hexagons, from the path alone [Angermann and Robertson 2012].

In: nodes of a walk. Out: the path of the best particle. Owns the constants of the paper. A particle's map is its own history, so the counts at a
hexagon are read from it: resampling copies rows.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.jit import inline_part, kernel
from echostep_app.mapping.graph.nodes import Nodes

RADIUS_M = 0.5  # of a hexagon [section III]
PRIOR = 0.8  # count of every edge before the first transition [section IV]
HALF, EDGES = 1 << 14, 25  # hexagons to either side of the origin; numbers of an edge
PARTICLES = 1000
PIECE_M = 0.2  # of the path between two looks at the hexagon, so that none is jumped over


def footslam(nodes: Nodes, rng: np.random.Generator) -> Floats:
    """Path (n, 2) of the heaviest particle at the end of the walk."""
    steps, count = np.diff(nodes.pose[:, :2], axis=0), len(nodes)
    path = np.zeros((PARTICLES, count, 2))
    turned, weight = np.zeros(PARTICLES), np.zeros(PARTICLES)
    at = np.repeat(nodes.pose[:1, :2], PARTICLES, axis=0)
    path[:, 0] = at
    length = np.hypot(*steps.T)
    most = 2 * int(np.ceil(length / PIECE_M).clip(1).sum()) + 2
    history, filled = np.zeros((PARTICLES, most), np.int64), np.zeros(PARTICLES, np.int64)
    for k in range(count - 1):
        turned += rng.normal(0.0, nodes.turn_sd_rad[k], PARTICLES)
        c, s = np.cos(turned), np.sin(turned)
        move = np.column_stack([c * steps[k, 0] - s * steps[k, 1], s * steps[k, 0] + c * steps[k, 1]])
        move += rng.normal(0.0, nodes.sd_m[k], (PARTICLES, 2))
        _walk(at, move, max(1, math.ceil(length[k] / PIECE_M)), history, filled, weight)
        path[:, k + 1] = at
        weight -= weight.max()
        share = np.exp(weight) / np.exp(weight).sum()
        if 1.0 / (share**2).sum() < 0.5 * PARTICLES and k + 2 < count:
            chosen = np.searchsorted(np.cumsum(share), (np.arange(PARTICLES) + rng.random()) / PARTICLES)
            chosen = np.minimum(chosen, PARTICLES - 1)
            used, until = int(filled[chosen].max()), k + 2
            history[:, :used] = history[chosen, :used]
            path[:, :until] = path[chosen, :until]
            at, turned, filled, weight = at[chosen], turned[chosen], filled[chosen], np.zeros(PARTICLES)
    best: Floats = path[int(np.argmax(weight))]
    return best


@kernel
def _walk(at: Floats, move: Floats, pieces: int, history: Ints, filled: Ints, weight: Floats) -> None:
    """Move every particle; each change of hexagon is weighed by how often it was made there before, and becomes part of its map."""
    for p in range(len(at)):
        q, r = hexagon(at[p, 0], at[p, 1])
        for _ in range(pieces):
            at[p, 0] += move[p, 0] / pieces
            at[p, 1] += move[p, 1] / pieces
            q1, r1 = hexagon(at[p, 0], at[p, 1])
            if q1 == q and r1 == r:
                continue
            edge = (q1 - q + 2) * 5 + (r1 - r + 2)
            same, here = 0, 0
            key = _key(q, r, edge)
            for k in range(filled[p]):
                here += history[p, k] // EDGES == key // EDGES
                same += history[p, k] == key
            weight[p] += math.log((same + PRIOR) / (here + 6.0 * PRIOR))
            if filled[p] + 1 < history.shape[1]:
                # A way through an edge counts in both directions: people come back as they went.
                history[p, filled[p]] = key
                history[p, filled[p] + 1] = _key(q1, r1, (q - q1 + 2) * 5 + (r - r1 + 2))
                filled[p] += 2
            q, r = q1, r1


@inline_part
def _key(q: int, r: int, edge: int) -> int:
    """A hexagon and one of its edges as one number."""
    return ((q + HALF) * 2 * HALF + r + HALF) * EDGES + edge


@kernel
def hexagon(x_m: float, y_m: float) -> tuple[int, int]:
    """Axial coordinates of the hexagon that holds a place."""
    q = (math.sqrt(3.0) / 3.0 * x_m - y_m / 3.0) / RADIUS_M
    r = (2.0 / 3.0 * y_m) / RADIUS_M
    s = -q - r
    rq, rr, rs = round(q), round(r), round(s)
    dq, dr, ds = abs(rq - q), abs(rr - r), abs(rs - s)
    if dq > dr and dq > ds:
        rq = -rr - rs
    elif dr > ds:
        rr = -rq - rs
    return int(rq), int(rr)
