# SPDX-License-Identifier: MIT
"""The foot board in the place of an MTx: two real firmwares in two simulators, on one time base."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from board_runs import needs_twin
from echostep.localization import Estimate
from echostep.odometry import FrontEnd
from echostep.ports.chunks import FOOT, Chunk, portion_of
from echostep.settings import Settings
from echostep.tracker import Tracker
from odometry.foot_board_walk import SECONDS, walk
from walks import PLAN

pytestmark = needs_twin

CLOCK_BEGINS_S = 1.163e-3  # of the belt board's ticks, after its power-up
TIME_ERROR_S = 1.0e-3  # limit: a millisecond of USB


def front_end() -> FrontEnd:
    s = Settings()
    return FrontEnd(s.mtx, s.ranger, s.foot, s.gait, s.wearer, s.gyro)


def estimates(chunks: list[Chunk], cuts: list[int]) -> list[Estimate]:
    """What a tracker makes of the chunks, in portions cut there."""
    tracker = Tracker(PLAN, seed=1)
    edges = sorted({0, len(chunks), *(c % (len(chunks) + 1) for c in cuts)})
    return [e for a, b in zip(edges, edges[1:], strict=False) for e in tracker.take(portion_of(chunks[a:b]))]


def error_m(e: Estimate, truth: np.ndarray[tuple[int, int], np.dtype[np.float64]]) -> float:
    k = int(np.searchsorted(truth[:, 0], e.t_s))
    return math.hypot(e.x_m - truth[k, 1], e.y_m - truth[k, 2])


@pytest.mark.long
def test_the_foots_samples_are_on_the_belt_boards_time() -> None:
    """The crystals differ by 30 ppm, the boards did not start together."""
    seen: list[float] = []
    ours = front_end()
    track = ours.foot.track

    def noted(t_s: np.ndarray[tuple[int], np.dtype[np.float64]], *more: object) -> object:
        seen.extend(t_s.tolist())
        return track(t_s, *more)  # type: ignore[arg-type]

    for chunk in walk().chunks:
        ours.process(portion_of([chunk]))
        if ours.foot.track is not noted:
            track = ours.foot.track
            ours.foot.track = noted  # type: ignore[method-assign, assignment]
    t_s = np.array(seen)
    true_s = walk().sampled_s - CLOCK_BEGINS_S
    nearest = true_s[np.abs(true_s[:, None] - t_s).argmin(0)]
    errors_s = (t_s - nearest)[len(t_s) // 4 :]
    assert len(t_s) > 0.98 * 225 * SECONDS
    assert np.abs(errors_s).max() < TIME_ERROR_S
    assert ours.foot_source.counts.lost == 0


def test_the_track_of_a_foot_board_is_as_good_as_an_mtxs() -> None:
    found = estimates(walk().chunks, [])
    errors = [error_m(e, walk().truth) for e in found]
    assert len(found) > 30
    assert float(np.mean(errors)) < 0.10


@given(st.lists(st.integers(0, 1 << 20), max_size=8))
@settings(max_examples=4, deadline=None)
def test_any_portions_give_the_same_estimates(cuts: list[int]) -> None:
    assert estimates(walk().chunks, cuts) == estimates(walk().chunks, [])


@pytest.mark.long
def test_a_foot_board_that_is_unplugged_and_plugged_in_again_goes_on() -> None:
    """For two seconds the legs measure the way; the ticks begin anew."""
    faults = ((9.0, "usb=unplug"), (11.0, "usb=plug"), (11.4, "ask"))
    found = estimates(walk(faults).chunks, [])
    silent = [c.t_arrival_ns for c in walk(faults).chunks if c.port == FOOT]
    assert max(np.diff(silent)) > 1.9e9
    late = [error_m(e, walk().truth) for e in found if e.t_s > 16.0]
    assert len(late) > 10
    assert max(late) < 0.6


def test_the_first_device_on_the_foot_is_used_and_named() -> None:
    tracker = Tracker(PLAN)
    assert tracker.streams.foot_name == "MTx"
    for chunk in walk().chunks[:2_000]:
        tracker.feed(chunk)
    assert tracker.streams.foot_name == "foot board"
    assert tracker.streams.mtx.good > 100
