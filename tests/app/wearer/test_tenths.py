# SPDX-License-Identifier: MIT
"""Tenths of a second: against a plain computation, and the same however the samples are cut."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from echostep.arrays import Floats
from echostep_app.wearer.tenths import LEAST_SAMPLES, TENTH_S, Tenth, Tenths


def samples(seed: int, count: int = 400) -> tuple[Floats, Floats, Floats, Floats]:
    """At about 200 Hz, with a gap, a time that goes back, and missing values."""
    rng = np.random.default_rng(seed)
    t_s = np.cumsum(rng.uniform(0.003, 0.007, count))
    t_s[count // 2 :] += 3.3
    t_s[count // 3] -= 0.3
    force, rate, beside = rng.normal(0.0, 9.0, (3, count, 3))
    beside[count // 4 : count // 4 + 30] = np.nan
    return t_s, force, rate, beside


@given(st.lists(st.integers(0, 400), max_size=30), st.integers(0, 100))
@settings(deadline=None)
def test_tenths_do_not_depend_on_portions_to_the_last_bit(cuts: list[int], seed: int) -> None:
    t_s, force, rate, beside = samples(seed)
    whole, cut = Tenths(), Tenths()
    edges = [0, *sorted(cuts), len(t_s)]
    found = []
    for a, b in zip(edges, edges[1:], strict=False):
        found += [(a + k, tenth) for k, tenth in cut.cut(t_s[a:b], force[a:b], rate[a:b], beside[a:b])]
    assert repr(found) == repr(whole.cut(t_s, force, rate, beside))  # NaN is equal to NaN here


def plain(t_s: Floats, force: Floats, rate: Floats, beside: Floats) -> Tenth:
    """One tenth, by its definition."""
    n = len(t_s)
    mean = [sum(column) / n for column in force.T]
    peak = max(math.sqrt(sum(x * x for x in row)) for row in force.tolist())
    unrest = math.sqrt(sum(math.dist(row, mean) ** 2 for row in force.tolist()) / n)
    turning = math.sqrt(sum(math.hypot(*row) ** 2 for row in rate.tolist()) / n)
    end_s = TENTH_S * (math.floor(t_s[0] / TENTH_S) + 1.0)
    return Tenth(end_s, tuple(mean), peak, unrest, tuple(rate.mean(axis=0)), turning, tuple(beside.mean(axis=0)))


def test_a_tenth_is_what_its_definition_says() -> None:
    rng = np.random.default_rng(1)
    t_s: Floats = np.arange(5.001, 5.2255, 0.005)
    force, rate, beside = rng.normal(0.0, 9.0, (3, 45, 3))
    found = Tenths().cut(t_s, force, rate, beside)
    assert [index for index, _ in found] == [20, 40]
    for k, (_, tenth) in enumerate(found):
        part = slice(20 * k, 20 * k + 20)
        expected = plain(t_s[part], force[part], rate[part], beside[part])
        for ours, theirs in zip(tenth, expected, strict=True):
            assert ours == pytest.approx(theirs, rel=1e-12)


def test_too_few_samples_are_no_tenth_and_missing_ones_are_told() -> None:
    few = np.array([1.01, 1.02, 1.2])[:LEAST_SAMPLES]
    assert not Tenths().cut(few, np.ones((3, 3)), np.ones((3, 3)))
    t_s: Floats = np.arange(1.001, 1.1025, 0.005)
    ((_, tenth),) = Tenths().cut(t_s, np.full((21, 3), np.nan), np.ones((21, 3)))
    assert math.isnan(tenth.force[0])
    assert math.isnan(tenth.peak)
    assert tenth.turning == pytest.approx(math.sqrt(3.0))
