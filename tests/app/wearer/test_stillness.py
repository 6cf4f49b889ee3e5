# SPDX-License-Identifier: MIT
"""Windows with and without motion."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from echostep.arrays import Floats
from echostep.legs.trunk_path import GyroBlock
from echostep_app.wearer.stillness import MOST_SAMPLES, WINDOW_S, MotionWindows, Stillness, Window


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
