# SPDX-License-Identifier: MIT
"""The path as the most probable one: a graph of poses and walls, solved by Gauss-Newton.

In: nodes, fragments, walls, closures. Out: poses, walls, covariances. Owns the unknowns: three for each node (x, y, heading), two for each wall
(direction of its normal, distance from the origin).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import SuperLU, splu

from echostep.arrays import Floats, Ints
from echostep.elementary import wrap
from echostep_app.mapping.graph.directions import ALIGNED, DIRECTION_SD_RAD, RIGHT_RAD
from echostep_app.mapping.graph.fragments import Fragments
from echostep_app.mapping.graph.levels import WalkLevels
from echostep_app.mapping.graph.nodes import Nodes, rotated

ROUNDS = 4  # of Gauss-Newton; the graph is nearly linear
ONE_WALL = 0.8  # share of fragments that belong to the wall they lie on, at first; others, as furniture before it, lie anywhere within
APART_M, TURNED_RAD = 0.5, math.radians(20.0)  # this distance and turn, assumed
START_SD_M, START_SD_RAD = 0.001, 0.0005  # the first node is the origin
# Its heading's, where the building's directions hold the map: until a wall is detected it is not known against them
FREE_SD_RAD = math.radians(30.0)


@dataclass(frozen=True, slots=True)
class FittedWalls:
    """Straight walls: `normal_rad` (w,) from the path to the wall, `rho_m` (w,): normal times any of its points; `of` (f,): wall of each
    fragment, -1: none.
    """

    normal_rad: Floats
    rho_m: Floats
    of: Ints


@dataclass(frozen=True, slots=True)
class Closure:
    """Node `new` is where it was believed relative to node `old`, corrected by `shift` (3,): x, y (m), heading; `information` (3, 3) of it.

    `between` (3,): pose of `new` less pose of `old` (map axes) by the closure. `log_odds` of being right.
    """

    old: int
    new: int
    between: Floats
    information: Floats
    log_odds: float


@dataclass
class Graph:
    """`pose` (n, 3), `walls`: the newest solution. `base_rad`: one of the two directions of the building; None if it has none.

    `levels`: None if all nodes are on one level.
    """

    nodes: Nodes
    fragments: Fragments
    pose: Floats
    walls: FittedWalls
    closures: list[Closure] = field(default_factory=list)
    base_rad: float | None = None
    factor: SuperLU | None = None
    levels: WalkLevels | None = None

    def solve(self, rounds: int = ROUNDS) -> None:
        """Gauss-Newton from the present poses."""
        for _ in range(rounds):
            jacobian, residual = self.linearized()
            normal = (jacobian.T @ jacobian + 1e-9 * sp.identity(jacobian.shape[1])).tocsc()
            self.factor = None  # free its memory before the next one is made
            self.factor = splu(
                normal, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
            )
            step = -self.factor.solve(jacobian.T @ residual)
            count = 3 * len(self.nodes)
            self.pose = self.pose + step[:count].reshape(-1, 3)
            w = step[count:].reshape(-1, 2)
            self.walls = FittedWalls(self.walls.normal_rad + w[:, 0], self.walls.rho_m + w[:, 1], self.walls.of)
            if float(np.abs(step).max(initial=0.0)) < 1e-3:
                break

    def linearized(self) -> tuple[sp.csr_matrix, Floats]:
        """Residuals (r,) at the present poses and walls, and their derivatives (r, 3 n + 2 w) at fixed weights."""
        rows = _Rows()
        self._add_path(rows)
        self._add_walls(rows)
        self._add_directions(rows)
        self._add_closures(rows)
        return rows.matrix(3 * len(self.nodes) + 2 * len(self.walls.rho_m))

    def covariance(self, new: int, old: int) -> Floats:
        """Covariance (3, 3) of the pose of `new` less the pose of `old`, as factored last."""
        assert self.factor is not None
        n = self.factor.shape[0]
        right = np.zeros((n, 3))
        for k in range(3):
            right[3 * new + k, k] += 1.0
            right[3 * old + k, k] -= 1.0
        columns = self.factor.solve(right)
        covariance: Floats = columns[3 * new : 3 * new + 3] - columns[3 * old : 3 * old + 3]
        return 0.5 * (covariance + covariance.T)

    def level_of(self, node: Ints) -> Ints:
        """The level of each of these nodes (k,)."""
        return np.zeros(len(node), np.int64) if self.levels is None else self.levels.of[node]

    @property
    def path(self) -> Floats:
        """The corrected path (n, 2)."""
        return self.pose[:, :2]

    def places(self) -> tuple[Floats, Floats]:
        """Centres (f, 2) and normals (f,) of all fragments, in the map."""
        return placed(self.fragments, self.pose)

    def _add_path(self, rows: _Rows) -> None:
        pose, odo, n = self.pose, self.nodes.pose, len(self.nodes)
        a, b = pose[:-1], pose[1:]
        u = rotated(odo[1:, :2] - odo[:-1, :2], -odo[:-1, 2])
        c, s = np.cos(a[:, 2]), np.sin(a[:, 2])
        weight = 1.0 / self.nodes.sd_m
        i = np.arange(n - 1)
        for axis, (along, turned) in enumerate(
            (
                (c * u[:, 0] - s * u[:, 1], -s * u[:, 0] - c * u[:, 1]),
                (s * u[:, 0] + c * u[:, 1], c * u[:, 0] - s * u[:, 1]),
            )
        ):
            rows.add(
                weight * (b[:, axis] - a[:, axis] - along),
                [(3 * i + axis, -weight), (3 * i + 3 + axis, weight), (3 * i + 2, -weight * turned)],
            )
        weight = 1.0 / np.maximum(self.nodes.turn_sd_rad, 1e-4)
        rows.add(
            weight * ((b[:, 2] - a[:, 2]) - (odo[1:, 2] - odo[:-1, 2])), [(3 * i + 2, -weight), (3 * i + 5, weight)]
        )
        start_sd = (START_SD_M, START_SD_M, START_SD_RAD if self.base_rad is None else FREE_SD_RAD)
        for k, (value, sd) in enumerate(zip(odo[0], start_sd, strict=True)):
            rows.add(np.array([(pose[0, k] - value) / sd]), [(np.array([k]), np.array([1.0 / sd]))])

    def _add_walls(self, rows: _Rows) -> None:
        f, walls = self.fragments, self.walls
        used = np.flatnonzero(walls.of >= 0)
        if not len(used):
            return
        node, wall = f.node[used], walls.of[used]
        theta, first = self.pose[node, 2], 3 * len(self.nodes)
        arm = rotated(f.centre_m[used], theta)
        q = self.pose[node, :2] + arm
        phi = walls.normal_rad[wall]
        cp, sp_ = np.cos(phi), np.sin(phi)
        r = (cp * q[:, 0] + sp_ * q[:, 1] - walls.rho_m[wall]) / f.sd_m[used]
        ra = wrap(theta + f.normal_rad[used] - phi) / f.sd_rad[used]
        # The weight is the probability of belonging to this wall, so misfits lose their weight.
        one = ONE_WALL * np.exp(-0.5 * (r**2 + ra**2)) / (2.0 * math.pi * f.sd_m[used] * f.sd_rad[used])
        wt = np.sqrt(one / (one + (1.0 - ONE_WALL) / (4.0 * APART_M * TURNED_RAD)))
        wd, wa = wt / f.sd_m[used], wt / f.sd_rad[used]
        rows.add(
            wt * r,
            [
                (3 * node, wd * cp), (3 * node + 1, wd * sp_), (3 * node + 2, wd * (sp_ * arm[:, 0] - cp * arm[:, 1])),
                (first + 2 * wall, wd * (cp * q[:, 1] - sp_ * q[:, 0])), (first + 2 * wall + 1, -wd),
            ],
        )  # fmt: skip
        rows.add(wt * ra, [(3 * node + 2, wa), (first + 2 * wall, -wa)])

    def _add_directions(self, rows: _Rows) -> None:
        """Walls along the directions of the building; a wall at another angle is weighted by its probability of being one of them."""
        if self.base_rad is None or not len(self.walls.rho_m):
            return
        off = (self.walls.normal_rad - self.base_rad + 0.5 * RIGHT_RAD) % RIGHT_RAD - 0.5 * RIGHT_RAD
        sd = math.hypot(DIRECTION_SD_RAD, math.radians(1.0))
        fits = ALIGNED * np.exp(-0.5 * (off / sd) ** 2) / (math.sqrt(2.0 * math.pi) * sd)
        weight = np.sqrt(fits / (fits + (1.0 - ALIGNED) / RIGHT_RAD)) / DIRECTION_SD_RAD
        first = 3 * len(self.nodes)
        rows.add(weight * off, [(first + 2 * np.arange(len(off)), weight)])

    def _add_closures(self, rows: _Rows) -> None:
        if not self.closures:
            return
        old, new = np.array([(closure.old, closure.new) for closure in self.closures]).T
        difference = self.pose[new] - self.pose[old] - np.stack([closure.between for closure in self.closures])
        value, vector = np.linalg.eigh(np.stack([closure.information for closure in self.closures]))
        which, axis = np.nonzero(value > 1e-9)
        w = np.sqrt(value[which, axis])[:, None] * vector[which, :, axis]
        entries = [(3 * new[which] + j, w[:, j]) for j in range(3)]
        entries += [(3 * old[which] + j, -w[:, j]) for j in range(3)]
        rows.add((w * difference[which]).sum(1), entries)


class _Rows:
    """Rows of a sparse Jacobian and their residuals."""

    def __init__(self) -> None:
        self._row: list[Ints] = []
        self._column: list[Ints] = []
        self._value: list[Floats] = []
        self._residual: list[Floats] = []
        self._count = 0

    def add(self, residual: Floats, entries: Sequence[tuple[Ints, Floats]]) -> None:
        """Rows (k,) with these residuals; each entry: columns (k,) and derivatives (k,)."""
        row = self._count + np.arange(len(residual))
        for column, value in entries:
            self._row.append(row)
            self._column.append(column)
            self._value.append(value)
        self._residual.append(residual)
        self._count += len(residual)

    def matrix(self, columns: int) -> tuple[sp.csr_matrix, Floats]:
        """The Jacobian and the residuals."""
        row, column, value = (np.concatenate(part) for part in (self._row, self._column, self._value))
        return sp.csr_matrix((value, (row, column)), shape=(self._count, columns)), np.concatenate(self._residual)


def placed(fragments: Fragments, pose: Floats) -> tuple[Floats, Floats]:
    """Centres (f, 2) and normals (f,) of fragments, given the poses (n, 3) of all nodes."""
    at = pose[fragments.node]
    return at[:, :2] + rotated(fragments.centre_m, at[:, 2]), at[:, 2] + fragments.normal_rad


def contradicted(graph: Graph, closure: Closure) -> float:
    """Log-odds that a closure is right, less the cost of its residual in the solved graph."""
    difference = graph.pose[closure.new] - graph.pose[closure.old] - closure.between
    return closure.log_odds - 0.5 * float(difference @ closure.information @ difference)
