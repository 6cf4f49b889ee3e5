# SPDX-License-Identifier: MIT
"""Places of a cloud: the compiled pass against plain numpy."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from echostep.localization.cloud_estimate import weight_about
from echostep.localization.particles import places as module
from echostep.localization.particles.places import hypotheses
from echostep.particles.limits import HALF_STOREY_M
from echostep.plan import Pose
from naive.places import places


@given(st.integers(0, 2**32 - 1), st.integers(1, 400), st.integers(1, 3))
def test_places_are_those_of_the_plain_code(seed: int, count: int, levels: int) -> None:
    rng = np.random.default_rng(seed)
    x, y = rng.normal(0.0, 1.0, count) + 9.0 * rng.integers(0, 4, count), rng.normal(-3.0, 2.0, count)
    level, heading, weight = rng.integers(0, levels, count), rng.normal(0.0, 2.0, count), rng.random(count) + 1e-3
    weight /= weight.sum()
    found = [dataclasses.astuple(h) for h in hypotheses(x, y, level, heading, weight)]
    expected = places(x, y, level, heading, weight)
    assert len(found) == len(expected)
    for one, other in zip(found, expected, strict=True):
        assert one == pytest.approx(other, abs=1e-9)


def test_a_cloud_that_spans_a_country_needs_no_more_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MOST_SQUARES", 100)
    x, y = np.array([0.0, 0.5, 4e5]), np.array([0.0, 0.0, -4e5])
    found = hypotheses(x, y, np.zeros(3, np.int64), np.zeros(3), np.array([0.3, 0.3, 0.4]))
    assert [(h.probability, h.x_m) for h in found] == [pytest.approx((0.6, 0.25)), pytest.approx((0.4, 4e5))]


def test_weight_about_a_place_is_of_its_level() -> None:
    x, z = np.array([0.0, 2.0, 0.0, 9.0]), np.array([0.0, 0.0, HALF_STOREY_M, 0.0])
    cloud: Any = SimpleNamespace(map_x_m=x, y_m=np.zeros(4), z_m=z, weight=np.array([0.1, 0.2, 0.3, 0.4]))
    assert weight_about(cloud, Pose(0.0, 0.0, 0.0), 0.0) == pytest.approx((0.1, 0.3))
