# SPDX-License-Identifier: MIT
"""Beacons that teammates have placed: what they do to a cloud, that nothing counts twice, and what hostile messages can do."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aiding.team.two_wearers import BUILDING, Two, filter_at, told, two_wearers
from echostep.aiding import MOST_TEAMMATES, AidedFilter, MeetingEffect, MeetingQueue, TeamBeaconMap
from echostep.aiding.team.meeting import Meeting
from echostep.aiding.team.meeting_memory import RENEWED_M, MeetingMemory
from echostep.board.gateway import BeaconReading
from echostep.localization import Start, digest
from echostep.path import Odometer
from echostep.ports.chunks import Chunk
from echostep.ports.people.team_beacons import MOST_SHARED, TEAM_BEACONS, SharedBeacon, parse_team_beacons
from echostep.tracker import Tracker
from walks import PLAN

BEACON = SharedBeacon(7, 4.0, 7.5, 0, 0.01, 0.0, 0.01)


def a_range(range_m: float, number: int = 7, name: str = "kim") -> Meeting:
    return Meeting(name, "uncertain", 4.0, 7.5, 0, 0.01, 0.0, 0.01, range_m=range_m, range_sd_m=0.4, beacon=number)


def spread_along(f: AidedFilter) -> float:
    """Standard deviation of the cloud along x."""
    return math.sqrt(float(np.cov(f.cloud.map_x_m, aweights=f.cloud.weight)))


def test_a_range_narrows_a_wide_cloud_towards_the_circle() -> None:
    wide = filter_at(7.0, 7.5, 1.2)
    before = spread_along(wide)
    assert wide.meet(a_range(2.4)) is MeetingEffect.USED
    assert spread_along(wide) < 0.75 * before
    assert abs(float(wide.cloud.weight @ wide.cloud.map_x_m) - 6.4) < 0.35


def test_a_sure_cloud_is_not_changed_by_a_bit_and_not_made_surer() -> None:
    sure = filter_at(7.0, 7.5, 0.05, right=0.6)
    before, drawn = sure.cloud.log_weight.copy(), sure._rng.bit_generator.state
    assert sure.meet(a_range(3.0)) is MeetingEffect.USED
    assert np.array_equal(sure.cloud.log_weight, before)
    assert sure._rng.bit_generator.state == drawn
    assert sure.belief.probability(sure.belief.tracked) == pytest.approx(0.6)


def test_beacons_of_one_teammate_do_not_make_a_stated_start_improbable_but_those_of_two_do() -> None:
    """They move nothing, and they are no witness for a tap: by taps a stated start is given up when two teammates contradict it."""
    stated = filter_at(20.0, 2.0, 0.15)
    before = stated.cloud.x_m.copy()
    for number in range(20):
        assert stated.meet(a_range(1.0, number)) is MeetingEffect.CONTRADICTS
    assert 0.6 < stated.belief.probability(stated.belief.tracked) < 0.7
    elsewhere = Meeting("anna", "tracking", 4.0, 7.5, 0, 0.0025, 0.0, 0.0025)
    assert stated.meet(elsewhere) is MeetingEffect.CONTRADICTS
    stated.meet(a_range(1.0, name="bo"))
    assert stated.belief.probability(stated.belief.tracked) < 0.5
    assert np.array_equal(stated.cloud.x_m, before)


def test_ranges_that_fit_take_back_doubt_and_give_nothing_more() -> None:
    stated = filter_at(7.0, 7.5, 0.15)
    assert stated.meet(a_range(9.0)) is MeetingEffect.CONTRADICTS  # an outlier
    assert stated.belief.probability(stated.belief.tracked) < 0.96
    for number in range(8, 12):
        assert stated.meet(a_range(3.0, number)) is MeetingEffect.USED
    assert stated.belief.probability(stated.belief.tracked) == pytest.approx(0.99)


def test_a_search_is_narrowed_by_ranges_of_two_beacons_that_it_fits_badly_at_first() -> None:
    """Of a whole building, a short range leaves a small ring: less than chance explains, and yet the ring."""
    lost = AidedFilter(BUILDING, Start(), 0.0, np.random.default_rng(4))
    assert lost.belief.is_searching
    for range_m, number in ((0.5, 7), (0.5, 8)):
        lost.meet(a_range(range_m, number))
    near = np.hypot(lost.cloud.map_x_m - 4.0, lost.cloud.y_m - 7.5) < 2.0
    assert float(lost.cloud.weight @ near) > 0.8


def test_a_search_that_begins_later_is_weighed_by_the_same_beacons_again() -> None:
    odometer = Odometer()
    memory = MeetingMemory(odometer)
    tap = Meeting("kim", "tracking", 4.0, 7.5, 0, 0.01, 0.0, 0.01)
    assert (memory.refusal(a_range(2.0)), memory.refusal(tap)) == (None, None)
    memory.forget_beacons()
    odometer.add(1.0)
    assert memory.refusal(a_range(2.0)) is None
    assert memory.refusal(tap) is MeetingEffect.REPEATED


def test_a_beacon_counts_once_on_a_way_but_each_of_them_does() -> None:
    odometer = Odometer()
    memory = MeetingMemory(odometer)
    assert memory.refusal(a_range(2.0)) is None
    odometer.add(0.9 * RENEWED_M)
    assert memory.refusal(a_range(2.0)) is MeetingEffect.REPEATED
    assert memory.refusal(a_range(2.0, number=8)) is None
    assert memory.refusal(a_range(2.0, name="bo")) is None
    odometer.add(0.2 * RENEWED_M)
    assert memory.refusal(a_range(2.0)) is None


def test_ranges_to_beacons_are_counted_but_are_no_news() -> None:
    queue = MeetingQueue()
    queue.note(a_range(2.0), MeetingEffect.USED)
    assert queue.counts == {"beacon used": 1}
    assert queue.news is None


def test_readings_of_told_beacons_become_ranges() -> None:
    beacons = TeamBeaconMap()
    beacons.receive(told(BEACON, SharedBeacon(9, 1.0, 1.0, 0, 0.1, 0.0, 0.1)).encode(), 1)
    beacons.receive(told(BEACON, name="bo").encode(), 1)
    readings = [BeaconReading(1.0, 0, 2.5, math.nan), BeaconReading(1.1, 1, 4.0, math.nan)]
    ranges = [met for _, met in beacons.ranges(readings, [7, 8])]
    assert [(m.name, m.beacon, m.range_m) for m in ranges] == [("kim", 7, 2.5), ("bo", 7, 2.5)]
    beacons.receive(told(name="kim").encode(), 1)  # a newer message replaces it
    assert [m.name for _, m in beacons.ranges(readings, [7, 8])] == ["bo"]


def test_only_so_many_teammates_are_kept_the_newest() -> None:
    beacons = TeamBeaconMap()
    for k in range(MOST_TEAMMATES + 3):
        beacons.receive(told(BEACON, name=f"w{k}").encode(), 1)
    assert len(beacons.reported) == MOST_TEAMMATES
    assert "w0" not in beacons.reported
    assert f"w{MOST_TEAMMATES + 2}" in beacons.reported


def test_a_message_comes_back_from_its_bytes() -> None:
    made = told(BEACON, SharedBeacon(65535, -1.25, 2.5, 0, 0.5, -0.1, 0.25))
    assert parse_team_beacons(made.encode()) == made
    full = told(*(SharedBeacon(60000 + k, -100.25, 100.25, 0, 0.1234, -0.1234, 0.1234) for k in range(MOST_SHARED)))
    assert parse_team_beacons(full.encode()) == full


_SHARED = Tracker(PLAN)


@given(st.binary(max_size=600) | st.sampled_from([
    told(BEACON, BEACON).encode(), told(SharedBeacon(7, 4.0, 7.5, 0, 0.01, 0.5, 0.01)).encode(),
    told(SharedBeacon(7, 4.0, 7.5, 9, 1.0, 0.0, 1.0)).encode(),
    told(*(SharedBeacon(k, 0.0, 0.0, 0, 1.0, 0.0, 1.0) for k in range(MOST_SHARED + 1))).encode(), told(BEACON).encode().replace(b"4.0", b"1e999"),
    told(BEACON).encode().replace(b"0.01", b"-0.01"), told(BEACON).encode() + b" " * 8192, b"[" * 5000,
]))  # fmt: skip
def test_hostile_messages_are_counted_and_change_nothing(payload: bytes) -> None:
    tracker = _SHARED
    before = tracker.state.team_beacon_messages.get("bad", 0)
    tracker.feed(Chunk(TEAM_BEACONS, 0, payload))
    assert tracker.state.team_beacon_messages == {"bad": before + 1}
    assert tracker.state.team_beacons == {}
    assert tracker.front_end.counts.unknown_ports == 0


@pytest.fixture(scope="module")
def two() -> Two:
    return two_wearers()


def test_placed_beacons_are_told_with_a_covariance_that_holds_their_errors(two: Two) -> None:
    assert len(two.beacons) >= 2
    for b in two.beacons:
        x, y = two.true_places[b.number - 1]
        off = np.array([b.x_m - x, b.y_m - y])
        spread = np.array([[b.xx_m2, b.xy_m2], [b.xy_m2, b.yy_m2]])
        assert off @ np.linalg.inv(spread) @ off < 16.0  # four standard deviations
        assert math.hypot(*off) < 0.8
    assert Tracker(PLAN, two.start, seed=1).own_beacons() is None  # before the first estimate


@pytest.mark.long
def test_a_run_with_a_teammates_beacons_is_the_same_in_any_portions(two: Two) -> None:
    """They weigh the cloud, and a replay has them as the live run had."""
    message = told(*two.beacons)
    tracker, one = two.run(message, 40)
    assert digest(one) == digest(two.run(message)[1])
    assert digest(one) != digest(two.run(None)[1])
    assert tracker.state.meetings["beacon used"] >= 2
    assert tracker.state.met is None
    assert tracker.state.team_beacons == {"kim": two.beacons}
