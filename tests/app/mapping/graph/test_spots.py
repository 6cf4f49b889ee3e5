# SPDX-License-Identifier: MIT
"""Walls that are heard from one place only, while the trunk turns."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echostep.arrays import Ints
from echostep.path import MeasuredSegment, PathSegment
from echostep_app.mapping.graph.directions import Directions
from echostep_app.mapping.graph.fragments import find_fragments
from echostep_app.mapping.graph.nodes import Nodes, Pings, nodes_of
from echostep_app.mapping.graph.spots import is_spot, with_spots
from echostep_app.mapping.mapper import find_pieces, map_walk

PING_S, HALF_CONE_RAD = 0.07, math.radians(27.5)
SIDE_M, END_M = 1.0, 16.0  # a corridor 2 m wide, that ends after 16 m


def heard_m(x_m: float, axis_rad: float) -> float:
    """Range to the nearest wall of the corridor within the cone; NaN: none."""
    walls = ((0.5 * math.pi, SIDE_M), (-0.5 * math.pi, SIDE_M), (0.0, END_M - x_m))
    inside = [away for normal, away in walls if abs(math.remainder(axis_rad - normal, 2.0 * math.pi)) < HALF_CONE_RAD]
    return min(inside, default=math.nan)


def there_and_back() -> list[MeasuredSegment]:
    """Twice down the corridor, about on the spot within 2 s, and back: once might be a person who stands there."""
    about = [(0.0, 0.0, 0.5 * math.pi)] * 2
    legs = ([(1.0, 0.0, 0.0)] * 14 + about + [(-1.0, math.pi, math.pi)] * 14 + about) * 2
    found, x, heading = [], 0.0, 0.0
    for k, (dx, begin, end) in enumerate(legs):
        turn = end - begin if dx == 0.0 else 0.0
        t_s = k + np.arange(0.0, 1.0, 0.5 * PING_S)
        ranger: Ints = np.arange(len(t_s)) % 2
        pairs = zip((t_s - k).tolist(), ranger.tolist(), strict=True)
        ranges = [
            heard_m(x + share * dx, heading + share * turn + (-0.5 if r else 0.5) * math.pi) for share, r in pairs
        ]
        segment = PathSegment(k, k + 1.0, dx, 0.0, heading, heading + turn, 0.02, math.radians(0.3), k)
        found.append(MeasuredSegment(segment, t_s, ranger, np.array(ranges)))
        x, heading = x + dx, heading + turn
    return found


def test_the_end_of_a_corridor_is_drawn() -> None:
    """No ranger is carried along it; it is drawn across the corridor, where it is."""
    mapped = map_walk(there_and_back())
    assert any(is_spot(mapped.graph.fragments.half_m))
    walls = mapped.drawing.walls
    across = [wall for wall in walls if abs(wall[2] - wall[0]) < 0.1]
    assert across
    for x0, y0, x1, y1 in across:
        assert (x0, x1) == pytest.approx((END_M, END_M), abs=0.1)
        assert min(y0, y1) - 0.1 < 0.0 < max(y0, y1) + 0.1


def swept(middle_rad: float, sweep_rad: float) -> tuple[Nodes, Pings]:
    """Twelve pings of the left ranger 2 m from something, from one place, while the axis sweeps over it."""
    count, nothing = 12, np.zeros(12)
    axis = middle_rad + np.linspace(-0.5, 0.5, count) * sweep_rad
    nodes = Nodes(np.arange(2.0), np.zeros((2, 3)), np.array([0.03]), np.array([0.01]), np.zeros(2))
    whole: Ints = np.zeros(count, np.int64)
    return nodes, Pings(np.zeros((count, 2)), axis, np.full(count, 2.0), whole, nothing, whole, nothing)


@pytest.mark.parametrize(
    ("middle_deg", "sweep_deg", "evidence", "found"),
    [(90.0, 50.0, 20.0, 1), (105.0, 50.0, 20.0, 1), (135.0, 50.0, 20.0, 0), (90.0, 5.0, 20.0, 0), (90.0, 50.0, 1.0, 0)],
    ids=["wall", "nearly", "corner", "no-turn", "no-directions"],
)
def test_what_is_across_a_direction_of_the_building_is_a_wall(
    middle_deg: float, sweep_deg: float, evidence: float, found: int
) -> None:
    """It gets that direction; a corner, what is heard without a turn, and a building without directions give none."""
    nodes, pings = swept(math.radians(middle_deg), math.radians(sweep_deg))
    none, _ = find_pieces(nodes, pings)
    assert not len(none.node)
    spots = with_spots(nodes, pings, none, Directions(0.0, np.zeros(2), evidence))
    assert len(spots.node) == found
    if found:
        assert spots.normal_rad[0] == pytest.approx(0.5 * math.pi)
        assert spots.centre_m[0] == pytest.approx([0.0, 2.0])
        assert (spots.ping == 0).all()


def test_pings_of_a_piece_stay_its_own() -> None:
    """Spots are behind the other fragments, of pings that none of these explains."""
    nodes, pings = nodes_of(there_and_back())
    before, after = find_fragments(nodes, pings), find_pieces(nodes, pings)[0]
    assert len(after.node) > len(before.node)
    explained = before.ping >= 0
    np.testing.assert_array_equal(after.ping[explained], before.ping[explained])
    assert set(after.ping[~explained].tolist()) <= {-1, *range(len(before.node), len(after.node))}
    assert np.bincount(after.ping[after.ping >= 0]).tolist() == after.pings.tolist()
