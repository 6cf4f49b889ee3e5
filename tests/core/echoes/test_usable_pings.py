# SPDX-License-Identifier: MIT
"""How much a ping counts: by the way since the one before, and never as a whole; missed echoes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echostep.echoes.likelihood import EchoSettings, echo_model
from echostep.echoes.range_memory import (
    HEARD,
    MISSED,
    PRIOR_HEARD,
    PRIOR_MISSED,
    PlacedPings,
    new_memory,
    remembered_densities,
)
from echostep.echoes.unplanned import UsablePings
from echostep.errors import EchostepError
from echostep.localization import Building, MapFilter, Start
from echostep.path import MeasuredSegment, PathSegment
from echostep.plan import Pose
from echostep.settings import parse_settings
from echostep.walls.echo_sources import Walls

ROOM = Building(Walls(np.array([[0, 0, 30, 0], [30, 0, 30, 8], [30, 8, 0, 8], [0, 8, 0, 0]], float)), None)


def powers(apart_m: float, echo: EchoSettings) -> list[float]:
    """Powers of five pings of the left ranger on a straight way, so far apart."""
    length = 5.0 * apart_m
    way = PathSegment(0.0, 1.0, length, 0.0, 0.0, 0.0, sd_m=0.01, turn_sd_rad=0.001, step=1)
    t_s = np.arange(5) / 5.0
    measured = MeasuredSegment(way, t_s, np.zeros(5, np.int64), np.full(5, 2.0))
    return UsablePings(ROOM.background(echo_model(echo)), echo).take(measured)[0].power.tolist()


@pytest.mark.parametrize(("apart_m", "share"), [(0.05, 0.2), (0.125, 0.5), (0.25, 1.0), (3.0, 1.0)])
@pytest.mark.parametrize("own", [0.7, 1.0])
def test_a_ping_counts_by_the_way_since_the_one_before(apart_m: float, share: float, own: float) -> None:
    assert powers(apart_m, EchoSettings(own=own)) == pytest.approx([own] + [own * share] * 4)


def test_a_wearer_who_turns_on_the_spot_sees_something_new() -> None:
    """While turning a ping counts little, for its axis is uncertain; the first one after the turn counts as after a way; the next ones do not."""
    usable = UsablePings(ROOM.background(echo_model(EchoSettings())), EchoSettings())
    found = []
    for k, turn_deg in enumerate((0.0, 90.0, 0.0, 0.0)):
        heading = math.radians(90.0 * (k > 1))
        way = PathSegment(
            k, k + 1.0, 0.0, 0.0, heading, heading + math.radians(turn_deg), sd_m=0.01, turn_sd_rad=0.001, step=1
        )
        one = MeasuredSegment(way, np.array([k + 0.5]), np.zeros(1, np.int64), np.full(1, 2.0))
        found.append(usable.take(one)[0].power.tolist())
    first, turning, after, still = found
    assert first == [EchoSettings().own]
    assert 0.0 < turning[0] < 0.2 * EchoSettings().own < after[0]
    assert still == []


def test_who_turns_at_the_end_of_a_corridor_is_placed_by_its_end() -> None:
    """Along a corridor of 20 m the place is known to half a metre; turned by 90 degrees, one ranger hears the end, 1.1 m away."""
    corridor = Building(Walls(np.array([[0, 0, 20, 0], [20, 0, 20, 2], [20, 2, 0, 2], [0, 2, 0, 0]], float)), None)
    tracked = MapFilter(corridor, Start(Pose(18.9, 1.0, 0.0), sd_m=0.5), 0.0, np.random.default_rng(1))
    sides, sd_m = np.array([0, 1]), []
    for k, (turn_deg, range_m) in enumerate(
        [(0, (1.0, 1.0)), (-90, (1.0, 1.0)), (0, (1.1, math.nan)), (0, (1.1, math.nan))]
    ):
        heading = math.radians(-90.0 * (k > 1))
        way = PathSegment(
            k, k + 1.0, 0.0, 0.0, heading, heading + math.radians(turn_deg), sd_m=0.01, turn_sd_rad=0.01, step=1
        )
        estimate = tracked.update(MeasuredSegment(way, np.full(2, k + 0.5), sides, np.array(range_m)))
        sd_m.append(math.sqrt(estimate.xx_m2))
    assert sd_m[0] > 0.4
    assert sd_m[-1] < 0.5 * sd_m[0]


@pytest.mark.parametrize("own", [0.0, -0.5, 1.5])
def test_a_share_that_is_none_is_refused(own: float) -> None:
    with pytest.raises(EchostepError, match=r"me\.toml: \[echo\] own: "):
        parse_settings(f"[echo]\nown = {own}\n", "me.toml")


PRIOR = PRIOR_MISSED / PRIOR_HEARD


def odds(ranges_m: list[float], ranger: int = 0) -> float:
    """Odds that an echo is missed after echoes of the left ranger, 0 for none."""
    memory, at_m = new_memory(), np.zeros(len(ranges_m))
    pings = PlacedPings(at_m.astype(np.int64), at_m, at_m, at_m, np.array(ranges_m), at_m + 1.0)
    remembered_densities(memory, pings, at_m - 2.0, 0.0, echo_model(EchoSettings()))
    return float(memory[ranger, MISSED] / memory[ranger, HEARD])


@pytest.mark.parametrize("share", [0.1, 0.5])
def test_the_share_of_missed_echoes_of_a_wall_is_learnt(share: float) -> None:
    rng = np.random.default_rng(1)
    ranges_m = np.where(rng.random(400) < share, 0.0, 1.2 + 0.03 * rng.standard_normal(400))
    assert odds(ranges_m.tolist()) == pytest.approx(share / (1.0 - share), rel=0.3)


def test_it_is_forgotten_when_the_ranger_is_in_order_again() -> None:
    assert odds([1.0, 0.0] * 200 + [1.0] * 600) < 0.1


def test_doors_and_far_walls_teach_nothing() -> None:
    door = [1.0] * 5 + [0.0] * 12 + [1.0] * 5
    step = [1.0, 0.0, 1.4, 0.0] * 20
    far = [4.5, 0.0] * 50
    assert odds(door) <= PRIOR
    assert odds(step) == odds(far) == PRIOR


def test_each_ranger_has_odds_of_its_own() -> None:
    assert odds([1.0, 0.0] * 100, ranger=1) == PRIOR
