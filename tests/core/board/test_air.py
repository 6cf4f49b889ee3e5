# SPDX-License-Identifier: MIT
"""The speed of sound follows the air's temperature in steps, however its bytes arrive; a setting overrides it."""

from __future__ import annotations

import numpy as np
import pytest

from echostep.arrays import Floats
from echostep.board.air import Air, sound_m_s
from echostep.board.calibration import SPEED_OF_SOUND_M_S, RangerSettings, ranges
from echostep.board.messages import ROWS, Outcome


def samples(celsius: Floats) -> np.ndarray[tuple[int], np.dtype[np.void]]:
    return np.array([(0, 405_300, round(20.0 * c)) for c in celsius], ROWS[0x04])


def speeds(air: Air, celsius: Floats, cuts: int = 1) -> Floats:
    """A ping after each sample, in so many portions."""
    rows = np.arange(len(celsius))
    parts = np.array_split(rows, cuts)
    return np.concatenate([air.speeds(2 * part + 1, 2 * part, samples(celsius[part])) for part in parts])


@pytest.mark.parametrize("celsius", [0.0, 40.0, 60.0])
def test_a_metre_is_a_metre_at_any_temperature(celsius: float) -> None:
    """By one speed for all, 3.00 m read 10.8 cm too far at 0 degC, 9.8 cm too near at 40, and 18.6 at 60."""
    flight_us = round(2e6 * 3.0 / sound_m_s(celsius))
    pings = np.array([(0, 0, Outcome.ECHO, flight_us)], ROWS[0x02])
    speed = speeds(Air(0.0), np.full(40, celsius))[-1:]
    assert ranges(pings, RangerSettings(), speed) == pytest.approx(3.0, abs=0.001)
    assert abs(float(ranges(pings, RangerSettings(speed_of_sound_m_s=343.2), speed)[0]) - 3.0) > 0.09


def test_noise_and_its_own_warming_change_nothing() -> None:
    rng = np.random.default_rng(4)
    assert set(speeds(Air(0.0), 21.3 + 0.3 * rng.standard_normal(400))) == {SPEED_OF_SOUND_M_S}


def test_a_setting_is_kept_and_wrong_samples_are_not_taken() -> None:
    assert set(speeds(Air(340.0), np.zeros(50))) == {340.0}
    assert set(speeds(Air(0.0), np.array([-1638.4, 1638.35] * 30))) == {SPEED_OF_SOUND_M_S}


def test_the_portions_do_not_matter() -> None:
    celsius = np.linspace(20.0, -5.0, 300)
    whole = speeds(Air(0.0), celsius)
    assert np.array_equal(whole, speeds(Air(0.0), celsius, cuts=37))
    assert len(set(whole)) >= 10
    assert np.abs(whole - [sound_m_s(c) for c in celsius]).max() < 0.0065 * 343.0  # a step, and the mean's delay
