"""Elements of the page: replay cursor, status text, guidance, extrapolation."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from echostep.errors import EchostepError
from echostep.localization.estimate import TrackStatus
from echostep.page import protocol
from echostep.page.elements.guidance import Destination, RouteFinder, straight_line
from echostep.page.elements.lookahead import extrapolate
from echostep.page.elements.scene import status_text
from echostep.page.mailbox import SceneHistory
from echostep.page.replay_cursor import ReplayCursor
from echostep.plan.model import Pose
from echostep.plan.routing import RoutePlace
from echostep.ports.chunks import Chunk
from echostep.tracker import Tracker
from page.frames import PLAN, scene, told


def test_a_cursor_plays_stops_seeks_and_steps() -> None:
    history = SceneHistory()
    cursor = ReplayCursor(history)
    assert cursor.scene(100.0) is None
    for t_s in (10.0, 11.0, 12.0, 13.0):
        history.add(scene(t_s))

    def at(now_s: float) -> float:
        shown = cursor.scene(now_s)
        assert shown is not None
        return shown.t_s

    assert at(100.0) == 10.0
    assert at(101.5) == 11.0
    cursor.handle(protocol.SetSpeed(4.0))
    assert at(101.9) == 13.0
    assert at(500.0) == 13.0
    cursor.handle(protocol.StepBy(-2))
    assert (at(501.0), cursor.playing) == (11.0, False)
    assert at(502.0) == 11.0
    cursor.handle(protocol.Seek(12.4))
    assert at(503.0) == 12.0
    cursor.handle(protocol.Seek(1e9))
    assert at(504.0) == 13.0
    cursor.handle(protocol.SetPlaying(True))  # at the end: from the beginning
    assert at(504.0) == 10.0


def test_status_in_words() -> None:
    assert status_text(told()) == "tracking, 0.2 m"
    assert status_text(told(sd_m=1.2, status=TrackStatus.UNCERTAIN)) == "uncertain, 3 m"
    assert status_text(told(status=TrackStatus.LOST)) == "lost: walk along a wall or tap where you are"
    assert status_text(None, needs_start=True) == "tap where you stand to start"


def test_an_errand_finds_its_way_around_walls() -> None:
    destination, here, goal = Destination(RoutePlace(13.0, 4.5)), told(9.0, 7.5), RoutePlace(13.0, 4.5)
    assert "straight line" in destination.guidance_at(here).text
    assert destination.needs_route(here)
    destination.set_route(RouteFinder(PLAN).find(here, goal), "", here)
    way = destination.guidance_at(here)
    assert not destination.needs_route(here)
    assert (way.left_m or 0.0) > 5.5  # through the door at (13, 6.5)
    assert way.path[-1] == (13.0, 4.5)
    assert abs(way.arrow_rad or 0.0) < 0.3
    with pytest.raises(EchostepError) as outside:
        RouteFinder(PLAN).find(here, RoutePlace(500.0, 500.0))
    destination.set_route(None, str(outside.value), here)
    assert "outside the plan" in destination.guidance_at(here).text
    assert not destination.needs_route(here)
    assert destination.needs_route(told(9.0, 7.5, t_s=10.0))


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


def test_guidance_points_and_arrives() -> None:
    way = straight_line(told(), RoutePlace(2.0, 17.5, 0))
    assert (way.left_m or 0.0) == 10.0
    assert way.arrow_rad == pytest.approx(math.pi / 2)
    assert straight_line(told(), RoutePlace(2.3, 7.5, 0)).text == "You have arrived"
    assert "1 floor up" in straight_line(told(), RoutePlace(2.3, 7.5, 1)).text
    looks_north = replace(told(), heading_rad=math.pi / 2)
    assert straight_line(looks_north, RoutePlace(2.0, 17.5, 0)).arrow_rad == pytest.approx(0.0)
    unknown = straight_line(replace(told(), heading_sd_rad=2.0), RoutePlace(2.0, 17.5, 0))
    assert (unknown.kind, unknown.arrow_rad) == ("stop", None)
