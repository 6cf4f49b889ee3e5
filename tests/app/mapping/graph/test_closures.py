# SPDX-License-Identifier: MIT
"""What a closure says: of a corridor its width only, of a posterior what the graph did not know."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echostep.arrays import Floats
from echostep_app.mapping.graph.closures import KNOWN_SD_M, find_closure, gained, pieces, stretches
from echostep_app.mapping.graph.fragments import Fragments
from echostep_app.mapping.graph.graph import FittedWalls, Graph
from echostep_app.mapping.graph.matching import match
from echostep_app.mapping.graph.nodes import Nodes

SHIFTS_M = np.linspace(-0.8, 0.8, 17)


def two_passages(first_m: Floats, second_m: Floats) -> Graph:
    """Two walks along y = 0, 1 m beside one wall, with fragments (begin, end) of it, (k, 2) each."""
    span = np.concatenate([first_m, second_m])
    count = len(span)
    middle, half = span.mean(axis=1), 0.5 * (span[:, 1] - span[:, 0])
    pose = np.column_stack([middle, np.zeros((count, 2))])
    way = np.concatenate([middle[: len(first_m)], 100.0 + middle[len(first_m) :]])
    nodes = Nodes(way, pose, np.full(count - 1, 0.03), np.full(count - 1, 0.01), way)
    ahead, flat, sd_m, sd_rad = np.tile([0.0, 1.0], (count, 1)), np.full(count, 0.5 * math.pi), 0.04, math.radians(1.5)
    found = Fragments(
        np.arange(count), ahead, flat, half, np.full(count, sd_m), np.full(count, sd_rad), np.full(count, 20), np.zeros(0, np.int64)
    )  # fmt: skip
    return Graph(nodes, found, pose, FittedWalls(flat[:1], np.ones(1), np.zeros(count, np.int64)))


def along_the_wall(graph: Graph, count: int) -> Floats:
    """The match of all fragments but the first `count` with these, at shifts along the wall."""
    which = np.arange(len(graph.fragments.node))
    new, old = pieces(graph, which[count:]), stretches(graph, which[:count])
    return match(new, old, np.zeros(2), SHIFTS_M, np.zeros(1))[0][:, len(SHIFTS_M) // 2]


def test_a_wall_that_is_cut_elsewhere_says_nothing_along_it() -> None:
    """Fragments end after 2.5 m wherever that is; cuts 0.6 m off were matched with each other by 16 nats a metre."""
    edges, cuts = np.arange(-10.0, 10.1, 2.5), np.arange(-4.4, 5.0, 2.5)
    first = np.column_stack([edges[:-1] + 0.1, edges[1:]])
    second = np.column_stack([cuts[:-1] + 0.1, cuts[1:]])
    found = along_the_wall(two_passages(first, second), len(first))
    assert found.max() > 10.0
    assert np.ptp(found) < 0.5


def test_a_door_says_where_along_the_wall_it_is() -> None:
    """The same door 0.3 m farther on: that shift fits best."""
    first = np.array([(-6.0, -3.0), (-2.9, 0.0), (0.9, 4.0), (4.1, 6.0)])
    second = np.array([(-3.0, -0.3), (0.6, 3.0)])
    found = along_the_wall(two_passages(first, second), len(first))
    best = SHIFTS_M[found > found.max() - 0.5]
    assert best.mean() == pytest.approx(0.3, abs=0.11)
    assert np.ptp(best) < 0.5


def test_a_match_is_what_the_posterior_has_beyond_the_prior() -> None:
    """A normal prior times a normal likelihood of x, y and heading."""
    before = np.diag([0.2**2, 0.3**2, 0.02**2])
    before[0, 1] = before[1, 0] = 0.5 * 0.2 * 0.3
    said, alone = np.diag([1.0 / 0.05**2, 1.0 / 0.08**2, 1.0 / 0.01**2]), np.array([0.2, -0.4, 0.03])
    after = np.asarray(np.linalg.inv(np.linalg.inv(before) + said), np.float64)
    found = gained(after @ said @ alone, after, before)
    assert found is not None
    np.testing.assert_allclose(found[0], alone, atol=1e-9)
    np.testing.assert_allclose(found[1], said, rtol=1e-6, atol=1e-6)


def test_what_the_graph_knew_is_no_news() -> None:
    """Along a corridor the posterior is as narrow as the prior, 0.12 m: only the width is said, whatever the mean along it is."""
    before, after = np.diag([0.12**2, 0.2**2, 0.02**2]), np.diag([0.11**2, 0.05**2, 0.019**2])
    assert KNOWN_SD_M > 0.12
    found = gained(np.array([0.1, 0.15, 0.0]), after, before)
    assert found is not None
    assert found[1][0] == pytest.approx([0.0, 0.0, 0.0])
    assert found[1][1, 1] == pytest.approx(1.0 / 0.05**2 - 1.0 / 0.2**2)
    same = gained(np.zeros(3), before, before)
    assert same is not None
    assert not same[1].any()  # the place is recognised, nothing else
    assert gained(np.zeros(3), 9.0 * before, 9.0 * before) is None  # known on no axis


AWAY_M, AWAY_SD_M = 60.0, 0.4  # of path between two passages, and its standard deviation
BENT_M = 0.25  # from the second passage to the third across the corridor, by which the graph is wrong


def three_passages() -> Graph:
    """Along y = 0, 0.5 and 0.1 m: the first hears a wall on its right, the others one on their left, 1 m away, the third as if by BENT_M farther."""
    x = np.arange(0.5, 8.0)
    count, walls_m = len(x), (-1.5, 1.5, 1.5 + BENT_M)
    y = np.repeat([0.0, 0.5, 0.1], count)
    side = np.repeat([-0.5 * math.pi, 0.5 * math.pi, 0.5 * math.pi], count)
    pose = np.column_stack([np.tile(x, 3), y, np.zeros(3 * count)])
    to_wall = np.column_stack([np.zeros(3 * count), np.repeat(walls_m, count) - y])
    way = np.concatenate([k * (count + AWAY_M) + x for k in range(3)])
    sd_m = np.where(np.diff(way) > 1.5, AWAY_SD_M, 0.005)
    nodes = Nodes(way, pose, sd_m, np.full(len(sd_m), 1e-4), way)
    n, flat = len(way), np.ones(3 * count)
    found = Fragments(
        np.arange(n), to_wall, side, 0.5 * flat, 0.04 * flat, 0.03 * flat, np.full(n, 20), np.zeros(0, np.int64)
    )
    graph = Graph(nodes, found, pose, FittedWalls(np.zeros(0), np.zeros(0), np.full(n, -1)))
    graph.solve()
    return graph


def test_a_return_is_to_the_passage_whose_walls_are_matched() -> None:
    """Not to one that is nearer and heard something else: nothing ties the two."""
    graph = three_passages()
    count = len(graph.nodes) // 3
    closure = find_closure(graph, 2 * count, 3 * count, float(graph.nodes.way_m[2 * count]) - 20.0)
    assert closure is not None
    assert count <= closure.old < 2 * count
    assert closure.between[1] == pytest.approx(0.1 - BENT_M - 0.5, abs=0.05)
