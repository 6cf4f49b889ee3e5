# SPDX-License-Identifier: MIT
"""Ends of drawn walls where they meet others."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echostep_app.mapping.walls.evidence import CELL_M, Cells
from echostep_app.mapping.walls.lines import Lines
from echostep_app.mapping.walls.segments import Run, segments_of

CELLS = 500


def _segments(lines: list[tuple[float, float]], runs: list[Run]) -> list[list[float]]:
    """Ends (n, 4) of runs on lines (normal in radians, distance in metres) that no ping passed."""
    normal, rho = np.array(lines).T
    none, count = np.zeros(len(lines)), len(lines)
    cells = Cells(
        np.zeros((count, CELLS)),
        np.zeros((count, CELLS)),
        none - CELLS * CELL_M / 2.0,
        np.full(count, CELLS),
        np.zeros(0, np.intp),
    )
    found = segments_of(Lines(normal, rho, none, none, none, none == 0.0), runs, cells)
    ends: list[list[float]] = found.tolist()
    return ends


@pytest.mark.parametrize("apart_m", [-0.03, 0.03])
def test_a_wall_ends_at_the_one_that_stands_there(apart_m: float) -> None:
    """Not at another on nearly the same line, that begins 1.5 m farther along it, on either side."""
    across, along = math.pi / 2.0, 0.0
    runs = [Run(0, 1.0, 4.0, 50.0), Run(1, -2.0, 5.0, 50.0), Run(2, -9.0, -1.5, 50.0)]
    (wall, *_) = _segments([(along, 0.0), (across, 0.9), (across, 0.9 + apart_m)], runs)
    assert min(wall[1], wall[3]) == pytest.approx(0.9)


def test_a_wall_alone_is_extended_to_the_line_of_the_next() -> None:
    """A corner that neither wall was heard up to."""
    runs = [Run(0, 1.0, 4.0, 50.0), Run(1, -6.0, -1.0, 50.0)]
    (wall, other) = _segments([(0.0, 0.0), (math.pi / 2.0, 0.2)], runs)
    assert min(wall[1], wall[3]) == pytest.approx(0.2)
    assert min(abs(other[0]), abs(other[2])) == pytest.approx(0.0, abs=1e-9)
