# SPDX-License-Identifier: MIT
"""Motion of a wearer: still windows, tenths of a second and sway, however the samples are cut."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from echostep.arrays import Floats
from echostep.legs.trunk_path import GyroBlock
from echostep.odometry import AlarmKind
from echostep_app.wearer.alarm import ASK_S, SWAY_S
from echostep_app.wearer.stillness import MOST_SAMPLES, WINDOW_S, MotionWindows, Stillness, Window
from echostep_app.wearer.tenths import LEAST_SAMPLES, TENTH_S, Tenth, Tenths
from wearer.test_alarm import walked


def samples(seconds: float, moves_s: tuple[float, ...], seed: int = 0) -> tuple[Floats, Floats]:
    """A channel at 100 Hz: noise of 0.02, and a movement of 1 at each of these times."""
    t_s = np.arange(0.0, seconds, 0.01)
    values = 3.0 + 0.02 * np.random.default_rng(seed).standard_normal(len(t_s))
    for move_s in moves_s:
        values[np.abs(t_s - move_s) < 0.1] += 1.0
    return t_s, values[:, None]


@given(st.lists(st.integers(0, 1000), max_size=20), st.integers(0, 100))
def test_windows_do_not_depend_on_how_samples_are_cut(cuts: list[int], seed: int) -> None:
    t_s, values = samples(10.0, (2.3, 7.75), seed)
    whole, cut = MotionWindows(np.array([0.5])), MotionWindows(np.array([0.5]))
    edges = [0, *sorted(cuts), len(t_s)]
    parts = [(a, cut.add(t_s[a:b], values[a:b])) for a, b in zip(edges, edges[1:], strict=False)]
    assert [(a + k, window) for a, part in parts for k, window in part] == whole.add(t_s, values)


def test_a_window_with_a_movement_has_moved_and_no_other() -> None:
    t_s, values = samples(10.0, (2.3, 7.75))
    windows = [window for _, window in MotionWindows(np.array([0.5])).add(t_s, values)]
    assert [window.end_s for window in windows if window.moved] == [2.5, 8.0]
    assert windows[-1] == Window(9.5, False)  # the last half second is not over


def test_samples_of_an_earlier_window_are_skipped() -> None:
    windows = MotionWindows(np.array([0.5]))
    windows.add(np.array([5.0]), np.zeros((1, 1)))
    assert not windows.add(np.array([1.0, 2.0]), np.ones((2, 1)))
    assert windows.add(np.array([5.6]), np.zeros((1, 1))) == [(0, Window(5.5, False))]


def test_times_that_stand_still_fill_no_memory() -> None:
    windows, kept = MotionWindows(np.array([0.5])), 2 * MOST_SAMPLES
    for _ in range(40):
        assert not windows.add(np.full(1_000, 1.1), np.zeros((1_000, 1)))
    assert sum(len(t_s) for t_s, _ in windows._samples) < kept
    assert windows.add(np.array([1.6]), np.zeros((1, 1))) == [(0, Window(1.5, False))]


def test_sensors_that_have_never_moved_say_nothing() -> None:
    stillness = Stillness()
    t_s, values = samples(4.0, (2.3,))
    quiet = np.zeros_like(t_s)
    assert not stillness.add_legs(GyroBlock(t_s, quiet, quiet, quiet, quiet))
    windows = stillness.add_foot(t_s, np.hstack([values] * 3), np.hstack([values] * 3))
    assert [window.end_s for _, window in windows] == [2.5, 3.0, 3.5]
    assert WINDOW_S == 0.5


def test_times_that_step_back_over_a_window_are_skipped_in_whatever_portions() -> None:
    """Arrival times of a computer that is too busy do: the second portion's last sample belongs to the window that its first one has ended."""
    t_s, portions = np.array([0.1, 0.4, 0.55, 0.49, 0.7, 1.05, 0.9, 1.6]), ([0, 2], [2, 4], [4, 5], [5, 8])
    values = np.zeros((len(t_s), 6))
    whole, single, cut = (MotionWindows(np.ones(6)) for _ in range(3))
    expected = whole.add(t_s, values)
    assert [index for index, _ in expected] == [2, 5, 7]
    one_by_one = [(k + i, w) for k in range(len(t_s)) for i, w in single.add(t_s[k : k + 1], values[k : k + 1])]
    assert one_by_one == expected
    assert [(a + i, w) for a, b in portions for i, w in cut.add(t_s[a:b], values[a:b])] == expected


def uneven_samples(seed: int, count: int = 400) -> tuple[Floats, Floats, Floats, Floats]:
    """At about 200 Hz, with a gap, a time that goes back, and missing values."""
    rng = np.random.default_rng(seed)
    t_s = np.cumsum(rng.uniform(0.003, 0.007, count))
    t_s[count // 2 :] += 3.3
    t_s[count // 3] -= 0.3
    force, rate, beside = rng.normal(0.0, 9.0, (3, count, 3))
    beside[count // 4 : count // 4 + 30] = np.nan
    return t_s, force, rate, beside


@given(st.lists(st.integers(0, 400), max_size=30), st.integers(0, 100))
@settings(deadline=None)
def test_tenths_do_not_depend_on_portions_to_the_last_bit(cuts: list[int], seed: int) -> None:
    t_s, force, rate, beside = uneven_samples(seed)
    whole, cut = Tenths(), Tenths()
    edges = [0, *sorted(cuts), len(t_s)]
    found = []
    for a, b in zip(edges, edges[1:], strict=False):
        found += [(a + k, tenth) for k, tenth in cut.cut(t_s[a:b], force[a:b], rate[a:b], beside[a:b])]
    assert repr(found) == repr(whole.cut(t_s, force, rate, beside))  # NaN is equal to NaN here


def plain(t_s: Floats, force: Floats, rate: Floats, beside: Floats) -> Tenth:
    """One tenth, by its definition."""
    n = len(t_s)
    mean = [sum(column) / n for column in force.T]
    peak = max(math.sqrt(sum(x * x for x in row)) for row in force.tolist())
    unrest = math.sqrt(sum(math.dist(row, mean) ** 2 for row in force.tolist()) / n)
    turning = math.sqrt(sum(math.hypot(*row) ** 2 for row in rate.tolist()) / n)
    end_s = TENTH_S * (math.floor(t_s[0] / TENTH_S) + 1.0)
    return Tenth(end_s, tuple(mean), peak, unrest, tuple(rate.mean(axis=0)), turning, tuple(beside.mean(axis=0)))


def test_a_tenth_is_what_its_definition_says() -> None:
    rng = np.random.default_rng(1)
    t_s: Floats = np.arange(5.001, 5.2255, 0.005)
    force, rate, beside = rng.normal(0.0, 9.0, (3, 45, 3))
    found = Tenths().cut(t_s, force, rate, beside)
    assert [index for index, _ in found] == [20, 40]
    for k, (_, tenth) in enumerate(found):
        part = slice(20 * k, 20 * k + 20)
        expected = plain(t_s[part], force[part], rate[part], beside[part])
        for ours, theirs in zip(tenth, expected, strict=True):
            assert ours == pytest.approx(theirs, rel=1e-12)


def test_too_few_samples_are_no_tenth_and_missing_ones_are_told() -> None:
    few = np.array([1.01, 1.02, 1.2])[:LEAST_SAMPLES]
    assert not Tenths().cut(few, np.ones((3, 3)), np.ones((3, 3)))
    t_s: Floats = np.arange(1.001, 1.1025, 0.005)
    ((_, tenth),) = Tenths().cut(t_s, np.full((21, 3), np.nan), np.ones((21, 3)))
    assert math.isnan(tenth.force[0])
    assert math.isnan(tenth.peak)
    assert tenth.turning == pytest.approx(math.sqrt(3.0))


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
    alarm = walked()
    for k in range(21, 21 + 2 * int(SWAY_S + ASK_S) - 2):
        alarm.add([Window(k / 2.0, False, True)])
        assert alarm.alarm is None
    for k in range(19 + 2 * int(SWAY_S + ASK_S), 30 + 2 * int(SWAY_S + ASK_S)):
        alarm.add([Window(k / 2.0, False, True)])
    assert alarm.alarm is not None
    assert alarm.alarm.kind is AlarmKind.ASKING


def test_a_mayday_does_not_end_by_sway() -> None:
    alarm = walked()
    alarm.add([Window(k / 2.0, False) for k in range(21, 90)])
    alarm.add([Window(k / 2.0, False, True) for k in range(90, 120)])
    assert alarm.alarm is not None
    assert alarm.alarm.kind is AlarmKind.MAYDAY
