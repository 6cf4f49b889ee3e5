# SPDX-License-Identifier: MIT
"""One short walk for all tests of a module."""

from __future__ import annotations

import pytest

from echostep.ports.chunks import Chunk
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.scenario import Scenario
from page.frames import PLAN


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    """A simulated walk of 11 m on the demo's plan."""
    return Scenario(PLAN, ((2.0, 7.5), (9.5, 7.5), (9.5, 10.8)), 5, PythonBoard(seed=5))


@pytest.fixture(scope="module")
def chunks(scenario: Scenario) -> list[Chunk]:
    return list(scenario.chunks())
