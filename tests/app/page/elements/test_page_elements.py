# SPDX-License-Identifier: MIT
"""Elements of the page: replay cursor, status text, guidance, extrapolation."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from echostep.errors import EchostepError
from echostep.localization import Estimate, LikelyPlace, Start, TrackStatus
from echostep.path import PathSegment
from echostep.plan import Pose
from echostep.ports.chunks import Chunk, portion_of
from echostep.ports.people.check_in import CheckIn
from echostep.tracker import Tracker
from echostep_app.page import requests
from echostep_app.page.elements.guidance import Destination
from echostep_app.page.elements.lookahead import extrapolate, moves_as_one
from echostep_app.page.elements.scene import status_text
from echostep_app.page.elements.stream_rates import StreamRateMeter
from echostep_app.page.elements.taps import Taps
from echostep_app.page.elements.undo_offer import UndoClock, UndoOffer
from echostep_app.page.live import LivePage
from echostep_app.page.mailbox import SceneHistory
from echostep_app.page.player import Player
from echostep_app.plan.routing import RoutePlace, Routes
from page.frames import LOCAL, PLAN, scene, told
from plan.imported_plans import seven_floors


def test_a_player_plays_stops_seeks_and_steps() -> None:
    history = SceneHistory()
    player = Player(history)
    assert player.move(100.0) is None
    for t_s in (10.0, 11.0, 12.0, 13.0):
        history.add(scene(t_s))

    def at(now_s: float) -> float:
        t_s = player.move(now_s)
        assert t_s is not None
        return history.at(t_s).t_s

    assert at(100.0) == 10.0
    assert at(101.5) == 11.0  # a page that was in the background goes on from where it was
    player.handle(requests.SetSpeed(4.0))
    assert at(102.0) == 13.0
    assert at(500.0) == 13.0
    player.handle(requests.Step(-2))
    assert (at(501.0), player.playing) == (11.0, False)
    assert at(502.0) == 11.0
    player.handle(requests.Seek(12.4))
    assert at(503.0) == 12.0
    player.handle(requests.Seek(1e9))
    assert at(504.0) == 13.0
    player.handle(requests.SetPlaying(True))  # at the end: from the beginning
    assert at(504.0) == 10.0


def test_an_errand_finds_its_way_around_walls() -> None:
    destination, here, goal = Destination(RoutePlace(13.0, 4.5)), told(9.0, 7.5), RoutePlace(13.0, 4.5)
    looking = destination.guidance_at(here)
    assert (looking.kind, looking.text, looking.arrow_rad, looking.path) == ("looking", "Looking for a way", None, ())
    upstairs = Destination(RoutePlace(13.0, 4.5, 2)).guidance_at(here)
    assert upstairs.text == "Looking for a way, 2 floors up"
    assert destination.needs_route(here)
    destination.set_route(Routes(PLAN).way(RoutePlace(9.0, 7.5), goal), "", here)
    way = destination.guidance_at(here)
    assert not destination.needs_route(here)
    assert (way.left_m or 0.0) > 5.5  # through the door at (13, 6.5)
    assert way.path[-1] == (13.0, 4.5)
    assert abs(way.arrow_rad or 0.0) < 0.3
    with pytest.raises(EchostepError) as outside:
        Routes(PLAN).way(RoutePlace(9.0, 7.5), RoutePlace(500.0, 500.0))
    destination.set_route(None, str(outside.value), here)
    none = destination.guidance_at(here)
    assert "No way was found: the destination (500.0, 500.0) is outside the plan" in none.text
    assert (none.kind, none.arrow_rad, none.path) == ("none", None, ())
    assert not destination.needs_route(here)
    assert destination.needs_route(told(9.0, 7.5, t_s=10.0))


@pytest.mark.long
def test_a_step_leads_ahead_of_its_echoes(chunks: list[Chunk]) -> None:
    tracker = Tracker(PLAN, Pose(2.0, 7.5, 0.0), seed=1)
    off_m, last, then = [], None, None
    for chunk in chunks:
        new = tracker.feed(chunk)
        if new and then:
            off_m.append(math.hypot(new[0].x_m - then.x_m, new[0].y_m - then.y_m))
            assert new[0].t_s == then.t_s
        if new:
            last, then = new[-1], None
        if last and (since := tracker.state.pending_segments) and tracker.state.last_segment and not then:
            then = extrapolate(last, tracker.state.last_segment, since[:1])
            assert then.xx_m2 > last.xx_m2
    assert len(off_m) > 5
    assert max(off_m) < 0.3
    assert np.median(off_m) < 0.1


@pytest.mark.parametrize("start", [Start(), Pose(2.0, 7.5, 0.0)], ids=["in search", "tracked"])
def test_a_cloud_in_search_waits_for_its_estimate(chunks: list[Chunk], start: Start | Pose) -> None:
    """The step of a mean moves no particle of a search through a wall; a tracked cloud is ahead with its wearer."""
    tracker, moved = Tracker(PLAN, start, seed=1), []
    with LivePage(tracker, "test", LOCAL) as page:
        for begin in range(0, len(chunks), 5):
            portion = portion_of(chunks[begin : begin + 5])
            tracker.take(portion)
            page.publish(portion)
            ahead, last = page._lookahead, page._scene
            if isinstance(start, Start) and tracker.filter is not None and not tracker.state.searches:
                break
            if ahead and ahead.particles and last.particles and ahead.estimate and last.estimate:
                stands = np.array_equal(ahead.particles.x_m, last.particles.x_m) and np.array_equal(
                    ahead.particles.y_m, last.particles.y_m
                )
                is_ahead = (ahead.estimate.x_m, ahead.estimate.y_m) != (last.estimate.x_m, last.estimate.y_m)
                assert is_ahead == last.estimate.claims_place
                moved.append(not stands)
    assert len(moved) > 5
    assert (not any(moved)) if isinstance(start, Start) else all(moved)


@pytest.mark.parametrize(
    ("last", "as_one"),
    [
        (told(), True), (told(status=TrackStatus.UNCERTAIN, sd_m=1.0), True), (told(status=TrackStatus.LOST), False),
        (replace(told(status=TrackStatus.UNCERTAIN), hypotheses=(LikelyPlace(0.6, 5.0, 7.5, 0, 0.4, 0.0),)), False),
        (replace(told(), heading_sd_rad=1.5), False),
    ],
)  # fmt: skip
def test_particles_move_with_the_mean_at_one_place_with_one_heading(last: Estimate, as_one: bool) -> None:
    assert moves_as_one(last) is as_one


@pytest.mark.parametrize(
    ("status", "sd_m", "step_sd_m", "then"),
    [
        (TrackStatus.UNCERTAIN, 4.5, 0.02, "uncertain, 11 m"), (TrackStatus.TRACKING, 0.1, 0.02, "tracking, 0.3 m"),
        (TrackStatus.TRACKING, 0.1, 1.0, "uncertain, 2 m"), (TrackStatus.TRACKING, 0.1, 9.0, "lost: walk along a wall or tap where you are"),
    ],
)  # fmt: skip
def test_a_step_ahead_changes_the_status_only_where_it_widens_the_radius(
    status: TrackStatus, sd_m: float, step_sd_m: float, then: str
) -> None:
    """Half of the probability may be within 5 m of a position whose 95 % radius is 11 m: it stays `uncertain` while a foot lands."""
    last, landed = told(sd_m=sd_m, status=status), PathSegment(1.0, 2.0, 0.7, 0.0, 0.0, 0.0, step_sd_m, 0.0, 2)
    assert status_text(extrapolate(last, landed, [landed])) == then


def test_what_a_tap_would_do_is_said_before() -> None:
    taps, there = Taps(PLAN), replace(scene(), estimate=told(2.0, 7.5, sd_m=0.1), echoes_fit=True)
    plain = taps.consider(CheckIn(2.2, 7.5, None, 0.3), there)
    assert plain.text == "In North corridor. 0.2 m from the estimate. Your direction stays: drag to change it."
    aimed = taps.consider(CheckIn(2.2, 7.5, 1.0, 0.3), None)
    assert (aimed.text, aimed.heading_rad) == ("In North corridor. You face the arrow.", 1.0)
    far = taps.consider(CheckIn(13.0, 4.5, None, 0.3), there)
    assert "11 m from the estimate. The echoes fit the estimate: are you sure?" in far.text
    assert "sure" not in taps.consider(CheckIn(13.0, 4.5, None, 0.3), replace(there, echoes_fit=False)).text
    wall = taps.consider(CheckIn(9.7, 4.0, None, 0.3), there)
    assert wall.text.startswith(
        "Nobody can stand there: it is inside a wall. The nearest possible place is 0.3 m away. In S"
    )
    assert wall.possible
    assert abs(wall.x_m - 9.7) == pytest.approx(0.3)
    assert taps.refusal(CheckIn(9.7, 4.0, None, 0.3)) == "Not accepted: it is inside a wall."
    assert not taps.refusal(CheckIn(9.4, 4.0, None, 0.3))
    upstairs = Taps(seven_floors()).consider(CheckIn(4.0, 10.0, None, 0.3, 3), None)
    assert upstairs.text.startswith("In Office 301, Second floor.")


def test_an_undoing_is_offered_for_ten_seconds_and_again_when_echoes_contradict() -> None:
    clock, state = UndoClock(), replace(Tracker(PLAN).state, undoable=1, right=0.999)
    seconds = 1_000_000_000
    assert clock.offer(replace(state, undoable=None), 0) is None
    assert clock.offer(state, 5 * seconds) == UndoOffer(1, 10.0, False)
    assert clock.offer(state, 12 * seconds) == UndoOffer(1, 3.0, False)
    assert clock.offer(state, 15 * seconds) is None
    assert clock.offer(replace(state, right=0.2), 20 * seconds) == UndoOffer(1, 10.0, True)
    assert clock.offer(replace(state, right=0.2), 30 * seconds) is None
    assert clock.offer(replace(state, undoable=2), 31 * seconds) == UndoOffer(2, 10.0, False)


@pytest.mark.parametrize(
    ("ports", "wrong", "pings_hz"),
    [
        (set(), "", None),
        ({"board"}, "no pings: look at the board's plug and at the rangers", 0.0),
        ({"lines"}, "the foot IMU is silent: look at its plug and its power", None),
    ],
)
def test_what_a_recording_does_not_have_is_not_missed(ports: set[str], wrong: str, pings_hz: float | None) -> None:
    meter, tracker = StreamRateMeter(), Tracker(PLAN)
    meter.ports.update(ports)
    meter.foot = "foot IMU"
    rates = [meter.measure(tracker, t_ns) for t_ns in (0, 1_000_000_000)][-1]
    assert (rates.wrong, rates.pings_hz, rates.foot) == (wrong, pings_hz, "foot IMU")
