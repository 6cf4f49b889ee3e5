# SPDX-License-Identifier: MIT
"""Mapping kernels against their slow twins."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echostep_app.mapping.graph.fragments import fit_line
from echostep_app.mapping.graph.matching import Pieces, match
from echostep_app.mapping.walls.evidence import cell_counts
from echostep_app.mapping.walls.lines import Lines
from naive import mapping as naive


def pieces(rng: np.random.Generator, count: int) -> Pieces:
    """Random fragments in a room of 6 x 6 m, most along its axes."""
    normal = rng.integers(0, 4, count) * 0.5 * math.pi + rng.normal(0.0, 0.2, count)
    x, y = rng.uniform(-3.0, 3.0, (2, count))
    return Pieces(
        x, y, normal, rng.uniform(0.2, 1.2, count), rng.uniform(0.01, 0.1, count), rng.uniform(0.4, 3.0, count)
    )


@pytest.mark.parametrize("seed", range(3))
def test_a_match_is_that_of_its_twin(seed: int) -> None:
    """Eight fragments against twenty, at 3 turns and 49 shifts."""
    rng = np.random.default_rng(seed)
    new, old, pivot = pieces(rng, 8), pieces(rng, 20), rng.uniform(-1.0, 1.0, 2)
    shifts, turns = np.linspace(-0.6, 0.6, 7), np.array([-0.05, 0.0, 0.05])
    expected = naive.match(new, old, pivot, shifts, turns)
    assert np.ptp(expected) > 1.0
    np.testing.assert_allclose(match(new, old, pivot, shifts, turns), expected, atol=1e-9)


def test_the_right_shift_fits_best() -> None:
    """Fragments of a room, seen again 0.3 m too far right and 0.2 m too low."""
    rng = np.random.default_rng(7)
    old = pieces(rng, 30)
    new = old._replace(x_m=old.x_m - 0.3, y_m=old.y_m + 0.2)
    shifts = np.linspace(-0.5, 0.5, 11)
    a, b = np.unravel_index(np.argmax(match(new, old, np.zeros(2), shifts, np.zeros(1))[0]), (11, 11))
    assert (shifts[a], shifts[b]) == pytest.approx((0.3, -0.2))


@pytest.mark.parametrize("seed", range(3))
def test_cells_are_those_of_the_twin(seed: int) -> None:
    """Pings, a fifth of them without an echo, among six lines."""
    rng = np.random.default_rng(seed)
    low = rng.uniform(-4.0, 0.0, 6)
    lines = Lines(
        rng.uniform(0.0, math.pi, 6), rng.uniform(-2.0, 2.0, 6), np.full(6, 0.03), low, low + rng.uniform(1.0, 5.0, 6), np.ones(6, np.bool_)
    )  # fmt: skip
    poses = np.column_stack([rng.uniform(-2.0, 2.0, (500, 2)), rng.uniform(-math.pi, math.pi, 500)])
    range_m = np.where(rng.random(500) < 0.2, np.nan, rng.uniform(0.2, 3.0, 500))
    every = np.ones(500, np.bool_)
    heard, passed = naive.cell_counts(lines, poses, range_m)
    cells = cell_counts(lines, poses, range_m, every, every)
    for counts, expected in ((cells.heard, heard), (cells.passed, passed)):
        assert {(int(a), int(b)): int(counts[a, b]) for a, b in zip(*np.nonzero(counts), strict=True)} == expected
    assert heard
    assert passed


def test_a_line_touches_the_circles_of_its_echoes() -> None:
    """A straight walk beside a wall 2 degrees askew: the tangent of the circles is the wall."""
    at = np.column_stack([np.arange(0.0, 2.0, 0.1), np.zeros(20)])
    normal, rho = math.radians(92.0), 1.3
    range_m = rho - at @ [math.cos(normal), math.sin(normal)]
    axis = np.full(20, math.radians(95.0))
    found = fit_line(at, axis, range_m, np.arange(20))
    assert found[:2] == pytest.approx((normal, rho), abs=1e-3)
    assert found[2] < 1e-3
