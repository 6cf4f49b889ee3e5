# SPDX-License-Identifier: MIT
"""The search of the building: exact Bayes on a grid of cells and headings [Burgard et al. 1998].

In: a start, the input of a `Cloud`. Out: a `Cloud`, once the place is found. Owns the weight of each state, and the heights.

The lengths and the rotation of the walk frame drift little, so a state moves rigidly with the path, and its error is spread over its
neighbours. A layer's sector of the rotation is halved when the way within it errs by a cell: the search is as fine as the path is long. Of the many
states of a large building the heaviest MOST_STATES are kept.
"""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.echoes.likelihood import EchoModel
from echostep.echoes.range_memory import LOG, PlacedPings
from echostep.echoes.range_table import OUTSIDE_ENTRY, SECTORS, TablePing, TablePings, log_densities
from echostep.echoes.unplanned import RangeMemory
from echostep.elementary import exp, log
from echostep.height.levels import HeightChange
from echostep.localization.grid.cells import GridCells
from echostep.localization.grid.heights import GridHeights
from echostep.localization.grid.kernels import GridStates, halved, shift_and_weigh, spread, weigh_levels
from echostep.localization.particles.cloud import Cloud
from echostep.localization.particles.particles import Particles, PressureLag
from echostep.localization.particles.start import Start
from echostep.localization.settings import UNPLANNED_DOOR, FilterSettings
from echostep.particles.arrays import DrawnPoses, Move, PingBatch
from echostep.particles.kernels import MovePiece, piece_of, systematic
from echostep.path import bend_of
from echostep.walls.floor import CELL_M
from echostep.walls.level_sheet import LevelSheet

# Assumed, not measured.
LEAST_SHARE = 1e-6  # of the greatest weight, below which a state is dropped
WALL_SHARE = math.exp(UNPLANNED_DOOR)  # of the weight that is left behind a wall
MOST_STATES = 300_000  # a millisecond a ping
SPREAD_M, SPREAD_RAD = 0.05, math.radians(1.0)  # standard deviations on a metre: per axis, and of the rotation
SPREAD_SHARE = 0.05  # of a state's weight that is due to each neighbour when it is spread
MOST_BESIDE, MOST_TURNED = 0.2, 0.25  # of the weight that a neighbour gets at most: the peak remains
# Weight outside of one place below which a search has found it, on one level, and on several, there after this length of search: exact likelihoods
# discriminate between levels that are alike, and need a path to do so; assumed
FOUND_REST, LEVELS_REST, LEVELS_M = 0.03, 0.1, 10.0
SHOWN = 5_000  # states that stand for all of a larger search
TRACED_M2_RAD = 5.0  # poses that 20,000 particles fill by the sizes of `CloudSettings`: 6,000 cells
SCATTERED_SHARE = 0.8  # weight of a search that stays about its places after a move that was not observed, assumed
NO_PING_BEND = bend_of(math.radians(45.0))  # of a move's chord, above which its pings do not count: an uncertain turn


class Search(PressureLag):
    """The weights of all poses on the grid. `is_on_any_level`: nothing is known of the level."""

    is_searching: ClassVar[bool] = True

    def __init__(
        self, cells: GridCells, places: tuple[Floats, Floats], unplanned: RangeMemory, start: Start, sheet: LevelSheet | None,
        settings: FilterSettings, rng: np.random.Generator,
    ) -> None:  # fmt: skip
        """Begin evenly at these places x, y (n,) on the sheet, with any rotation. `unplanned`: density without a plan, as inexact as the table."""
        super().__init__(start.lag_variance, settings.climb)
        self.sheet, self._settings, self._rng = sheet, settings.cloud, rng
        self.is_on_any_level = sheet is not None and start.is_on_any_level
        self._cells, self._places = cells, places
        self._heights = None if sheet is None else GridHeights(sheet, settings.climb, start)
        self._turned_rad = 0.0  # of the walk frame since the search began
        self._scratch = np.zeros(len(cells.row), np.float32)
        self._pings, self._unplanned = TablePings(), unplanned
        self.path_m = 0.0  # since the search began
        self._x_m = self._y_m = 0.0  # end of the path in the walk frame
        self._var_m2 = self._var_rad2 = 0.0
        self._begin()

    def _begin(self) -> None:
        """Every place with every rotation."""
        cell = self._cells.cell_of(*self._places)
        self._states = GridStates(
            np.tile(cell, SECTORS), np.ones(len(cell) * SECTORS, np.float32),
            np.arange(SECTORS + 1, dtype=np.int64) * len(cell), np.zeros((SECTORS, 2)),
        )  # fmt: skip
        self._note_least(1.0)

    def begin_with(self, place: Floats, turn: Floats, share: float) -> None:
        """Begin with this share of the weight by densities over the places (n,) and over the rotations (SECTORS,), and the rest evenly."""
        density = np.outer(turn, place).ravel()
        if (total := float(density.sum())) > 0.0:  # otherwise all of it is far from the floor
            self._weigh_anew(density * (share / total) + (1.0 - share) / len(density))

    def _weigh_anew(self, weight: Floats) -> None:
        """Replace the weights of all states by these; the greatest is 1 then."""
        self._states = self._states._replace(weight=(weight / weight.max()).astype(np.float32))
        self._note_least(1.0)

    def begin_about(self, x_m: Floats, y_m: Floats, turn_rad: Floats, share: float) -> None:
        """Begin again, with this share of the weight at these poses (n,), and the rest evenly."""
        self._begin()
        s = self._states
        size = int(s.first[1])
        rank = np.full(len(self._cells.row), -1, np.int64)
        rank[s.cell[:size]] = np.arange(size)
        cell = self._cells.cell_of(x_m, y_m)
        place = np.where(cell >= 0, rank[cell], -1)
        layer = np.floor((turn_rad - self._turned_rad) * SECTORS / (2.0 * math.pi)).astype(np.int64) % SECTORS
        state = (layer * size + place)[place >= 0]
        if len(state):
            counts = np.bincount(state, minlength=len(s.weight)).astype(np.float64)
            self._weigh_anew(counts * (share / len(state)) + (1.0 - share) / len(s.weight))

    def __len__(self) -> int:
        return len(self._states.cell)

    def turn_walk_frame(self, by_rad: float) -> None:
        """Rotate all states: the heading in the walk frame has changed while the heading on the map has not."""
        self._turned_rad += by_rad

    def advance(self, move: Move, pings: PingBatch, model: EchoModel) -> float:
        """Move all states, and weigh them by the pings that `TablePings` takes, each where it was triggered.

        Returns the log of the density of these pings over the density without a plan, to the power with which they count here.
        """
        length, bend, done = math.hypot(move.dx_m, move.dy_m), math.hypot(move.bend_x_m, move.bend_y_m), 0.0
        table, log_ratio = np.empty(OUTSIDE_ENTRY + 1), 0.0
        for k in range(len(pings.share)):
            share = float(pings.share[k])
            ping = self._pings.take(pings, k, is_straight=bend <= NO_PING_BEND * length)
            if ping is not None:
                log_densities(ping, model, table)
                log_ratio += self._step(move, done, share, table, ping.axis_rad)
                log_ratio -= self._log_unplanned(ping, int(pings.ranger[k]), piece_of(move, 0.0, share))
                done = share
        if done < 1.0:
            self._step(move, done, 1.0, np.zeros(len(table)), 0.0)
        self.path_m += length
        self._x_m, self._y_m = self._x_m + move.dx_m, self._y_m + move.dy_m
        self._var_m2 += SPREAD_M**2 * length + move.sd_m**2 + bend**2
        self._var_rad2 += SPREAD_RAD**2 * length + move.turn_sd_rad**2
        self._refine()
        return log_ratio

    def _log_unplanned(self, ping: TablePing, ranger: int, way: MovePiece) -> float:
        """Log-density of a ping without a plan, to its power; `way`: from the end of the path to where it was triggered."""
        x_m, y_m = self._x_m + way.dx_m, self._y_m + way.dy_m
        values = (np.array([v]) for v in (x_m, y_m, ping.axis_rad, ping.range_m, ping.power))
        return float(self._unplanned.densities(PlacedPings(np.array([ranger]), *values))[LOG, 0])

    def _step(self, move: Move, begin: float, end: float, log_factor: Floats, axis_rad: float) -> float:
        """Move by a piece, and multiply by factors; returns the log of the mean factor."""
        s, piece = self._states, piece_of(move, begin, end)
        c, d = math.cos(self._turned_rad), math.sin(self._turned_rad)
        east, north = c * piece.dx_m - d * piece.dy_m, d * piece.dx_m + c * piece.dy_m
        log_top = float(log_factor.max())
        factor = exp(log_factor - log_top - math.log(self._top)).astype(np.float32)
        kept, top, before, after = shift_and_weigh(
            s, east, north, factor, axis_rad + self._turned_rad, self._least, WALL_SHARE, self._cells
        )
        log_mean = log_top + math.log(self._top * after / before) if after > 0.0 else 0.0
        self._states = s._replace(cell=s.cell[:kept], weight=s.weight[:kept])
        if kept:
            self._note_least(top)
        else:  # all are beyond the ground that the grid covers
            self._begin()
        return log_mean

    def change_levels(self, move: Move, change: HeightChange) -> float:
        """Weigh by a change of height after a move, and move states that have reached another level; returns the log of the mean factor."""
        del move  # the states have gone with it
        if self._heights is None:
            return 0.0
        self._drift(change)
        factors, self.lag_variance = self._heights.update(change, self.lag_variance)
        top, mean = weigh_levels(self._states, factors, self._cells)
        self._note_least(top)
        return factors.log_top + math.log(max(mean, LEAST_SHARE))

    def _note_least(self, top: float) -> None:
        """Note the greatest weight, and the weight below which a state is dropped with the next step."""
        self._top, self._least, count = top, LEAST_SHARE * top, len(self)
        if count > MOST_STATES:
            sample = self._states.weight[:: max(count // 20_000, 1)]
            self._least = max(float(np.quantile(sample, 1.0 - MOST_STATES / count)), self._least)

    def _refine(self) -> None:
        """Halve the sectors if the way within one errs by a cell, and spread the weight that is due."""
        layers = len(self._states.offset_m)
        if self._turned(SPREAD_RAD**2, 2 * layers) < MOST_TURNED and self.path_m * math.pi / layers > CELL_M:
            self._states, layers = halved(self._states), 2 * layers
        beside, turned = 0.5 * self._var_m2 / CELL_M**2, self._turned(self._var_rad2, layers)
        if beside > SPREAD_SHARE:
            self._spread(min(beside, MOST_BESIDE), 0.0)
            self._var_m2 = 0.0
        if turned > SPREAD_SHARE:
            self._spread(0.0, min(turned, MOST_TURNED))
            self._var_rad2 = 0.0

    @staticmethod
    def _turned(variance_rad2: float, layers: int) -> float:
        """Share of a state's weight that each neighbouring layer gets by this variance of the rotation."""
        return 0.5 * variance_rad2 * (layers / (2.0 * math.pi)) ** 2

    def _spread(self, beside: float, turned: float) -> None:
        self._states = spread(self._states, beside, turned, self._least, self._scratch, self._cells)

    def found(self) -> Cloud | None:
        """The cloud, if the search is over: all is in one place, or in few enough for a cloud to trace."""
        rest, least_m = (FOUND_REST, 0.0) if self.sheet is None else (LEVELS_REST, LEVELS_M)
        if self.path_m < least_m:
            return None
        if self.densest_share(TRACED_M2_RAD) <= 1.0 - FOUND_REST and self.particles.place_share <= 1.0 - rest:
            return None
        cloud = self.draw(self._settings.largest)
        cloud.contract()
        cloud.is_on_any_level = self.is_on_any_level
        return cloud

    def densest_share(self, size_m2_rad: float) -> float:
        """Weight of the heaviest states that together have this size."""
        weight = self._states.weight
        count = int(size_m2_rad / (CELL_M**2 * 2.0 * math.pi / len(self._states.offset_m)))
        if count >= len(weight):
            return 1.0
        return float(np.partition(weight, len(weight) - count)[len(weight) - count :].sum() / weight.sum())

    def scatter(self, move: Move, change: HeightChange) -> None:
        """Begin again about the places that are reached by an unobserved move, as of a cloud."""
        cloud = self.draw(self._settings.largest)
        cloud.scatter(move, change)
        self.begin_about(cloud.x_m, cloud.y_m, cloud.turn_rad, SCATTERED_SHARE)

    def draw(self, count: int) -> Cloud:
        """A cloud of `count` poses, evenly within their cells and sectors."""
        poses = self._poses(systematic(self._states.weight.astype(np.float64), float(self._rng.random()), count))
        within = self._rng.random((3, count)) - 0.5
        turn = poses.turn_rad + 2.0 * math.pi / len(self._states.offset_m) * within[2]
        poses = poses._replace(x_m=poses.x_m + CELL_M * within[0], y_m=poses.y_m + CELL_M * within[1], turn_rad=turn)
        return Cloud(poses, self._settings, self._rng, self.sheet, self.lag_variance, self._climbing)

    @property
    def states(self) -> Particles:
        """All states, each in the middle of its cell and sector."""
        log_weight = log(np.maximum(self._states.weight, np.finfo(np.float32).tiny).astype(np.float64))
        return self._particles(np.arange(len(self)), log_weight - log_weight.max())

    @property
    def particles(self) -> Particles:
        """All states, or if there are more than SHOWN, so many by weight."""
        if len(self) <= SHOWN:
            return self.states
        return self._particles(systematic(self._states.weight.astype(np.float64), 0.5, SHOWN), np.zeros(SHOWN))

    def _particles(self, chosen: Ints, log_weight: Floats) -> Particles:
        return Particles(self._poses(chosen), log_weight, self.sheet, self.lag_variance, self._climbing)

    def reweight(self, log_factor: Floats) -> None:
        """Multiply the weights of all states by factors, given as logarithms (n,)."""
        self._weigh_anew(self._states.weight * exp(log_factor - log_factor.max()))

    def _poses(self, chosen: Ints) -> DrawnPoses:
        """The middles of states (n,)."""
        s, cells = self._states, self._cells
        layer = np.searchsorted(s.first, chosen, side="right") - 1
        line, column = np.divmod(s.cell[chosen], cells.columns)
        x = cells.x0_m + (column + 0.5) * CELL_M + s.offset_m[layer, 0]
        y = cells.y0_m + (line + 0.5) * CELL_M + s.offset_m[layer, 1]
        z, lag = np.zeros(len(chosen)), np.zeros(len(chosen))
        if self._heights is not None:
            z, lag = self._heights.of(cells.level[column], cells.connector[s.cell[chosen]].astype(np.int64))
        turn: Floats = 2.0 * math.pi * (layer + 0.5) / len(s.offset_m) + self._turned_rad
        return DrawnPoses(x, y, turn, z, lag)
