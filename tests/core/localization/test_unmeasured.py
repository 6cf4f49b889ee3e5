# SPDX-License-Identifier: MIT
"""The rival of every stand: what speaks for it, and what does not."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from echostep.localization.unmeasured import FOLLOWED_S, PRIOR, UnmeasuredWay
from echostep.particles.limits import SURE, WALKER_M_S
from echostep.path import MeasuredSegment, PathSegment

PIECE_S = 0.5
Heard = tuple[float, float]  # by the left and the right ranger; NaN: nothing
WALLS: Heard = (1.2, 2.5)
NOTHING: Heard = (math.nan, math.nan)


def piece(k: int, heard: Heard, *, aloft: bool = False, step: int = 1, way_m: float = 0.0) -> MeasuredSegment:
    segment = PathSegment(k * PIECE_S, (k + 1) * PIECE_S, way_m, 0.0, 0.0, 0.0, 0.0, 0.0, step, aloft=aloft)
    t_s = np.linspace(segment.t0_s, segment.t1_s, 6)
    return MeasuredSegment(segment, t_s, np.array([0, 1] * 3), np.array(heard * 3))


def stood(heard: Callable[[int], Heard], pieces: int, **how: bool) -> tuple[UnmeasuredWay, list[float]]:
    """After a step and a stand: the rival, and its probability after each piece."""
    way, found = UnmeasuredWay(), []
    way.weighed(piece(0, WALLS, way_m=1.0))
    for k in range(1, pieces + 1):
        way.weighed(piece(k, heard(k), **how))
        found.append(way.probability)
    return way, found


def passed(k: int) -> Heard:
    """Somebody passes on the left for a second and a half, every eight."""
    return (0.6 + 0.05 * (k % 3) if k % 16 > 12 else WALLS[0], WALLS[1])


@pytest.mark.parametrize("heard", [lambda _: WALLS, passed, lambda k: (0.6 if k > 20 else WALLS[0], WALLS[1])])
def test_a_stand_is_believed_for_ten_minutes_whoever_passes_or_stays_beside(heard: Callable[[int], Heard]) -> None:
    assert max(stood(heard, 1200)[1]) < 1.0 - SURE


def test_rangers_that_fall_silent_are_no_witness_and_a_step_is() -> None:
    way, found = stood(lambda k: WALLS if k < 20 else NOTHING, 40)
    assert found[18] < 1.0 - SURE < found[26] < found[-1]
    for k in range(41, 45):
        way.weighed(piece(k, WALLS, step=k, way_m=1.2))
    assert way.probability < 10.0 * PRIOR


@pytest.mark.parametrize("shuffle_m", [0.0, 0.15])
def test_who_never_heard_anything_has_lost_no_witness_and_who_shuffles_goes(shuffle_m: float) -> None:
    way = UnmeasuredWay()
    for k in range(1200):
        heard = (1.0 + 0.7 * (k // 2 % 3), math.nan) if shuffle_m and k % 20 < 10 else NOTHING
        way.weighed(piece(k, heard, step=k if shuffle_m else 1, way_m=shuffle_m))
    assert way.probability < 0.1


def test_echoes_that_change_beside_a_standing_foot_are_a_way() -> None:
    way, found = stood(lambda k: (1.0 + 0.4 * k, 9.0 - 0.5 * k) if k > 2 else WALLS, 12)
    assert found[1] == pytest.approx(PRIOR, rel=2.0)
    assert way.has_moved
    followed = [way.weighed(piece(k, (2.0 + k, 30.0 - k))).segment for k in range(13, 17)]
    assert [segment.sd_m for segment in followed] == [0.0] * 4  # it was spread before
    assert way.weighed(piece(17, WALLS, step=2, way_m=1.2)).segment.dx_m == 0.0  # one step is no proof


@pytest.mark.parametrize("heard", [WALLS, NOTHING])
def test_a_foot_off_the_floor_is_doubted_at_once(heard: Heard) -> None:
    _, found = stood(lambda _: heard, 1, aloft=True)
    assert found[0] > 1.0 - SURE


def test_a_way_is_followed_for_two_seconds_and_then_left_to_a_search() -> None:
    way, variance = UnmeasuredWay(), 0.0
    way.weighed(piece(0, WALLS, way_m=1.0))
    way.probability = 0.9
    for k in range(1, 40):
        variance += way.weighed(piece(k, NOTHING)).segment.sd_m ** 2
    assert math.sqrt(variance) == pytest.approx(WALKER_M_S * FOLLOWED_S)
    away = []
    for k in range(40, 44):
        way.weighed(piece(k, WALLS, step=k, way_m=1.2))
        away.append(way.away)
    assert max(away) > 0.4
