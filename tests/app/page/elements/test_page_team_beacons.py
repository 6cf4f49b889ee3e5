# SPDX-License-Identifier: MIT
"""Beacons of teammates on the page."""

from __future__ import annotations

import math

import pytest

from aiding.team.two_wearers import Two, told, two_wearers
from echostep.ports.people.team_beacons import SharedBeacon
from echostep_app.page.elements.marks import beacon_marks


@pytest.fixture(scope="module")
def two() -> Two:
    return two_wearers()


@pytest.mark.slow
def test_a_page_shows_the_teammates_beacons_that_are_not_its_own(two: Two) -> None:
    far = SharedBeacon(99, 20.0, 2.0, 0, 0.04, 0.0, 0.01)
    tracker, estimates = two.run(told(*two.beacons, far))
    marks = {mark.number: mark for mark in beacon_marks(tracker, estimates[-1].t_s)}
    assert (marks[99].by, marks[99].state, marks[99].heard) == ("kim", "well", False)
    assert marks[99].radius95_m == pytest.approx(0.2 * math.sqrt(5.991), rel=1e-3)
    own = [mark for mark in marks.values() if mark.by is None]
    assert (
        {mark.number for mark in own} == {tracker.gateway.numbers[p.slot] for p in tracker.beacon_places(0.0)} != set()
    )
