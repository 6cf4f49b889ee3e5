# SPDX-License-Identifier: MIT
"""The table of expected ranges against a trace of each entry, and what silence costs before a wall that is seldom heard."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echostep.echoes.likelihood import EchoSettings, detection, echo_model
from echostep.echoes.range_table import (
    AFTER_ECHO,
    AFTER_SILENCE,
    CHANCES,
    LIKELY,
    OUTSIDE_ENTRY,
    RANGES,
    SECTORS,
    UNIT_M,
    TablePing,
    log_densities,
    range_table_of,
)
from echostep.localization import Building
from echostep.walls.echo_sources import Walls, echo_sources, one_receiver
from echostep.walls.floor import CELL_M

ROOM = Building(
    Walls(np.array([[0, 0, 12, 0], [12, 0, 12, 8], [12, 8, 0, 8], [0, 8, 0, 0], [3, 0, 3, 5]], float)), None
)
MODEL = echo_model(EchoSettings())
FIELD = range_table_of(ROOM.walls, ROOM.floor, MODEL)
EAST, NORTH_EAST = 0.0, math.radians(37.5)
ROOM_FOR_TABLE = np.empty(CHANCES * RANGES + 1)


def traced(x_m: float, y_m: float, axis_rad: float) -> tuple[float, float]:
    """The range up to which sources are detected with probability LIKELY (nan: none), and the probability that any is."""
    block, distance_m, off_axis_rad, kind = one_receiver()
    count = echo_sources(x_m, y_m, axis_rad, ROOM.walls.near(np.array([x_m]), np.array([y_m])), block)
    missed = np.cumprod([1.0 - detection(distance_m[k], off_axis_rad[k], kind[k], MODEL) for k in range(count)])
    likely = np.flatnonzero(missed < 1.0 - LIKELY)
    return (float(distance_m[likely[0]]), 1.0 - float(missed[-1])) if len(likely) else (math.nan, 0.0)


def log_density(x_m: float, y_m: float, axis_rad: float, range_m: float, after: int = AFTER_ECHO) -> float:
    """Of one ping (range 0: none) at a place, less that in the middle of the hall, where nothing is in reach."""
    log_densities(TablePing(0.0, range_m, 1.0, 0.0, after), MODEL, ROOM_FOR_TABLE)
    here, hall = (
        ROOM_FOR_TABLE[
            FIELD.expected[FIELD.row[int((y - FIELD.y0_m) / CELL_M), int((x - FIELD.x0_m) / CELL_M)], sector]
        ]
        for x, y, sector in ((x_m, y_m, int(axis_rad / (2.0 * math.pi) * SECTORS)), (4.6, 4.1, 0))
    )
    return float(here - hall)


@pytest.mark.parametrize("seed", range(5))
def test_an_entry_is_a_trace_from_the_middle_of_its_cell_and_sector(seed: int) -> None:
    rng = np.random.default_rng(seed)
    for k in rng.integers(len(ROOM.floor.x_m), size=40):
        s = int(rng.integers(SECTORS))
        range_m, chance = traced(ROOM.floor.x_m[k], ROOM.floor.y_m[k], 2.0 * math.pi * (s + 0.5) / SECTORS)
        entry = int(FIELD.expected[k, s])
        if math.isnan(range_m):
            assert entry == 0
        else:
            assert (entry % RANGES) * UNIT_M == pytest.approx(range_m, abs=UNIT_M)
            assert (entry // RANGES + 0.5) / CHANCES == pytest.approx(chance, abs=0.51 / CHANCES)


def test_silence_costs_little_where_a_wall_is_seldom_heard() -> None:
    """A wall 1 m ahead is nearly always heard, one that is seen at 37 degrees, 4.9 m away, seldom."""
    assert traced(11.1, 4.1, EAST)[1] > 0.9
    assert LIKELY < traced(9.1, 4.1, NORTH_EAST)[1] < 0.4
    assert log_density(11.1, 4.1, EAST, 0.0) < -1.2
    assert -0.6 < log_density(9.1, 4.1, NORTH_EAST, 0.0) < 0.0


@pytest.mark.parametrize(("at", "axis_rad"), [((11.1, 4.1), EAST), ((9.1, 4.1), NORTH_EAST)])
def test_an_echo_from_where_one_is_expected_speaks_for_the_place(at: tuple[float, float], axis_rad: float) -> None:
    range_m, _ = traced(*at, axis_rad)
    assert log_density(*at, axis_rad, range_m) > 0.5
    assert log_density(*at, axis_rad, range_m + 1.5) < log_density(*at, axis_rad, range_m) - 1.0


def test_silence_that_goes_on_costs_less_before_a_wall_than_silence_after_an_echo() -> None:
    """A view that was hidden, or an entry that is wrong, stays so."""
    after_echo, after_silence = (log_density(11.1, 4.1, EAST, 0.0, after) for after in (AFTER_ECHO, AFTER_SILENCE))
    assert after_echo + 0.3 < after_silence < 0.0


def test_silence_in_a_hall_is_no_evidence_for_outside() -> None:
    """Otherwise the particles of a hall died within metres, for each silent ping counted."""
    for after in (AFTER_ECHO, AFTER_SILENCE):
        log_densities(TablePing(0.0, 0.0, 1.0, 0.0, after), MODEL, ROOM_FOR_TABLE)
        assert ROOM_FOR_TABLE[OUTSIDE_ENTRY] == ROOM_FOR_TABLE[0]


def test_a_ranger_of_many_second_reflections_is_seldom_silent_in_a_hall() -> None:
    usual, often, table = MODEL, echo_model(EchoSettings(stray=0.65)), ROOM_FOR_TABLE
    silent = []
    for model in (usual, often):
        log_densities(TablePing(0.0, 0.0, 1.0, 0.0, AFTER_SILENCE), model, table)
        silent.append(math.exp(table[0]) - 0.2 * 0.6)  # less those of hidden views
    assert silent[1] == pytest.approx(0.5 * silent[0])


@pytest.mark.parametrize("after", [AFTER_ECHO, AFTER_SILENCE])
@pytest.mark.parametrize("k", [0, 20, 90, 200])
def test_the_density_of_each_entry_adds_up_to_one(k: int, after: int) -> None:
    """Over silence and all ranges; some of the wide part of near and far ranges is out of the ranger's reach."""
    step_m, total, table = 0.01, 0.0, ROOM_FOR_TABLE
    entry = (CHANCES - 1) * RANGES + k
    for range_m in np.arange(MODEL.minimum_m, MODEL.maximum_m, step_m):
        log_densities(TablePing(0.0, float(range_m), 1.0, 0.0, after), MODEL, table)
        total += step_m * math.exp(table[entry])
    log_densities(TablePing(0.0, 0.0, 1.0, 0.0, after), MODEL, table)
    assert total + math.exp(table[entry]) == pytest.approx(1.0, abs=0.08)
