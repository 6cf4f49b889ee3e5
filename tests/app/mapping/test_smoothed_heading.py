# SPDX-License-Identifier: MIT
"""Headings in hindsight: the foot's drift that the belt does not confirm, also of the time before the belt's bias was known."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from echostep.arrays import Floats
from echostep.elementary import wrap
from echostep.path import MeasuredSegment, PathSegment
from echostep_app.mapping.graph.nodes import HELD_TURN_SD_RAD, TURN_SD_RAD, nodes_of
from echostep_app.mapping.smoothed_heading import with_smoothed_headings
from odometry.test_heading_fusion import DRIFT_RAD, Walker, growth, numb, segments_of


def errors(walker: Walker, segments: list[MeasuredSegment]) -> Floats:
    """Of the headings (n,), not wrapped."""
    return np.unwrap(np.array([m.segment.heading1_rad for m in segments]) - walker.heading)


@pytest.mark.slow
def test_in_hindsight_the_drift_over_a_minute_is_half_from_the_beginning_on() -> None:
    foot = live = hindsight = stated = 0.0
    for seed in range(8):
        walker = Walker(seed)
        segments = segments_of(walker)
        smoothed = with_smoothed_headings(segments)
        foot += growth(walker.drift, 55)
        live += growth(errors(walker, segments), 55)
        hindsight += growth(errors(walker, smoothed), 55)
        stated += 55.0 * float(np.mean([m.segment.turn_sd_rad**2 for m in smoothed]))
    assert math.sqrt(hindsight / foot) < 0.5
    assert hindsight < 0.6 * live
    assert 0.5 < hindsight / stated < 3.0


def test_ways_turn_with_the_headings_and_segments_join() -> None:
    walker = Walker(2)
    segments = segments_of(walker)
    smoothed = with_smoothed_headings(segments)
    for before, after in zip(smoothed, smoothed[1:], strict=False):
        assert wrap(after.segment.heading0_rad - before.segment.heading1_rad) == pytest.approx(0.0, abs=1e-9)
    for raw, turned in zip(segments, smoothed, strict=True):
        a, b = raw.segment, turned.segment
        assert math.hypot(a.dx_m, a.dy_m) == pytest.approx(math.hypot(b.dx_m, b.dy_m))
        way = math.atan2(b.dy_m, b.dx_m) - math.atan2(a.dy_m, a.dx_m)
        heading = 0.5 * (wrap(b.heading0_rad - a.heading0_rad) + wrap(b.heading1_rad - a.heading1_rad))
        assert abs(wrap(way - heading)) < 3.0 * DRIFT_RAD


def paths(measured: list[MeasuredSegment]) -> list[PathSegment]:
    """The segments without their pings, whose arrays no `==` compares."""
    return [m.segment for m in measured]


def test_without_a_belt_or_with_one_that_does_not_turn_nothing_changes() -> None:
    walker = Walker(1, 100)
    numbed = segments_of(walker, numb)
    assert paths(with_smoothed_headings(numbed)) == paths(numbed)
    without = [replace(m, segment=replace(m.segment, belt=None)) for m in numbed]
    assert paths(with_smoothed_headings(without)) == paths(without)
    assert with_smoothed_headings([]) == []


def test_a_heading_that_the_belt_holds_drifts_less_in_the_graph() -> None:
    """By the length of each step but the first, beside what it states; a belt that does not turn with the wearer holds nothing."""
    assert HELD_TURN_SD_RAD < TURN_SD_RAD
    for change, growth_rad in ((lambda _, rate: rate, HELD_TURN_SD_RAD), (numb, TURN_SD_RAD)):
        segments = with_smoothed_headings(segments_of(Walker(1, 100), change))
        stated = np.array([m.segment.turn_sd_rad for m in segments])
        length_m = np.array([math.hypot(m.segment.dx_m, m.segment.dy_m) for m in segments])
        expected = np.hypot(stated, growth_rad * np.sqrt(length_m))
        np.testing.assert_allclose(nodes_of(segments)[0].turn_sd_rad[1:], expected[1:])


def test_a_belt_that_fails_leaves_the_rest_as_it_was_live() -> None:
    walker, fails_s = Walker(3), 300.0
    t_s, rate = walker.belt()
    failed = np.where(t_s < fails_s, rate, np.nan)
    segments = segments_of(walker, lambda *_: failed)
    smoothed = with_smoothed_headings(segments)
    shift = np.array(
        [wrap(b.segment.heading1_rad - a.segment.heading1_rad) for a, b in zip(segments, smoothed, strict=True)]
    )
    after = np.array([m.segment.t0_s > fails_s + 2.0 for m in segments])
    assert np.ptp(shift[after]) < 1e-9
    assert growth(errors(walker, smoothed)[:250], 55) < growth(walker.drift[:250], 55)


def test_legs_in_between_begin_a_new_record() -> None:
    """Segments of the legs keep their joint to what was before; what the foot's frame turned by then is no drift."""
    walker = Walker(4)
    segments = segments_of(walker)
    legs = [replace(m, segment=replace(m.segment, belt=None)) for m in segments[200:210]]
    turned = [
        replace(
            m,
            segment=replace(
                m.segment, heading0_rad=m.segment.heading0_rad + 1.0, heading1_rad=m.segment.heading1_rad + 1.0
            ),
        )
        for m in segments[210:]
    ]
    smoothed = with_smoothed_headings([*segments[:200], *legs, *turned])
    shift = [
        wrap(b.segment.heading1_rad - a.segment.heading1_rad)
        for a, b in zip([*segments[:200], *legs, *turned], smoothed, strict=True)
    ]
    assert np.ptp(shift[199:210]) < 1e-9
    assert abs(wrap(shift[211] - shift[209])) < 4.0 * DRIFT_RAD
