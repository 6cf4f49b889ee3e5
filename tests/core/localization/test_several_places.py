# SPDX-License-Identifier: MIT
"""The position of a cloud that may be in several places.

The protection radius of a place in a building of several levels.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from echostep.localization import CloudSettings, Estimate, Start, TrackStatus
from echostep.localization.cloud_estimate import estimate_of
from echostep.localization.particles.cloud import cloud_about
from echostep.particles.ellipse import in_ellipse95
from echostep.particles.limits import RISK
from echostep.plan import ANY_LEVEL, Pose
from echostep.walls.level_sheet import lay_out_levels
from echostep_simulation.world.tower import tower

APART_M = 30.0


def _in_two_places(second: float, sd_m: float = 0.1, here: float = 0.9) -> Estimate:
    """Of a cloud at the origin looking along x, with this share of its weight APART_M further east, looking along y."""
    cloud = cloud_about(CloudSettings(), Start(Pose(0.0, 0.0, 0.0), sd_m), 0.0, np.random.default_rng(1))
    there = np.arange(len(cloud.x_m)) % 2 == 1
    cloud.x_m = cloud.x_m + APART_M * there
    cloud.turn_rad = cloud.turn_rad + 0.5 * math.pi * there
    cloud.log_weight = np.log(np.where(there, max(second, 1e-9), 1.0 - second))
    return estimate_of([(cloud, here)], 0.0, 0.0, 0)


@pytest.mark.parametrize(("second", "x_m", "heading_rad"), [(0.4, 0.0, 0.0), (0.6, APART_M, 0.5 * math.pi)])
def test_the_position_is_that_of_the_likelier_place(second: float, x_m: float, heading_rad: float) -> None:
    """And the covariance, about it, has the other place in it."""
    found = _in_two_places(second)
    assert math.hypot(found.x_m - x_m, found.y_m) < 0.3
    assert found.heading_rad == pytest.approx(heading_rad, abs=0.1)
    assert math.sqrt(found.xx_m2) == pytest.approx(math.sqrt(0.4) * APART_M, rel=0.05)
    assert found.status == TrackStatus.UNCERTAIN


def test_headings_that_cancel_have_no_direction() -> None:
    """As of a search in a building that is its own half turn."""
    cloud = cloud_about(CloudSettings(), Start(Pose(0.0, 0.0, 0.0)), 0.0, np.random.default_rng(1))
    cloud.turn_rad = np.resize([0.0, 0.0, math.pi, -math.pi], len(cloud.x_m))
    assert estimate_of([(cloud, 1.0)], 0.0, 0.0, 0).heading_sd_rad > math.pi


def test_no_place_that_has_half_of_the_weight_is_the_position() -> None:
    """Three places alike: the mean is as good as any of them."""
    cloud = cloud_about(CloudSettings(), Start(Pose(0.0, 0.0, 0.0), 0.1), 0.0, np.random.default_rng(1))
    cloud.x_m = cloud.x_m + APART_M * (np.arange(len(cloud.x_m)) % 3)
    found = estimate_of([(cloud, 1.0)], 0.0, 0.0, 0)
    assert found.x_m == pytest.approx(APART_M, abs=1.0)
    assert found.status == TrackStatus.LOST
    assert len(found.hypotheses) == 3


def test_a_wide_cloud_of_one_place_has_its_mean() -> None:
    """Its densest square is where it is by chance."""
    found = _in_two_places(0.0, sd_m=1.2)
    assert math.hypot(found.x_m, found.y_m) < 0.1


@pytest.mark.parametrize(("here", "status"), [(0.9, TrackStatus.UNCERTAIN), (0.7, TrackStatus.LOST)])
def test_a_place_is_as_probable_as_its_cloud(here: float, status: TrackStatus) -> None:
    assert _in_two_places(0.4, here=here).status == status


@pytest.mark.parametrize(("apart_m", "claimed"), [(30.0, False), (6.0, False), (3.2, False), (0.5, True)])
def test_the_mean_of_two_places_is_claimed_where_it_lies_in_one(apart_m: float, claimed: bool) -> None:
    """Both are as likely."""
    cloud = cloud_about(CloudSettings(), Start(Pose(0.0, 0.0, 0.0), 0.1), 0.0, np.random.default_rng(1))
    cloud.x_m = cloud.x_m + apart_m * (np.arange(len(cloud.x_m)) % 2)
    found = replace(estimate_of([(cloud, 1.0)], 0.0, 0.0, 0), status=TrackStatus.UNCERTAIN)
    assert found.x_m == pytest.approx(0.5 * apart_m, abs=0.1)
    assert found.claims_place == claimed
    assert not replace(found, status=TrackStatus.LOST).claims_place


def test_the_likelier_place_is_claimed_beside_others() -> None:
    assert _in_two_places(0.2).claims_place
    other_level = tuple(replace(place, level=1) for place in _in_two_places(0.2).hypotheses)
    assert not replace(_in_two_places(0.2), hypotheses=other_level).claims_place


@pytest.mark.parametrize(
    ("second", "sd_m", "here"),
    [(0.0, 0.1, 1.0), (0.0, 0.1, 0.99), (0.0, 1.2, 0.97), (0.03, 0.1, 0.99), (0.01, 0.8, 0.97)],
)
def test_the_region_of_95_percent_holds_95_percent_of_the_belief(second: float, sd_m: float, here: float) -> None:
    """Of all places that the belief gives: about the origin, at the second one, and elsewhere."""
    found, rng = _in_two_places(second, sd_m, here), np.random.default_rng(2)
    in_cloud, far = rng.random(20_000) < here, rng.random(20_000) < second
    true_m = rng.normal(0.0, sd_m, (20_000, 2)) + np.outer(far, (APART_M, 0.0)) + np.outer(~in_cloud, (0.0, 200.0))
    moments_m2 = np.array((found.xx_m2, found.xy_m2, found.yy_m2))
    held = in_ellipse95(true_m - [found.x_m, found.y_m], moments_m2[:, None].T)
    assert 0.93 < held.mean() < 0.97
    assert found.is_one_place
    assert found.right == pytest.approx(here * (1.0 - second), abs=0.02)
    assert found.ellipse95.major_m < 4.0 * sd_m


def test_places_have_their_shares_of_the_belief_where_none_has_enough() -> None:
    found = _in_two_places(0.4, here=0.7)
    assert not found.is_one_place
    assert sorted(place.probability for place in found.hypotheses) == pytest.approx([0.28, 0.42], abs=0.01)


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
    assert math.isfinite(estimate_of([(cloud, 1.0)], 0.0, 0.0, 0).protection_m) == is_finite
