# SPDX-License-Identifier: MIT
"""Rangers that look ahead of the beam by `[ranger] ahead_deg` look so in a drawing."""

from __future__ import annotations

import pytest

from echostep_app.mapping.graph.nodes import nodes_of
from odometry.test_ranger_axes import AXES_RAD, HEADING_RAD, step


def test_the_drawing_takes_the_axis() -> None:
    assert nodes_of([step()])[1].axis_rad == pytest.approx(HEADING_RAD + AXES_RAD)
