# SPDX-License-Identifier: MIT
"""Iron about a compass, found by a turn on the spot."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echostep_app.commissioning.fitting import fit_compass_errors
from legs.test_heading import IRON, shown


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_iron_is_found_by_a_turn_on_the_spot(sign: float) -> None:
    rng = np.random.default_rng(2)
    t = np.arange(0.0, 25.0, 0.01)
    heading = 1.0 + sign * 0.35 * t
    rate = np.gradient(heading, t) + math.radians(0.8) + 0.01 * rng.standard_normal(len(t))
    compass = np.where(np.arange(len(t)) % 10 == 0, shown(heading, IRON) + 0.01 * rng.standard_normal(len(t)), np.nan)
    found = fit_compass_errors(t, rate, np.angle(np.exp(1j * compass)))
    error = [found.error(h) - IRON.error(h) for h in np.linspace(0, 2 * math.pi, 36)]
    assert np.ptp(error) < math.radians(2.0)
    assert found.rms_rad < math.radians(1.5)


def test_half_a_turn_is_refused_in_words() -> None:
    t = np.arange(0.0, 10.0, 0.01)
    with pytest.raises(ValueError, match="once round"):
        fit_compass_errors(t, np.full_like(t, 0.3), 0.3 * t)
    with pytest.raises(ValueError, match="does not follow"):
        fit_compass_errors(t, np.full_like(t, 0.9), np.full_like(t, 1.0))
    with pytest.raises(ValueError, match="fewer than 20"):
        fit_compass_errors(t, np.full_like(t, 0.9), np.full_like(t, np.nan))
