# SPDX-License-Identifier: MIT
"""The core's tests need the core, the simulation in the source tree, and nothing that is built on the two."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ABOVE = ("echostep_app", "echostep_studies")


@pytest.fixture(scope="session", autouse=True)
def the_core_alone(request: pytest.FixtureRequest) -> Iterator[None]:
    """A run of these tests alone has imported neither app nor studies."""
    yield
    if all(Path(__file__).parent in item.path.parents for item in request.session.items):
        assert not sorted(name for name in sys.modules if name.startswith(ABOVE))
