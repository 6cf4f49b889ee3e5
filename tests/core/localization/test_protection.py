# SPDX-License-Identifier: MIT
"""The protection radius of a place in a building of several levels."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echostep.localization import ANY_LEVEL, RISK, CloudSettings, Start, estimate_of
from echostep.localization.particles.cloud import cloud_about
from echostep.plan import Pose
from echostep.walls.level_sheet import lay_out_levels
from echostep_studies.simulation.tower import tower

SHEET = lay_out_levels(tower(2)).sheet


@pytest.mark.parametrize(
    ("level", "other", "is_finite"), [(0, 0.0, True), (ANY_LEVEL, 0.3 * RISK, True), (ANY_LEVEL, 3.0 * RISK, False)]
)
def test_a_level_that_is_not_sure_takes_part_of_the_risk(level: int, other: float, is_finite: bool) -> None:
    """A place known to a decimetre, and this share of the weight on the other level."""
    start = Start(Pose(5.0, 3.0, 0.0, level), 0.1)
    cloud = cloud_about(CloudSettings(), start, 0.0, np.random.default_rng(1), SHEET)
    share = np.where(cloud.level == 0, 1.0 - other, max(other, 1e-12))
    cloud.log_weight = np.log(share / share.max())
    assert math.isfinite(estimate_of(cloud, 0.0, 0.0, 0).protection_m) == is_finite
