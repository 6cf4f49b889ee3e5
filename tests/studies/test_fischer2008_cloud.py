# SPDX-License-Identifier: MIT
"""The cloud of the returns: beliefs of the chosen particles."""

from __future__ import annotations

import copy

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from echostep.arrays import Ints
from echostep.beacons.model import BeaconSettings
from echostep_studies.fischer2008.beacon_cloud import new_cloud, resample_beliefs


def expect_the_chosen(rng: np.random.Generator, chosen: Ints) -> None:
    beliefs = new_cloud(len(chosen), 2, 0.0, 0.0, BeaconSettings(), rng).beacons.beliefs
    for part in beliefs:
        part[:] = rng.standard_normal(part.shape)
    before = copy.deepcopy(beliefs)
    resample_beliefs(beliefs, chosen)
    for part, old in zip(beliefs, before, strict=True):
        assert (part == old[chosen]).all()


@pytest.mark.parametrize("chosen", [(0, 1), (1, 1), (0, 0)])
def test_inherit_copies_what_the_chosen_believed(chosen: tuple[int, int]) -> None:
    expect_the_chosen(np.random.default_rng(1), np.array(chosen))


@given(st.integers(0, 2**32 - 1), st.integers(1, 30))
def test_beliefs_are_those_of_the_chosen(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    expect_the_chosen(rng, np.sort(rng.integers(0, n, n)))
