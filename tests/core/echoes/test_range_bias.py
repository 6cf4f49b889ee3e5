# SPDX-License-Identifier: MIT
"""The rangers' common bias: the kernel against its slow twin, what is learnt along walls, and what is not."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echostep.arrays import Floats, Ints
from echostep.echoes.likelihood import EchoModel, EchoSettings, detection, echo_model, normal
from echostep.echoes.range_bias import RangeBias
from echostep.particles.arrays import Move, ParticleArrays, PingBatch
from echostep.path import MeasuredSegment, PathSegment
from echostep.walls.echo_sources import Walls
from naive.walls import echo_sources

CORRIDOR = np.array([[0, 0, 40, 0], [0, 3, 40, 3], [12, 0, 12, 1]], float)
TURNS_RAD = 0.5 * math.pi, -0.5 * math.pi  # of the axes, left and right, from the heading along x
EXACT = 0.0, 0.0, 0.0
Covariance = tuple[float, float, float]


def pings_of(range_m: Floats, ranger: Ints, axis_rad: Floats, power: float = 0.3) -> PingBatch:
    n = len(range_m)
    return PingBatch(np.linspace(0.0, 1.0, n), axis_rad, range_m, np.full(n, power), ranger, *np.zeros((5, n)))


def along(n: int, biases_m: tuple[float, float], y_m: float = 1.4) -> tuple[PingBatch, tuple[Floats, Floats, Floats]]:
    """Pings on a straight way through the corridor, left and right in turn, with these biases and noise; where they were sent."""
    rng = np.random.default_rng(1)
    ranger = np.arange(n, dtype=np.int64) % 2
    x, y = np.linspace(1.0, 10.0, n), np.full(n, y_m)
    axis = np.array(TURNS_RAD)[ranger]
    distance = np.where(ranger == 0, 3.0 - y_m, y_m)
    range_m = distance + np.array(biases_m)[ranger] + 0.02 * rng.standard_normal(n)
    range_m[::17] = 0.0  # some are not heard
    range_m[5::31] += 1.5  # some are second reflections
    return pings_of(range_m, ranger, axis), (x, y, axis)


def learnt_slowly(
    pings: PingBatch,
    place: tuple[Floats, Floats, Floats],
    covariance: Covariance,
    walls: Floats,
    m: EchoModel,
    sd_m: float,
) -> tuple[float, float]:
    """Mean and variance, in Python and by precisions."""
    mean, var = 0.0, 0.25 * sd_m**2
    for range_m, power, x, y, axis in zip(pings.range_m, pings.power, *place, strict=True):
        if range_m <= 0.0:
            continue
        unheard, best = 1.0, (0.0, 0.0, 0.0)
        for distance, off, kind in echo_sources(x, y, axis, walls):
            answers = unheard * detection(distance, off, kind, m)
            unheard -= answers
            best = max(best, (answers, distance, off), key=lambda each: each[0])
        answers, distance, off = best
        if answers <= 0.0:
            continue
        toward = np.array([math.cos(axis), math.sin(axis)])
        known = toward @ np.array([[covariance[0], covariance[1]], [covariance[1], covariance[2]]]) @ toward
        error = (m.sd_m + m.slant_m * off) ** 2
        innovation = range_m - distance - mean
        expected = answers * normal(innovation, math.sqrt(error + known + var))
        other = (1.0 - answers + m.hidden + m.outlier) / (m.maximum_m - m.minimum_m)
        counts = power * expected / (expected + other)
        if counts <= 0.0:
            continue
        precision = 1.0 / var + counts / (error + known)
        mean += counts / (error + known) / precision * innovation
        var = 1.0 / precision
    return mean, var


@pytest.mark.parametrize("covariance", [EXACT, (0.02, 0.004, 0.01)])
def test_the_kernel_agrees_with_its_twin(covariance: Covariance) -> None:
    echo = EchoSettings()
    model, found = echo_model(echo), RangeBias(echo.sd_m)
    pings, place = along(200, (0.05, -0.03), 1.2)
    place = (place[0] + 4.0, place[1], place[2] + 0.3)  # past the end of a wall, and with slanted axes
    found.learn(pings, place, covariance, Walls(CORRIDOR), model)
    mean, var = learnt_slowly(pings, place, covariance, CORRIDOR, model, echo.sd_m)
    assert found.mean_m == pytest.approx(mean, abs=1e-12)
    assert found.var_m2 == pytest.approx(var, rel=1e-9)


def test_the_common_bias_is_learnt_along_walls_and_taken_off_the_ranges() -> None:
    echo = EchoSettings()
    bias = RangeBias(echo.sd_m)
    pings, place = along(300, (0.06, 0.02))
    bias.learn(pings, place, EXACT, Walls(CORRIDOR), echo_model(echo))
    assert bias.mean_m == pytest.approx(0.04, abs=0.008)
    way = PathSegment(0.0, 1.0, 1.0, 0.0, 0.0, 0.0, sd_m=0.01, turn_sd_rad=0.001, step=1)
    heard = np.array([2.0, 2.0, np.nan, 0.0])
    corrected = bias.corrected(MeasuredSegment(way, np.zeros(4), np.array([0, 1, 0, 1]), heard)).range_m
    assert corrected[:2] == pytest.approx(2.0 - bias.mean_m)
    assert np.isnan(corrected[2])
    assert corrected[3] == 0.0


def test_pings_are_placed_behind_a_cloud_that_has_moved() -> None:
    """The cloud is at the end of a move of 4 m along y on the map, 4 m along x in the walk frame."""
    echo = EchoSettings()
    walls = Walls(CORRIDOR[:, [1, 0, 3, 2]])  # a corridor along y
    x, y, turn = (np.full(8, value) for value in (1.4, 9.0, 0.5 * math.pi))
    cloud = ParticleArrays(x, y, turn, np.ones(8), np.zeros(8))
    axis = np.array(TURNS_RAD)[np.arange(40) % 2]  # in the walk frame; left is -x on the map
    pings = pings_of(np.where(axis > 0.0, 1.4, 1.6) + 0.05, np.arange(40, dtype=np.int64) % 2, axis)
    bias = RangeBias(echo.sd_m)
    bias.learn_behind(cloud, np.full(8, 0.125), Move(4.0, 0.0, 0.0, 0.0), pings, walls, echo_model(echo))
    placed = np.full(40, 1.4), 9.0 - 4.0 * (1.0 - pings.share), axis + 0.5 * math.pi
    slowly = learnt_slowly(pings, placed, EXACT, CORRIDOR[:, [1, 0, 3, 2]], echo_model(echo), echo.sd_m)
    assert (bias.mean_m, bias.var_m2) == pytest.approx(slowly)
    assert bias.mean_m == pytest.approx(0.04, abs=0.015)


def test_corrected_pings_teach_the_same_again() -> None:
    """Pings arrive without the biases that are known so far; what is left of a bias is learnt from them."""
    echo = EchoSettings()
    model, walls = echo_model(echo), Walls(CORRIDOR)
    at_once, in_pieces = RangeBias(echo.sd_m), RangeBias(echo.sd_m)
    pings, place = along(300, (0.06, 0.04))
    at_once.learn(pings, place, EXACT, walls, model)
    for begin in range(0, 300, 30):
        some = slice(begin, begin + 30)
        piece = PingBatch._make(column[some] for column in pings)
        range_m = np.where(piece.range_m > 0.0, piece.range_m - in_pieces.mean_m, 0.0)
        in_pieces.learn(piece._replace(range_m=range_m), tuple(c[some] for c in place), EXACT, walls, model)  # type: ignore[arg-type]
    assert in_pieces.mean_m == pytest.approx(at_once.mean_m, abs=1e-9)


def test_a_place_that_is_not_known_and_echoes_of_something_else_teach_little() -> None:
    echo = EchoSettings()
    model, walls = echo_model(echo), Walls(CORRIDOR)
    anywhere, furniture = RangeBias(echo.sd_m), RangeBias(echo.sd_m)
    pings, place = along(100, (0.05, 0.05))
    anywhere.learn(pings, place, (4.0, 0.0, 4.0), walls, model)
    furniture.learn(pings._replace(range_m=0.6 * pings.range_m), place, EXACT, walls, model)
    assert abs(anywhere.mean_m) < 0.005
    assert abs(furniture.mean_m) < 0.005
