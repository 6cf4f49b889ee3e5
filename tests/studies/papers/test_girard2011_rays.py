# SPDX-License-Identifier: MIT
"""Ranges by a fan of plain rays against the ranges of a cone."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from echostep.arrays import Floats
from echostep.walls.echo_sources import Walls
from echostep_studies.papers.girard2011_rays import lambda_ray_ranges
from naive import walls as naive
from walls.test_walls import plans


@pytest.mark.long
@settings(max_examples=150, deadline=None)
@given(plans(), st.sampled_from([7, 7, 7, 1, 3, 20]), st.sampled_from([0.0, 0.5, 1.0, 2.0]))
def test_cone_readings_agree_with_plain_rays(
    plan: tuple[Floats, np.random.Generator], rays: int, prepared: float
) -> None:
    walls, rng = plan
    aperture = math.radians(55.0)
    owner = Walls(walls, prepared * 0.5 * aperture / rays)
    x, y, heading = rng.uniform(-2, 10, 12), rng.uniform(-2, 10, 12), rng.uniform(-4, 4, 12)
    index = owner.near(x[:9], y[:9])
    found = lambda_ray_ranges(x, y, heading, index, rays, aperture, 6.0)
    for i, row in enumerate(found):
        for axis, reading in zip((math.pi / 2, -math.pi / 2), row, strict=True):
            expected = naive.cone_reading(x[i], y[i], heading[i] + axis, walls, rays, aperture, 6.0)
            assert reading == pytest.approx(expected, abs=1e-9)


@pytest.mark.long
def test_many_poses_read_what_each_would_alone() -> None:
    """Many in a tile, in no order, some nowhere."""
    rng = np.random.default_rng(5)
    walls = rng.uniform(0.0, 6.0, (20, 4))
    owner = Walls(walls, 0.5 * math.radians(55.0) / 7)
    x, y, heading = rng.uniform(2.0, 4.0, 768), rng.uniform(2.0, 3.0, 768), rng.uniform(-4, 4, 768)
    x[::50], heading[7::50] = np.nan, np.inf
    index = owner.near(x, y)
    cone = 7, math.radians(55.0), 6.0
    found = lambda_ray_ranges(x, y, heading, index, *cone)
    alone = [lambda_ray_ranges(x[i : i + 1], y[i : i + 1], heading[i : i + 1], index, *cone)[0] for i in range(len(x))]
    assert found == pytest.approx(np.array(alone), abs=1e-9)
    assert (found[::50] == 6.0).all()
    assert (found[7::50] == 6.0).all()
    assert len(np.unique(found)) > 256
