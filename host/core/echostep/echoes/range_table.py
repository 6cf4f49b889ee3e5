# SPDX-License-Identifier: MIT
"""Table of the expected range at each place of the floor and in each direction, for a search of the building.

In: walls, their floor. Out: `RangeTable`; `log_densities` of a ping by its entries, instead of a trace; the pings that
a search takes. Owns nothing.

A cell of the floor has one row, a sector of the ranger's axis one column. A ranger's cone is wide, so its range changes little within a sector of 15
degrees; within a cell of 25 cm it changes by as much as the cell is wide, which is in TABLE_SD_M. An entry is an expected range and the probability
of an echo at all, since walls at a grazing angle or far away seldom answer. A look-up takes a tenth of a trace's time.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats, Int32s, Ints
from echostep.echoes.likelihood import SURE_COS, EchoModel, EchoSettings, detection
from echostep.jit import inline_part, kernel, lean_kernel
from echostep.particles.arrays import PingBatch
from echostep.walls.echo_sources import Walls, list_sources, unit_at
from echostep.walls.floor import CELL_M, Floor
from echostep.walls.index import EAR_REACH_M, TILE_M, WallIndex
from echostep.walls.source_blocks import BLOCK, DISTANCE, FREE, KIND, OFF_AXIS, new_block, set_receiver

# Assumed, not measured.
SECTORS = 24  # of 15 degrees
UNIT_M = 0.025  # of a range in the table, one byte
TABLE_SD_M = 0.2  # a cell's half diagonal, and the heading's error over a sector
# Share of the expected ranges with a larger error, and by which factor: edges, corners, the next wall
FAR_SHARE, FAR_FACTOR = 0.2, 3.0
LIKELY = 0.05  # probability of detection that the sources up to the expected range have together
CHANCES = 8  # steps of the probability of an echo
RANGES = 256  # steps of the expected range
OUTSIDE_ENTRY = CHANCES * RANGES  # entry of a place outside the building
# The ping before, of the same ranger: silence persists where nothing reflects, and where an entry is wrong
AFTER_ECHO, AFTER_SILENCE = 0, 1
# Shares after an echo, and after silence: of echoes expected by the entry that are missing all the same; of "no echo" where none is expected (the
# others are second reflections and things that no plan shows); of views that are hidden; of "no echo" in these
MISSED, QUIET, HIDDEN, HIDDEN_QUIET = (0.02, 0.1), (0.3, 0.8), (0.1, 0.2), (0.1, 0.6)
# Share of silence, by second reflections, that QUIET assumes: it scales with a ranger's own
USUAL_SILENT = 1.0 - EchoSettings().stray
MOST_QUIET = 0.95
AROUND = 2  # cells about the floor, at its walls, that share the nearest row
HEARD_M, UNHEARD = FREE, FREE + BLOCK  # more columns of a block
UNKNOWN = -1  # no row: outside the building
USED_M = 0.25  # way of a view between two pings of one ranger that are used: a cell of the table
INDEPENDENT_M = 0.8  # path over which the pings of one ranger have the information of one ping: walls continue
Entries = np.ndarray[tuple[int, int], np.dtype[np.uint16]]


class RangeTable(NamedTuple):
    """`row` (rows, columns): row of `expected` by cell of the grid from (x0_m, y0_m) on, or UNKNOWN.

    `expected` (cells, SECTORS): range in UNIT_M (0: none), and RANGES times the step of the probability of an echo, of CHANCES.
    """

    x0_m: float
    y0_m: float
    row: Int32s
    expected: Entries


class TablePing(NamedTuple):
    """One ping: axis in the walk frame, range (0: none), power, odds that a silent one missed its echo (else 0), AFTER_ECHO or AFTER_SILENCE."""

    axis_rad: float
    range_m: float
    power: float
    missed: float
    after: int


def range_table_of(walls: Walls, floor: Floor, model: EchoModel) -> RangeTable:
    """The table of a floor; seconds for a building of thousands of square metres."""
    if not len(floor.x_m):
        return RangeTable(0.0, 0.0, np.full((1, 1), UNKNOWN, np.int32), np.zeros((1, SECTORS), np.uint16))
    x0, y0 = float(floor.x_m.min()) - (AROUND + 0.5) * CELL_M, float(floor.y_m.min()) - (AROUND + 0.5) * CELL_M
    column, line = ((floor.x_m - x0) / CELL_M).astype(np.int64), ((floor.y_m - y0) / CELL_M).astype(np.int64)
    row = np.full((int(line.max()) + AROUND + 1, int(column.max()) + AROUND + 1), UNKNOWN, np.int32)
    row[line, column] = np.arange(len(line))
    for _ in range(AROUND):
        row = _grown(row)
    index, expected = walls.near(floor.x_m, floor.y_m), np.empty((len(line), SECTORS), np.uint16)
    tile = np.floor((floor.x_m - index.x0_m) / TILE_M) + index.columns * np.floor((floor.y_m - index.y0_m) / TILE_M)
    order = np.argsort(tile, kind="stable")
    first = np.flatnonzero(np.diff(tile[order], prepend=-1.0, append=-1.0))
    expected[order] = _expected(floor.x_m[order], floor.y_m[order], first, index, model)
    return RangeTable(x0, y0, row, expected)


def _grown(row: Int32s) -> Int32s:
    """The grid with each unknown cell that has a known neighbour given that neighbour's row; cells at its edge are unknown."""
    grown = row.copy()
    for by, axis in ((-1, 0), (1, 0), (-1, 1), (1, 1)):
        beside = np.roll(row, by, axis)
        np.copyto(grown, beside, where=(row == UNKNOWN) & (beside != UNKNOWN))
    return grown


@lean_kernel
def log_densities(ping: TablePing, model: EchoModel, table: Floats) -> None:
    """Log-density per metre of a range by the entry, to the ping's power; range 0: of no echo.

    With the entry's probability the echo has the expected range, else it is as where none is expected; so is the last entry, outside.
    """
    range_m, missed = ping.range_m, MISSED[ping.after]
    quiet = min(QUIET[ping.after] * ((1.0 - model.stray) / USUAL_SILENT), MOST_QUIET)
    hidden_share, hidden_quiet = HIDDEN[ping.after], HIDDEN_QUIET[ping.after]
    is_echo = range_m > 0.0
    evenly = 1.0 / (model.maximum_m - model.minimum_m)
    unlikely, hidden = ((1.0 - quiet) * evenly, (1.0 - hidden_quiet) * evenly) if is_echo else (quiet, hidden_quiet)
    for k in range(RANGES):
        likely = missed
        if is_echo:
            z = (range_m - k * UNIT_M) / TABLE_SD_M
            near = math.exp(-0.5 * z * z)
            far = math.exp(-0.5 * z * z / (FAR_FACTOR * FAR_FACTOR)) / FAR_FACTOR
            likely = (1.0 - FAR_SHARE) * near + FAR_SHARE * far
            likely *= (1.0 - missed) / (TABLE_SD_M * math.sqrt(2.0 * math.pi))
        for c in range(CHANCES):
            chance = (c + 0.5) / CHANCES if k > 0 else 0.0
            planned = chance * likely + (1.0 - chance) * unlikely
            table[c * RANGES + k] = ping.power * math.log(
                (1.0 - hidden_share) * planned + hidden_share * hidden + ping.missed
            )
    table[OUTSIDE_ENTRY] = table[0]


@kernel
def _expected(x: Floats, y: Floats, first: Ints, walls: WallIndex, model: EchoModel) -> Entries:
    """The entries by cell and sector; the cells first[k] to first[k + 1] are of one tile, 25 at most, and traced together as one block."""
    block, expected = new_block(), np.zeros((len(x), SECTORS), np.uint16)
    for k in range(len(first) - 1):
        begin, count = first[k], first[k + 1] - first[k]
        for s in range(SECTORS):
            axis = 2.0 * math.pi * (s + 0.5) / SECTORS
            ax, ay = math.cos(axis), math.sin(axis)
            for i in range(count):
                set_receiver(block, i, x[begin + i], y[begin + i], ax, ay)
            unit = unit_at(x[begin], y[begin], axis, walls)
            longest = list_sources(count, unit, walls, (model.sure_m, SURE_COS, EAR_REACH_M), block)
            _write_entries(count, longest, model, block, expected[begin : begin + count, s])
    return expected


@inline_part
def _write_entries(count: int, longest: int, model: EchoModel, block: Floats, entries: Entries) -> None:
    """For each receiver: the range up to which sources are detected with probability LIKELY, and the probability that any is."""
    for i in range(count):
        block[HEARD_M + i], block[UNHEARD + i] = 0.0, 1.0
    for source in range(longest):
        for i in range(count):
            at = source * BLOCK + i
            block[UNHEARD + i] *= 1.0 - detection(block[DISTANCE + at], block[OFF_AXIS + at], block[KIND + at], model)
            is_first = block[HEARD_M + i] == 0.0 and block[UNHEARD + i] < 1.0 - LIKELY
            block[HEARD_M + i] = block[DISTANCE + at] if is_first else block[HEARD_M + i]
    for i in range(count):
        entry = max(min(int(block[HEARD_M + i] / UNIT_M + 0.5), RANGES - 1), 1)
        entry += RANGES * min(int((1.0 - block[UNHEARD + i]) * CHANCES), CHANCES - 1)
        entries[i] = entry if block[HEARD_M + i] > 0.0 else 0


class TablePings:
    """The memory of both rangers since the search began."""

    def __init__(self) -> None:
        self._since_m = [math.inf, math.inf]  # way of each ranger's view since its last ping that was used
        self._after = [AFTER_SILENCE, AFTER_SILENCE]  # whether that ping had an echo

    def take(self, pings: PingBatch, k: int, *, is_straight: bool) -> TablePing | None:
        """The k-th ping; None if it comes too soon after the last one of its ranger, or on a way that is not straight."""
        ranger = int(pings.ranger[k])
        self._since_m[ranger] += float(pings.travel_m[k])
        since_m, after = self._since_m[ranger], self._after[ranger]
        if since_m < USED_M or not is_straight:
            return None
        axis_rad, range_m, missed = (float(v[k]) for v in (pings.axis_rad, pings.range_m, pings.missed))
        self._since_m[ranger], self._after[ranger] = 0.0, AFTER_ECHO if range_m > 0.0 else AFTER_SILENCE
        return TablePing(axis_rad, range_m, min(since_m / INDEPENDENT_M, 1.0), missed, after)
