# SPDX-License-Identifier: MIT
"""The cloud of the returns: beliefs of the chosen particles."""

from __future__ import annotations

import copy

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from echostep.beacons.model import BeaconSettings
from echostep_studies.fischer2008.beacon_cloud import new_cloud, resample_beliefs


@given(st.integers(0, 2**32 - 1), st.integers(1, 30))
def test_beliefs_are_those_of_the_chosen(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    chosen = np.sort(rng.integers(0, n, n))
    beliefs = new_cloud(n, 2, 0.0, 0.0, BeaconSettings(), rng).beacons.beliefs
    for part in beliefs:
        part[:] = rng.standard_normal(part.shape)
    before = copy.deepcopy(beliefs)
    resample_beliefs(beliefs, chosen)
    for part, old in zip(beliefs, before, strict=True):
        assert (part == old[chosen]).all()
