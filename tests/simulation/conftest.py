# SPDX-License-Identifier: MIT
"""One walk for all tests of the simulation."""

from __future__ import annotations

import numpy as np
import pytest

from echostep_simulation.people.walker import Person, Walk, walk
from simulation.simulated import WAYPOINTS


@pytest.fixture(scope="module")
def l_walk() -> Walk:
    return walk(WAYPOINTS, Person(), np.random.default_rng(1))
