# SPDX-License-Identifier: MIT
"""A turn that odometry adds to each metre, found by the directions of the walls."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echostep.path import MeasuredSegment, PathSegment
from echostep_app.mapping.graph.bias import find_bias, without_bias
from echostep_app.mapping.graph.nodes import nodes_of
from echostep_app.mapping.mapper import map_walk

SIDE_M, LEG_M, PING_S = 1.0, 12, 0.07
TURN_SD_RAD = math.radians(2.0)  # of each metre, as stated


def round_and_round(bias_rad_m: float) -> list[MeasuredSegment]:
    """Six legs of a square with a wall 1 m to either side, at 1 m/s, measured with so much turn in each metre."""
    found: list[MeasuredSegment] = []
    heading = 0.0
    for k in range(6 * (LEG_M + 1)):
        corner = k % (LEG_M + 1) == LEG_M
        length, turn = (0.0, 0.5 * math.pi) if corner else (1.0, bias_rad_m)
        t_s = k + np.arange(0.0, 1.0, 0.5 * PING_S)
        ranger = np.arange(len(t_s)) % 2
        heard = np.full(len(t_s), math.nan if corner else SIDE_M)
        middle = heading + 0.5 * turn
        moved = length * math.cos(middle), length * math.sin(middle)
        segment = PathSegment(k, k + 1.0, *moved, heading, heading + turn, 0.02, TURN_SD_RAD, k)
        found.append(MeasuredSegment(segment, t_s, ranger, heard))
        heading += turn
    return found


@pytest.mark.parametrize("bias_deg", [3.0, -3.0])
def test_a_bias_is_found_by_the_directions_of_the_walls(bias_deg: float) -> None:
    """Within half a degree a metre; without it the path has the right angles that it has."""
    nodes, pings = nodes_of(round_and_round(math.radians(bias_deg)))
    bias = find_bias(nodes, pings)
    assert math.degrees(bias) == pytest.approx(-bias_deg, abs=0.5)
    turned, heard = without_bias(nodes, pings, -math.radians(bias_deg))
    assert heard.axis_rad[-1] - heard.axis_rad[-2] == pytest.approx(pings.axis_rad[-1] - pings.axis_rad[-2], abs=0.1)
    steps = np.diff(turned.pose[:, :2], axis=0)
    long = np.hypot(*steps.T) > 0.5
    course = np.arctan2(steps[long, 1], steps[long, 0])
    assert np.abs((course + 0.25 * math.pi) % (0.5 * math.pi) - 0.25 * math.pi).max() < 1e-6
    straight = nodes_of(round_and_round(0.0))
    np.testing.assert_allclose(turned.pose[:, :2], straight[0].pose[:, :2], atol=1e-6)
    np.testing.assert_allclose(heard.at_m, straight[1].at_m, atol=0.01)
    np.testing.assert_allclose(heard.axis_rad, straight[1].axis_rad, atol=1e-6)


def test_without_evidence_there_is_no_bias() -> None:
    """A straight walk stays as it was measured, to the bit; a known bias stays while no other one has the odds."""
    nodes, pings = nodes_of(round_and_round(0.0))
    assert find_bias(nodes, pings) == 0.0
    assert without_bias(nodes, pings, 0.0) == (nodes, pings)
    assert find_bias(nodes, pings, 1e-4) == 1e-4


def test_a_biased_walk_is_drawn() -> None:
    """The same walk, its heading off by 220 degrees at the end: drawn with the shape that it had."""
    graph = map_walk(round_and_round(math.radians(3.0))).graph
    true = nodes_of(round_and_round(0.0))[0].pose
    assert np.hypot(*(graph.pose[:, :2] - true[:, :2]).T).max() < 0.5
