# SPDX-License-Identifier: MIT
"""Echoes of people beside the wearer are no walls that have a direction."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echostep.arrays import Ints
from echostep.path import MeasuredSegment, PathSegment
from echostep_app.mapping.graph import directions
from echostep_app.mapping.graph.directions import density_along_path, find_directions, people_share
from echostep_app.mapping.graph.fragments import find_fragments
from echostep_app.mapping.graph.nodes import Nodes, Pings, nodes_of

HALL_M, CORRIDOR_M = 160, 40
ACROSS_RAD = math.radians(35.0)  # of the way through the hall against the corridor
TURN_SD_RAD = math.radians(0.6)  # of each metre, as stated


def across_a_hall(every_m: int) -> tuple[Nodes, Pings]:
    """A way at 1 m/s through a hall, with echoes from 1 m to the left or the right in one second of `every_m`, then along a corridor."""
    found: list[MeasuredSegment] = []
    for k in range(HALL_M + CORRIDOR_M):
        hall = k < HALL_M
        heading = ACROSS_RAD if hall else 0.0
        t_s = k + np.arange(0.0, 1.0, 0.04)
        ranger: Ints = np.arange(len(t_s)) % 2
        beside = (ranger == (k // every_m) % 2) & (k % every_m == 0) if hall else np.ones(len(t_s), np.bool_)
        after = heading if k != HALL_M - 1 else 0.0
        segment = PathSegment(k, k + 1.0, math.cos(heading), math.sin(heading), heading, after, 0.02, TURN_SD_RAD, k)
        found.append(MeasuredSegment(segment, t_s, ranger, np.where(beside, 1.0, math.nan)))
    return nodes_of(found)


def test_people_in_a_hall_turn_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Echoes of one ranger in one second of ten: the heading stays that of odometry; as walls they would bend it by more than 20 degrees."""
    nodes, pings = across_a_hall(10)
    fragments = find_fragments(nodes, pings)
    assert np.count_nonzero(nodes.way_m[fragments.node] < HALL_M) == HALL_M // 10
    drift = find_directions(nodes, fragments).drift_rad
    assert math.degrees(abs(drift[0] - drift[-1])) < 3.0
    monkeypatch.setattr(directions, "PEOPLE", 0.0)
    drift = find_directions(nodes, fragments).drift_rad
    assert math.degrees(abs(drift[0] - drift[-1])) > 20.0


def test_the_share_of_people_is_small_where_much_is_heard() -> None:
    """With walls on both sides one fragment in twenty may be a person, with one second in twenty heard, most of them."""
    nodes, pings = across_a_hall(10)
    fragments = find_fragments(nodes, pings)
    way_m, share = nodes.way_m[fragments.node], people_share(nodes, fragments)
    assert share[way_m > HALL_M + directions.COUNTED_M].max() < 0.08
    assert np.all(share[way_m < HALL_M - directions.COUNTED_M] == directions.MOST_PEOPLE)


def test_a_person_has_the_direction_of_the_path() -> None:
    """Along it the density is that of the stated spread, half a right angle off there is none."""
    nodes, pings = across_a_hall(10)
    fragments = find_fragments(nodes, pings)
    straight = np.abs(nodes.way_m[fragments.node] - HALL_M) > 3.0
    along = density_along_path(nodes, fragments)
    sd = np.hypot(fragments.sd_rad, directions.ALONG_SD_RAD)
    peak = 1.0 / (math.sqrt(2.0 * math.pi) * sd)
    np.testing.assert_allclose(along[straight], peak[straight], rtol=0.01)
    askew = fragments._replace(normal_rad=fragments.normal_rad + math.radians(45.0))
    assert np.max(density_along_path(nodes, askew)[straight] / peak[straight]) < 1e-3
