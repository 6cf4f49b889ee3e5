# SPDX-License-Identifier: MIT
"""The cloud of an unknown start: how much a ping tells it, when it turns fine, and when it is begun anew."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from echostep.localization.belief import DOUBTED, FOUND_WITHIN_M, PLAN_FITS
from echostep.localization.building import Building
from echostep.localization.echoes.likelihood import EchoSettings, echo_model
from echostep.localization.echoes.range_table import AFTER_ECHO, AFTER_SILENCE, INDEPENDENT_M, USED_M, CoarsePings
from echostep.localization.map_filter import MapFilter
from echostep.localization.particle_arrays import Move, PingBatch
from echostep.localization.particles.cloud import COARSE_REST, Cloud
from echostep.localization.particles.start import Start
from echostep.localization.settings import CloudSettings, FilterSettings
from echostep.path import MeasuredSegment, PathSegment
from echostep.walls.echo_sources import Walls

NONE, NO_RANGERS = np.zeros(0), np.zeros(0, np.int64)
SILENCE = PingBatch(NONE, NONE, NONE, NONE, NO_RANGERS, NONE, NONE, NONE, NONE)
ROOM = Building(Walls(np.array([[0, 0, 12, 0], [12, 0, 12, 8], [12, 8, 0, 8], [0, 8, 0, 0]], float)), None)
MODEL = echo_model(EchoSettings())
SETTINGS = CloudSettings(searching=30_000)
STEP_M = 0.5
MORE_CELLS = 500  # largest exact cloud, less than what the cells of one place ask for


def coarse_cloud(resample_below: float = 0.5, largest: int = SETTINGS.largest) -> Cloud:
    settings = replace(SETTINGS, resample_below=resample_below, largest=largest)
    return Cloud(settings, Start(), 0.0, np.random.default_rng(1), floor=ROOM.floor)


def gather(cloud: Cloud, share: float) -> None:
    """Give the particles within half a metre of the middle of the room this share of the weight."""
    near = np.hypot(cloud.x_m - 6.0, cloud.y_m - 4.0) < 0.5
    cloud.log_weight = np.where(near, math.log(share / near.sum()), math.log((1.0 - share) / (~near).sum()))
    cloud.log_weight -= cloud.log_weight.max()


def pings(range_m: float, count: int) -> PingBatch:
    """So many of ranger 0 at the beginning, all with this range (0: silent)."""
    one = np.ones(count)
    return PingBatch(0.0 * one, one, range_m * one, one, np.zeros(count, np.int64), one, 0.0 * one, one, one)


def told(way_m: float) -> float:
    """The range of the log-weights after one ping, this way after one of the same ranger."""
    ping, cloud = pings(1.2, 1), coarse_cloud(resample_below=0.0)
    for move, batch in ((Move(0.0, 0.0, 0.0, 0.0), ping), (Move(way_m, 0.0, 0.0, 0.0), SILENCE)):
        cloud.propagate_and_reweight_coarsely(move, batch, MODEL, ROOM.walls, ROOM.field(MODEL))
    cloud.log_weight[:] = 0.0
    cloud.propagate_and_reweight_coarsely(Move(0.0, 0.0, 0.0, 0.0), ping, MODEL, ROOM.walls, ROOM.field(MODEL))
    return float(np.ptp(cloud.log_weight))


@pytest.mark.long
def test_a_ping_tells_by_the_way_since_the_one_before() -> None:
    whole = told(INDEPENDENT_M)
    assert told(0.5 * INDEPENDENT_M) == pytest.approx(0.5 * whole, rel=0.05)
    assert told(3.0 * INDEPENDENT_M) == pytest.approx(whole, rel=0.05)


def test_pings_from_nearly_one_place_are_used_once() -> None:
    used, both = CoarsePings(), pings(1.2, 2)
    assert used.take(both, 0, 0.0) is not None
    assert used.take(both, 1, 0.9 * USED_M) is None
    assert used.take(both, 1, 1.1 * USED_M) is not None


def test_a_ping_knows_whether_that_before_it_was_silent() -> None:
    used, after = CoarsePings(), []
    for range_m in (0.0, 1.2, 0.0, 0.0):
        ping = used.take(pings(range_m, 1), 0, 0.0)
        assert ping is not None
        after.append(ping.after)
        used.odometer.add(1.0)
    assert after == [AFTER_SILENCE, AFTER_SILENCE, AFTER_ECHO, AFTER_SILENCE]


@pytest.mark.parametrize(
    ("share", "rest_away_m", "is_coarse"),
    [(0.8, 0.0, True), (1.0 - 0.3 * COARSE_REST, 0.0, False), (1.0 - 0.9 * COARSE_REST, 200.0, False)],
)
def test_a_cloud_is_fine_when_nearly_all_of_its_weight_is_in_one_place(
    share: float, rest_away_m: float, is_coarse: bool
) -> None:
    cloud = coarse_cloud(largest=MORE_CELLS)
    gather(cloud, share)
    cloud.x_m = cloud.x_m + np.where(cloud.log_weight < 0.0, rest_away_m, 0.0)
    cloud.resample_if_needed()
    assert cloud.is_coarse == is_coarse


@pytest.mark.long
@pytest.mark.parametrize(
    ("share", "path_m", "is_kept", "doubts_plan"),
    [
        (0.4 * DOUBTED, FOUND_WITHIN_M - 1.0, True, False),
        (0.4 * DOUBTED, FOUND_WITHIN_M + 2.0, True, True),
        (1.2 * DOUBTED, FOUND_WITHIN_M + 2.0, True, False),
        (1.2 * DOUBTED, 2.0 * FOUND_WITHIN_M + 1.0, False, True),
    ],
)
def test_a_search_goes_on_for_twice_the_path_within_which_one_finds(
    share: float, path_m: float, is_kept: bool, doubts_plan: bool
) -> None:
    """To and fro, without pings; the weights are set before the last two steps."""
    map_filter = MapFilter(ROOM, Start(), 0.0, np.random.default_rng(1), FilterSettings(cloud=SETTINGS))
    begun = map_filter.cloud
    for k in range(round(path_m / STEP_M)):
        gather(map_filter.cloud, DOUBTED * 1.2 if (k + 1) * STEP_M < path_m - 3.0 * STEP_M else share)
        step = PathSegment(
            k, k + 1.0, STEP_M * (-1.0) ** k, 0.0, 0.0, 0.0, sd_m=0.01, turn_sd_rad=0.001, step=k, anchor_sd_m=0.0
        )
        estimate = map_filter.update(MeasuredSegment(step, NONE, NO_RANGERS, NONE))
    assert (map_filter.cloud is begun) == is_kept
    assert (estimate.plan_fits < PLAN_FITS - 0.01) == doubts_plan
