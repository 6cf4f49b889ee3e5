# SPDX-License-Identifier: MIT
"""A search that disagrees with the tracked cloud: the better predictions of echoes decide, and not before the search has made enough of them."""

from __future__ import annotations

import numpy as np
import pytest

from echostep.localization.belief import (
    AGREED,
    DOUBTED,
    EVIDENCE_M,
    REFUTED,
    UNDECIDED,
    CloudHypothesis,
    Plausibility,
    probability_of,
)
from echostep.localization.building import Building
from echostep.localization.estimate import SURE
from echostep.localization.map_filter import MapFilter
from echostep.localization.particles.cloud import Cloud
from echostep.localization.particles.start import Start
from echostep.localization.settings import CloudSettings, FilterSettings
from echostep.path import MeasuredSegment, PathSegment
from echostep.plan.model import Pose
from echostep.walls.echo_sources import Walls

ROOM = Building(Walls(np.array([[0, 0, 30, 0], [30, 0, 30, 8], [30, 8, 0, 8], [0, 8, 0, 0]], float)), None)
HERE, THERE = Pose(3.0, 4.0, 0.0), Pose(25.0, 4.0, 0.0)
NONE = np.zeros(0)


def hypothetical(at: Pose, log_odds: float) -> CloudHypothesis:
    """A cloud of a few decimetres at a place that has contracted."""
    cloud = Cloud(CloudSettings(size=100, largest=1000), Start(at, 0.1, 0.05), 0.0, np.random.default_rng(1))
    cloud.is_gathered = True
    each = CloudHypothesis(cloud, Plausibility(0.5), has_contracted=True)
    each.plausibility.log_odds = log_odds
    return each


def of_two_minds(log_odds: float, search_log_odds: float, evidence_m: float, at: Pose = THERE) -> MapFilter:
    """A filter that tracks HERE with these log-odds, and whose search says `at` with others."""
    settings = FilterSettings(cloud=CloudSettings(size=100, largest=1000))
    two = MapFilter(ROOM, Start(HERE), 0.0, np.random.default_rng(1), settings)
    two.tracked = hypothetical(HERE, log_odds)
    two.search = hypothetical(at, search_log_odds)
    two.search.evidence_m = evidence_m
    return two


def after_a_step(two: MapFilter) -> float:
    """East of the tracked cloud after a step without pings."""
    step = PathSegment(0.0, 1.0, 0.1, 0.0, 0.0, 0.0, sd_m=0.01, turn_sd_rad=0.001, step=1, anchor_sd_m=0.0)
    return two.update(MeasuredSegment(step, NONE, np.zeros(0, np.int64), NONE)).x_m


@pytest.mark.parametrize(
    ("log_odds", "right"), [(11.0, UNDECIDED), (7.0, probability_of(-1.0)), (0.0, probability_of(-8.0))]
)
def test_before_the_search_is_judged_a_place_that_may_be_alike_is_not_sure(log_odds: float, right: float) -> None:
    two = of_two_minds(log_odds, 9.0, 0.5 * EVIDENCE_M)
    assert two._right().here == pytest.approx(right)


@pytest.mark.parametrize(
    ("gained", "right"),
    [(0.0, probability_of(1.2)), (5.0, probability_of(1.2)), (-2.0, probability_of(-0.8)), (12.0, UNDECIDED)],
)
def test_a_search_that_has_not_gathered_is_no_rival(gained: float, right: float) -> None:
    """After a ride in a lift the place was said to be `lost` until the first echoes, though it was right with 0.8."""
    two = of_two_minds(1.2, 0.0, 0.0)
    two.search = two._new_search(Start(), 0.0)
    two.tracked.plausibility.log_odds += gained
    assert two._right().here == pytest.approx(right)


@pytest.mark.parametrize(("log_odds", "search_log_odds", "stays"), [(10.0, 3.0, True), (4.0, 9.0, False)])
def test_a_judged_search_is_followed_if_it_has_foretold_more(
    log_odds: float, search_log_odds: float, stays: bool
) -> None:
    two = of_two_minds(log_odds, search_log_odds, 1.5 * EVIDENCE_M)
    assert (two._right().here > AGREED) == stays
    assert (two._right().here < DOUBTED) == (not stays)
    assert abs(after_a_step(two) - (HERE if stays else THERE).x_m) < 0.5
    assert two.search is None


def test_a_search_that_agrees_is_asked_for_its_weight_there() -> None:
    """Whatever it has predicted: it is the same place."""
    two = of_two_minds(11.0, 11.0, 1.5 * EVIDENCE_M, at=HERE)
    assert two._right().here > AGREED


@pytest.mark.parametrize(("lowest", "fits"), [(-2.0, True), (REFUTED - 0.5, False)])
def test_a_cloud_that_was_refuted_gives_the_plan_nothing_back(lowest: float, fits: bool) -> None:
    """On a mirrored plan the doubted cloud went astray until a search met it in a room that is alike."""
    two = of_two_minds(lowest, 0.0, 0.0, at=HERE)
    two._plan.reject_start(1.0)
    after_a_step(two)
    assert two.search is not None
    two.tracked.plausibility.log_odds = 11.0
    after_a_step(two)
    assert two.search is None
    assert (two._plan.probability > SURE) == fits
