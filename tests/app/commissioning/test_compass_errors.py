# SPDX-License-Identifier: MIT
"""Iron about a compass, found by a turn on the spot; bearings of a magnetometer of three axes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from board.test_tilt_compass import shaken
from echostep.board import messages as m
from echostep.board.frames import BoardReader
from echostep.legs.heading import CompassErrors
from echostep_app.commissioning.fitting import bearings, fit_compass_errors
from echostep_app.commissioning.probe import ProbeResult

IRON = CompassErrors(math.radians(6), math.radians(-4), math.radians(2), math.radians(1))


def _shown(heading: np.ndarray, iron: CompassErrors) -> np.ndarray:
    return np.array([h + iron.error(h) for h in heading.tolist()])


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_iron_is_found_by_a_turn_on_the_spot(sign: float) -> None:
    rng = np.random.default_rng(2)
    t = np.arange(0.0, 25.0, 0.01)
    heading = 1.0 + sign * 0.35 * t
    rate = np.gradient(heading, t) + math.radians(0.8) + 0.01 * rng.standard_normal(len(t))
    compass = np.where(np.arange(len(t)) % 10 == 0, _shown(heading, IRON) + 0.01 * rng.standard_normal(len(t)), np.nan)
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


def test_calibrate_takes_the_bearings_of_a_magnetometer() -> None:
    probed = ProbeResult()
    for message in BoardReader().feed(shaken(2, 1.1)):
        assert isinstance(message, m.Motion | m.Magnetic)
        probed.axes.append(message)
        probed.ticks.setdefault(type(message).__name__, []).append(message.ticks)
    t_s, found = bearings(probed)
    assert len(t_s) == len(found) == 50
    assert np.degrees(np.abs(found[20:] - (0.5 * math.pi - 1.1))).max() < 2.0
