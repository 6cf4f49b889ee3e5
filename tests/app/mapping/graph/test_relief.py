# SPDX-License-Identifier: MIT
"""Walls that are not flat: what is known of their pieces, and what is tied to one wall (simulated)."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echostep.arrays import Floats, Ints
from echostep.path import MeasuredSegment, PathSegment
from echostep_app.mapping.graph.directions import find_relief
from echostep_app.mapping.graph.fragments import find_fragments
from echostep_app.mapping.graph.graph import FittedWalls, Graph
from echostep_app.mapping.graph.nodes import nodes_of

LENGTH_M = 120


@pytest.mark.parametrize("relief_m", [0.0, 0.12])
def test_pieces_state_how_far_they_are_askew(relief_m: float) -> None:
    """Along a straight wall, bare or with shelves before it, nearly all pieces are within three of their standard deviations of its direction; those
    of the bare wall are known to 3 degrees.
    """
    nodes, pings = nodes_of(along(relief_m, np.random.default_rng(1)))
    fragments, directions = find_relief(nodes, find_fragments(nodes, pings))
    off = np.abs(fragments.normal_rad - np.sign(fragments.normal_rad) * 0.5 * math.pi)
    assert len(off) > 40
    assert np.mean(off < 3.0 * fragments.sd_rad) > 0.95
    assert directions.evidence > 0.0
    if not relief_m:
        assert np.degrees(np.median(fragments.sd_rad)) < 3.0


def along(relief_m: float, rng: np.random.Generator) -> list[MeasuredSegment]:
    """Straight on at 1 m/s between two walls, before which shelves of 0.8 m stand out by a normal distribution."""
    out_m = relief_m * rng.standard_normal((2, 2 * LENGTH_M))
    found = []
    for k in range(LENGTH_M):
        t_s = k + np.arange(0.0, 1.0, 0.036)
        ranger = np.arange(len(t_s)) % 2
        range_m = 1.5 + out_m[ranger, (t_s / 0.8).astype(np.int64)] + 0.025 * rng.standard_normal(len(t_s))
        segment = PathSegment(k, k + 1.0, 1.0, 0.0, 0.0, 0.0, 0.02, math.radians(0.3), k)
        found.append(MeasuredSegment(segment, t_s, ranger, range_m))
    return found


def test_a_piece_that_does_not_fit_its_wall_bends_nothing() -> None:
    """One of many pieces on a wall is askew by 15 degrees; the path's own turns are known to 3 degrees."""
    straight = bent(0.0)
    assert np.degrees(np.abs(bent(math.radians(15.0)) - straight)).max() < 0.3
    assert np.degrees(np.abs(bent(math.radians(1.0)) - straight)).max() > 0.3


def bent(askew_rad: float) -> Floats:
    """Headings of a straight path beside a wall, when the piece in its middle is turned."""
    turn_sd = math.radians(3.0)
    segments = [
        MeasuredSegment(PathSegment(k, k + 1.0, 1.0, 0.0, 0.0, 0.0, 0.02, turn_sd, k), *_heard(k)) for k in range(11)
    ]
    nodes, pings = nodes_of(segments)
    fragments = find_fragments(nodes, pings)
    middle = len(fragments.node) // 2
    normal_rad = fragments.normal_rad.copy()
    normal_rad[middle] += askew_rad
    of = np.zeros(len(normal_rad), np.int64)
    walls = FittedWalls(np.array([0.5 * math.pi]), np.array([1.5]), of)
    graph = Graph(nodes, fragments._replace(normal_rad=normal_rad), nodes.pose.copy(), walls)
    graph.solve()
    return graph.pose[:, 2]


def _heard(k: int) -> tuple[Floats, Ints, Floats]:
    t_s = k + np.arange(0.0, 1.0, 0.07)
    return t_s, np.zeros(len(t_s), np.int64), np.full(len(t_s), 1.5)
