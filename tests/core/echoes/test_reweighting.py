# SPDX-License-Identifier: MIT
"""The kernels that weigh particles, against the same formulas written out: one ping of one wall, and a segment with its pings among walls."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from echostep.echoes.likelihood import GATE_SD, SURE_COS, EchoSettings, echo_density, echo_model, exponential, logarithm
from echostep.echoes.reweighting import CloudModel, MoveProgress, propagate_and_reweight
from echostep.particles.arrays import Move, ParticleArrays, PingBatch
from echostep.walls.echo_sources import Walls, echo_sources, list_sources, one_receiver, unit_at
from echostep.walls.source_blocks import set_receiver
from naive.segment import Particle, follow

MODEL = echo_model(EchoSettings())
WALL = Walls(np.array([[-20.0, 2.0, 20.0, 2.0]]))
SPAN_M = MODEL.maximum_m - MODEL.minimum_m


class OnePing(NamedTuple):
    """The k-th values of a `PingBatch`."""

    range_m: float
    power: float
    travel_m: float
    stray: float
    missed: float
    alike: float
    unplanned: float


def written_out(distance_m: float, hidden: float, ping: OnePing) -> tuple[float, float]:
    """Likelihood of a ping of one wall straight ahead, and the probability that the view is hidden after it."""
    level_db = 20.0 * math.log10(6.0 / distance_m) + 2.6 * (6.0 - distance_m)
    heard = 1.0 / (1.0 + math.exp(-level_db / 2.0))
    if ping.range_m > 0.0:
        even, off = 0.8 / SPAN_M, abs(ping.range_m - distance_m) / 0.036
        normal = math.exp(-0.5 * off**2) / (0.036 * math.sqrt(2.0 * math.pi)) if off < GATE_SD else 0.0
        planned = heard * normal + (1.0 - heard) * ping.stray * 0.5 * (ping.alike + 1.0 / SPAN_M)
    else:
        even, planned = 0.2, (1.0 - ping.stray) * (1.0 - heard)
    before = 0.15 + math.exp(-ping.travel_m / 0.6) * (hidden - 0.15)
    of_plan = 0.95 * (planned + ping.missed) ** ping.power + 0.05 * (even + ping.missed) ** ping.power
    likelihood = before * ping.unplanned + (1.0 - before) * of_plan
    return likelihood, before * ping.unplanned / likelihood


@given(
    st.lists(st.tuples(st.floats(-3.0, 1.5), st.floats(0.0, 1.0)), min_size=1, max_size=6),
    st.floats(0.2, 5.9) | st.just(0.0), st.floats(0.05, 1.0), st.floats(0.01, 3.0),
    st.floats(0.0, 8.0), st.floats(0.05, 3.0), st.floats(0.05, 0.5),
)  # fmt: skip
@settings(max_examples=60)
def test_the_kernel_is_the_formula(
    places: list[tuple[float, float]],
    range_m: float,
    power: float,
    travel_m: float,
    alike: float,
    unplanned: float,
    stray: float,
) -> None:
    missed = 0.02 if range_m == 0.0 else 0.0
    ping = OnePing(range_m, power, travel_m, stray, missed, alike, unplanned)
    y_m, hidden = (np.array(column) for column in zip(*places, strict=True))
    zeros = np.zeros(len(y_m))
    particles = ParticleArrays(zeros.copy(), y_m.copy(), zeros.copy(), np.ones(len(y_m)), zeros.copy())
    expected = [written_out(2.0 - y, h, ping) for y, h in zip(y_m.tolist(), hidden.tolist(), strict=True)]
    range_1, power_1, *others = (np.array([value]) for value in ping)
    pings = PingBatch(np.ones(1), np.array([0.5 * math.pi]), range_1, power_1, np.zeros(1, np.int64), *others)
    move, noise, log_evidence = Move(0.0, 0.0, 0.0, 0.0), np.zeros((5, len(y_m))), np.zeros(1)
    propagate_and_reweight(
        particles, move, noise, MoveProgress(1.0, 0), pings, CloudModel(6.0, 0.0, MODEL), WALL.near(zeros, y_m), hidden[None], log_evidence
    )  # fmt: skip
    likelihood = np.array([each[0] for each in expected])
    assert log_evidence[0] == pytest.approx(math.log(likelihood.mean()), abs=1e-6)
    assert particles.log_weight == pytest.approx(np.log(likelihood / likelihood.max()), abs=1e-6)
    assert hidden == pytest.approx([each[1] for each in expected], abs=1e-6)


# The kernel neglects sources of a probability up to 3e-4: with many outliers, and powers near 1, that is below 1 % of a likelihood.
ROUGH = echo_model(EchoSettings(sd_m=0.1, outlier=0.5))
ROOMS = np.array(
    [[0.0, 0.0, 9.0, 0.0], [9.0, 0.0, 9.0, 4.0], [9.0, 4.0, 0.0, 4.0], [0.0, 4.0, 0.0, 0.0], [4.0, 0.0, 4.0, 1.5], [4.0, 2.4, 4.0, 4.0]]
)  # fmt: skip


@given(st.integers(0, 2**32), st.sampled_from([1.0, 30.0]))
@settings(max_examples=25, deadline=None)
def test_a_segment_is_its_moves_and_pings_one_by_one(seed: int, turn_sd_deg: float) -> None:
    rng = np.random.default_rng(seed)
    n, k, cost = 8, 5, 6.0
    arrays = ParticleArrays(
        rng.uniform(0.5, 8.5, n), rng.uniform(0.5, 3.5, n), rng.uniform(-3.0, 3.0, n), 1.0 + 0.01 * rng.standard_normal(n),
        -rng.exponential(1.0, n),
    )  # fmt: skip
    arrays.log_weight[0] = 0.0
    hidden, noise = rng.uniform(0.0, 1.0, (2, n)), rng.standard_normal((5, n))
    noise *= np.array([[0.02], [0.02], [math.radians(turn_sd_deg)], [0.001], [1.0]])
    pings = PingBatch(
        np.sort(rng.uniform(0.0, 1.0, k)), rng.uniform(-3.0, 3.0, k), rng.uniform(0.3, 5.0, k), rng.uniform(0.8, 1.0, k),
        rng.integers(0, 2, k), rng.uniform(0.02, 0.3, k), rng.uniform(0.05, 0.5, k), np.zeros(k), rng.uniform(0.1, 2.0, k), rng.uniform(0.1, 2.0, k),
    )  # fmt: skip
    (dx_m, dy_m), (bend_x_m, bend_y_m) = rng.uniform(-0.8, 0.8, 2), rng.uniform(-0.2, 0.2, 2)
    move = Move(dx_m, dy_m, 0.02, 0.02, 0.0, bend_x_m, bend_y_m)
    expected = [Particle(*row) for row in zip(*(a.tolist() for a in arrays), *hidden.tolist(), strict=True)]
    wanted = follow(expected, move, noise, pings, ROUGH, ROOMS, cost)
    log_evidence, index = np.zeros(k), Walls(ROOMS).near(arrays.x_m, arrays.y_m, 2.0)
    progress, _, log_passed = propagate_and_reweight(
        arrays, move, noise, MoveProgress(0.0, 0), pings, CloudModel(cost, 0.0, ROUGH), index, hidden, log_evidence
    )  # fmt: skip
    assert progress == MoveProgress(1.0, k)
    assert arrays.x_m == pytest.approx([p.x for p in expected], abs=1e-9)
    assert arrays.y_m == pytest.approx([p.y for p in expected], abs=1e-9)
    assert arrays.log_weight == pytest.approx([p.log_weight for p in expected], abs=0.02)
    assert hidden == pytest.approx(np.array([p.hidden for p in expected]).T, abs=0.02)
    assert log_evidence == pytest.approx(wanted.log_evidence, abs=0.02)
    assert log_passed == pytest.approx(wanted.log_passed, abs=0.02)


def test_a_cloud_that_leaves_the_tables_asks_for_them_before_its_ping() -> None:
    arrays = ParticleArrays(np.array([1.0, 1.0]), np.array([1.0, 2.0]), np.zeros(2), np.ones(2), np.zeros(2))
    one = np.ones(1)
    pings = PingBatch(0.5 * one, one, one, one, np.zeros(1, np.int64), one, 0.1 * one, 0.0 * one, one, one)
    walls, model, memory = Walls(ROOMS), CloudModel(6.0, 0.0, ROUGH), (np.zeros((2, 2)), np.zeros(1))
    progress = MoveProgress(0.0, 0)
    for expected in (MoveProgress(0.5, 0), MoveProgress(1.0, 1)):
        move, index = Move(4.0, 0.0, 0.0, 0.0), walls.near(arrays.x_m, arrays.y_m)
        progress, *_ = propagate_and_reweight(arrays, move, np.zeros((5, 2)), progress, pings, model, index, *memory)
        assert progress == expected
    assert arrays.x_m == pytest.approx(5.0)


@given(st.integers(0, 2**32))
@settings(max_examples=200, deadline=None)
def test_sources_that_are_left_out_change_no_density(seed: int) -> None:
    """The density ends at a wall that surely answers, and an edge out of reach is not detected."""
    rng = np.random.default_rng(seed)
    x, y, axis = rng.uniform(0.1, 8.9), rng.uniform(0.1, 3.9), rng.uniform(-3.0, 3.0)
    index = Walls(ROOMS).near(np.array([x]), np.array([y]))
    every, first = one_receiver(), one_receiver()
    count = echo_sources(x, y, axis, index, every[0])
    set_receiver(first[0], 0, x, y, math.cos(axis), math.sin(axis))
    limits = (MODEL.sure_m, SURE_COS, MODEL.edge_m)
    fewer = list_sources(1, unit_at(x, y, axis, index), index, limits, first[0])
    assert fewer <= count
    for range_m in (0.0, *rng.uniform(0.2, 6.0, 5), *every[1][:count]):
        densities = [echo_density(range_m, n, *sources[1:], MODEL) for n, sources in ((count, every), (fewer, first))]
        assert densities[0] == pytest.approx(densities[1], abs=1e-12)


@given(st.floats(-700.0, 700.0), st.floats(1e-300, 1e300))
def test_exponential_and_logarithm_are_those_of_libm(x: float, y: float) -> None:
    assert exponential(x) == pytest.approx(math.exp(x), rel=1e-8)
    assert exponential(-1e9) == exponential(-700.0)
    assert logarithm(y) == pytest.approx(math.log(y), abs=1e-9)
