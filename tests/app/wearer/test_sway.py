# SPDX-License-Identifier: MIT
"""Sway: told from noise, from vibration and from twitches, however the samples are cut; what it does to the alarm."""

from __future__ import annotations

import numpy as np
import pytest

from echostep.arrays import Floats
from echostep.odometry import AlarmKind
from echostep_app.wearer.alarm import ASK_S, SWAY_S, WearerAlarm
from echostep_app.wearer.stillness import MotionWindows, Window
from echostep_app.wearer.wearer_signs import StepTaken

RATE_HZ, NOISE = 100.0, 0.005  # rad/s
T_S: Floats = np.arange(6000) / RATE_HZ


def swaying(values: Floats, t_s: Floats = T_S) -> float:
    """Share of the windows in which a wearer counts as swaying; the values are of one axis of three."""
    noise = NOISE * np.random.default_rng(3).standard_normal((len(t_s), 3))
    noise[:, 0] += values
    windows = [window for _, window in MotionWindows(np.full(3, 0.2), 3).add(t_s, noise)]
    assert not any(window.moved for window in windows)
    return float(np.mean([window.sways for window in windows]))


def test_slow_turning_below_the_limit_of_motion_is_sway() -> None:
    assert swaying(0.03 * np.sin(2.0 * np.pi * 1.1 * T_S)) > 0.7


@pytest.mark.parametrize(("hz", "size"), [(1.0, 0.0), (12.0, 0.04), (17.0, 0.05), (1.0, 0.001)])
def test_noise_shivering_engines_and_breathing_are_none(hz: float, size: float) -> None:
    assert swaying(size * np.sin(2.0 * np.pi * hz * T_S)) == 0.0


def test_twitches_are_none() -> None:
    twitches = np.zeros(len(T_S))
    for begin in np.random.default_rng(4).integers(0, 5900, 12):  # one in 5 s
        twitches[begin : begin + 30] += 0.05 * np.sin(np.linspace(0.0, np.pi, 30))
    assert swaying(twitches) == 0.0


@pytest.mark.parametrize("cut", [1, 7, 50, 51, 1300])
def test_the_result_does_not_depend_on_portions(cut: int) -> None:
    rng = np.random.default_rng(5)
    values = 0.02 * np.sin(7.0 * T_S)[:, None] + NOISE * rng.standard_normal((len(T_S), 3))
    t_s = np.r_[T_S[:3000], T_S[3000:] + 4.3]  # with a gap
    whole = MotionWindows(np.full(3, 0.2), 3).add(t_s, values)
    windows, cut_up = MotionWindows(np.full(3, 0.2), 3), []
    for begin in range(0, len(t_s), cut):
        part = windows.add(t_s[begin : begin + cut], values[begin : begin + cut])
        cut_up += [(begin + k, window) for k, window in part]
    assert cut_up == whole
    assert any(window.sways for _, window in whole)


def test_sway_alone_keeps_the_question_back_for_two_minutes() -> None:
    alarm = WearerAlarm()
    for k in range(5):
        alarm.add([StepTaken(1.0 + k)])
    alarm.add([Window(k / 2.0, True) for k in range(1, 21)])
    for k in range(21, 21 + 2 * int(SWAY_S + ASK_S) - 2):
        alarm.add([Window(k / 2.0, False, True)])
        assert alarm.alarm is None
    for k in range(19 + 2 * int(SWAY_S + ASK_S), 30 + 2 * int(SWAY_S + ASK_S)):
        alarm.add([Window(k / 2.0, False, True)])
    assert alarm.alarm is not None
    assert alarm.alarm.kind is AlarmKind.ASKING


def test_a_mayday_does_not_end_by_sway() -> None:
    alarm = WearerAlarm()
    for k in range(5):
        alarm.add([StepTaken(1.0 + k)])
    alarm.add([Window(k / 2.0, True) for k in range(1, 21)])
    alarm.add([Window(k / 2.0, False) for k in range(21, 90)])
    alarm.add([Window(k / 2.0, False, True) for k in range(90, 120)])
    assert alarm.alarm is not None
    assert alarm.alarm.kind is AlarmKind.MAYDAY
