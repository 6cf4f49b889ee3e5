# SPDX-License-Identifier: MIT
"""The real firmware in the simulator."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from board_runs import Bench


@pytest.fixture
def bench() -> Iterator[Bench]:
    found = Bench()
    yield found
    found.board.close()
    assert not [text for _, text in found.board.trace if text.startswith("contention")]
