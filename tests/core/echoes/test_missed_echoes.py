# SPDX-License-Identifier: MIT
"""Missed echoes: learnt from silent pings between echoes that are alike, and from nothing else."""

from __future__ import annotations

import numpy as np
import pytest

from echostep.echoes.likelihood import PRIOR_HEARD, PRIOR_MISSED, MissedEchoes

PRIOR = PRIOR_MISSED / PRIOR_HEARD


def odds(ranges_m: list[float], ranger: int = 0) -> float:
    missed = MissedEchoes()
    for range_m in ranges_m:
        missed.update(0, range_m)
    return missed.odds(ranger)


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
