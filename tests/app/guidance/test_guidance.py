# SPDX-License-Identifier: MIT
"""Guidance: one cue at a time, no guidance without knowledge; ways around walls and over stairs."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from echostep.errors import EchostepError
from echostep.localization import Estimate, TrackStatus
from echostep.plan import Connector, Level, Plan
from echostep_app.guidance.cues import NEVER_KNOWN, CueKind, Guide, arrow_sign, describe_cue
from echostep_app.plan.polyline import along, nearest, way_m
from echostep_app.plan.routing import BODY_M, Route, RoutePlace, Routes, Stretch
from walks import PLAN

LINE = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]])
HERE = Estimate(0.0, 0.0, 0.0, 0.01, 0.0, 0.01, 0.0, 0.05, 0, TrackStatus.TRACKING)


def guide() -> Guide:
    return Guide(Route((Stretch(0, LINE),)))


def at(t_s: float, x: float, y: float, heading_deg: float = 0.0, **changed: object) -> Estimate:
    return replace(HERE, t_s=t_s, x_m=x, y_m=y, heading_rad=math.radians(heading_deg), **changed)  # type: ignore[arg-type]


def test_follows_a_way_to_its_end() -> None:
    g = guide()
    assert g.cue(at(0, 0.0, 0.1)).kind is CueKind.AHEAD
    corner = g.cue(at(8, 9.0, 0.0))
    assert (corner.kind, corner.text) == (CueKind.TURN, "Turn left")
    assert g.cue(at(14, 10.0, 5.0, 90)).kind is CueKind.AHEAD
    end = g.cue(at(19, 10.0, 9.5, 90))
    assert (end.kind, end.arrow_rad) == (CueKind.ARRIVED, None)


def test_speaks_once_and_again_after_a_while() -> None:
    g = guide()
    spoken = [g.cue(at(t, 9.0, 0.0)).spoken for t in range(10)]
    assert spoken == ["Turn left.", *[""] * 7, "Turn left.", ""]


def test_stop_when_the_heading_is_unknown() -> None:
    cue = guide().cue(at(0, 1.0, 0.0, heading_sd_rad=2.0))
    assert (cue.kind, cue.arrow_rad) == (CueKind.STOP, None)
    assert cue.spoken.startswith("Stop.")


def test_return_to_the_last_known_place_when_lost() -> None:
    g = guide()
    g.cue(at(0, 5.0, 0.0))
    cue = g.cue(at(3, 8.0, 0.0, status=TrackStatus.LOST))
    assert cue.kind is CueKind.RETURN
    assert abs(cue.arrow_rad or 0.0) == pytest.approx(math.pi, abs=0.3)
    there = g.cue(at(6, 5.2, 0.0, 180, status=TrackStatus.LOST))
    assert (there.kind, there.text) == (CueKind.OFF, "Your place is not known. Go on")
    assert there.arrow_rad is not None


def test_a_place_that_was_never_known_asks_for_a_walk() -> None:
    cue = guide().cue(at(0, 5.0, 0.0, status=TrackStatus.LOST))
    assert (cue.kind, cue.text, cue.arrow_rad) == (CueKind.STOP, NEVER_KNOWN, None)


def test_sends_back_after_three_seconds_without_a_beacon() -> None:
    g = guide()
    kinds = [g.cue(at(t, 1.0 + t, 0.0), heard_s=0.0).kind for t in range(9)]
    assert kinds == [CueKind.AHEAD] * 4 + [CueKind.RETURN] * 5


def test_an_end_that_is_reached_is_told_although_no_beacon_measures_there() -> None:
    g = guide()
    g.cue(at(0, 9.0, 5.0, 90), heard_s=0.0)
    assert g.cue(at(9, 10.0, 9.5, 90), heard_s=0.0).kind is CueKind.ARRIVED


def test_silence_is_told_once_and_not_at_every_estimate() -> None:
    g = guide()
    g.cue(at(0, 1.0, 0.0), heard_s=0.0)
    spoken = [g.cue(at(3.5 + 0.1 * k, 1.1, 0.0), heard_s=0.0).spoken for k in range(5)]
    assert [bool(sentence) for sentence in spoken] == [True, True, False, False, False]  # to go back, on again


def test_rare_measurements_are_no_silence() -> None:
    g = guide()
    told = [g.cue(at(t, 1.0, 0.0), heard_s=float(t - t % 5)).kind for t in range(60)]
    assert CueKind.RETURN in told[:10]  # that they are rare must be learnt
    assert set(told[10:]) == {CueKind.AHEAD}


def test_at_the_last_known_place_the_way_leads_on_for_twice_as_long_and_never_stops() -> None:
    """The wearer obeys, and no beacon measures any more: each attempt goes twice as far as the last one."""
    g, x = guide(), 0.0
    told: list[CueKind] = []
    far: list[float] = []
    line = np.array([[0.0, 0.0], [400.0, 0.0]])
    g.route = Route((Stretch(0, line),))
    for t in range(200):
        cue = g.cue(at(t, x, 0.0), heard_s=0.0)
        if cue.kind is CueKind.RETURN and told and told[-1] is not CueKind.RETURN:
            far.append(x)
        told.append(cue.kind)
        x += -1.0 if cue.kind is CueKind.RETURN else 1.0
    assert CueKind.STOP not in told
    assert far == pytest.approx([4.0, 7.0, 13.0, 25.0, 49.0], abs=2.0)


def test_on_another_level_than_the_last_known_place_the_way_leads_on() -> None:
    g = Guide(Routes(two_storeys("stairs")).way(RoutePlace(2.0, 5.0, 0), RoutePlace(2.0, 2.0, 1)))
    g.cue(at(0, 14.0, 5.0), heard_s=0.0)
    cue = g.cue(at(30, 15.0, 5.0, 180, level=1), heard_s=0.0)
    assert (cue.kind, cue.text) == (CueKind.OFF, "No beacon hears you. Go on")
    assert cue.arrow_rad == pytest.approx(0.0, abs=0.5)


def test_who_was_sent_back_may_go_twice_as_far_until_he_is_heard_for_long() -> None:
    """Three dead beacons in a row are a gap that nobody would ever cross if he were always sent back as early."""
    g = guide()

    def sent_back_after(heard_s: float) -> int:
        """Last second of silence in which the way leads on; the wearer walks, then is heard 2 m from the last known place."""
        for k in range(20):
            g.cue(at(heard_s + 0.1 * k, 5.0, 0.0), heard_s=heard_s + 0.1 * k)
        last_s = heard_s + 1.9
        found = [t for t in range(60) if g.cue(at(last_s + t, 7.0, 0.0), heard_s=last_s).kind is CueKind.RETURN]
        return found[0] - 1

    assert [sent_back_after(100.0 * k) for k in range(3)] == [3, 6, 12]
    for t in range(400, 420):
        g.cue(at(t, 5.0, 0.0), heard_s=float(t))
    assert sent_back_after(420.0) == 3


def test_warns_when_leaving_the_path_and_leads_back_to_it() -> None:
    g = guide()
    g.cue(at(0, 4.0, 0.0))
    cue = g.cue(at(5, 5.0, 4.0))
    assert cue.kind is CueKind.OFF
    assert "left the way" in cue.text
    assert -math.pi < (cue.arrow_rad or 0.0) < -math.radians(45)  # to the right, down to the line


def test_does_not_jump_to_where_the_way_comes_by_again() -> None:
    line = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 1.0], [0.0, 1.0]])
    g = Guide(Route((Stretch(0, line),)))
    g.cue(at(0, 1.0, 0.0))
    assert g.cue(at(2, 3.0, 0.6)).arrow_rad == pytest.approx(0.0, abs=0.4)


def test_the_arrow_is_relative_to_the_heading() -> None:
    cue = guide().cue(at(0, 3.0, 0.0, -90))
    assert cue.arrow_rad == pytest.approx(math.pi / 2)
    assert arrow_sign(cue.arrow_rad) == "←"
    assert describe_cue(cue).startswith("←  Turn left   17 m")


# ---- ways on a plan


def test_ways_keep_off_the_walls_and_reach_every_room() -> None:
    routes, walls = Routes(PLAN), PLAN.levels[0].walls
    start = RoutePlace(2.0, 7.5)
    for room in PLAN.levels[0].rooms:
        way = routes.way(start, RoutePlace(*room.at_m))
        line = way.stretches[0].line_m
        assert np.allclose(line[-1], room.at_m)
        assert way.length_m >= math.hypot(line[-1, 0] - 2.0, line[-1, 1] - 7.5) - 1e-9
        for s in np.arange(0.3, way.length_m - 0.3, 0.1):
            x, y, _ = along(line, s)
            assert min(nearest(w.reshape(2, 2), x, y, 0.0, math.inf)[1] for w in walls) > BODY_M - 0.2


def two_storeys(kind: str) -> Plan:
    walls = np.array([[0.0, 0.0, 20.0, 0.0], [20.0, 0.0, 20.0, 10.0], [20.0, 10.0, 0.0, 10.0], [0.0, 10.0, 0.0, 0.0]])
    outline = np.array([[15.0, 4.0], [18.0, 4.0], [18.0, 6.0], [15.0, 6.0]])
    levels = (Level("ground", 0.0, walls), Level("first", 3.5, walls))
    return Plan("two", levels, None, "", (Connector(kind, f"{kind} A", (0, 1), outline),))  # type: ignore[arg-type]


@pytest.mark.parametrize("kind", ["stairs", "lift", "ramp"])
def test_way_over_stairs_is_guided_level_by_level(kind: str) -> None:
    way = Routes(two_storeys(kind)).way(RoutePlace(2.0, 5.0, 0), RoutePlace(2.0, 2.0, 1))
    assert [s.level for s in way.stretches] == [0, 1]
    assert way.stretches[0].by == f"{kind} A"
    g = Guide(way)
    assert g.cue(at(0, 2.0, 5.0)).kind is CueKind.AHEAD
    cue = g.cue(at(12, 14.0, 5.0))
    assert (cue.kind, cue.text) == (CueKind.CHANGE, f"Take the {kind} A up")
    assert g.cue(at(30, 15.0, 5.0, 180, level=1)).kind is CueKind.AHEAD
    assert g.cue(at(50, 2.0, 2.0, 180, level=1)).kind is CueKind.ARRIVED


@pytest.mark.parametrize("connectors", [1, 2])
def test_the_way_goes_round_a_wall_between_two_flights_of_stairs(connectors: int) -> None:
    plan, between = two_storeys("stairs"), np.array([[16.5, 3.0, 16.5, 5.4]])
    ground = replace(plan.levels[0], walls=np.vstack([plan.levels[0].walls, between]))
    plan = replace(plan, levels=(ground, plan.levels[1]), connectors=connectors * plan.connectors)
    line = Routes(plan).way(RoutePlace(14.0, 4.5), RoutePlace(19.0, 4.5)).stretches[0].line_m
    at_wall = float(np.interp(16.5, line[:, 0], line[:, 1]))
    assert at_wall > 5.4 + BODY_M - 0.15 or at_wall < 3.0 - BODY_M + 0.15


def test_who_leaves_the_way_gets_another_one_around_the_walls() -> None:
    routes = Routes(PLAN)
    goal = PLAN.levels[0].rooms[3].at_m
    again = partial(routes.way, end=RoutePlace(*goal))
    g = Guide(again(RoutePlace(2.0, 7.5)), again=again)
    g.cue(at(0, 2.0, 7.5))
    cue = g.cue(at(20, 6.3, 4.9))  # he went into the store
    assert cue.kind is CueKind.OFF
    assert np.allclose(g.route.stretches[0].line_m[0], (6.3, 4.9))
    assert g.cue(at(21, 6.3, 4.9)).kind in (CueKind.TURN, CueKind.AHEAD)


def test_unreachable_and_outside_places_are_named() -> None:
    box = np.array([[8.0, 3.0, 12.0, 3.0], [12.0, 3.0, 12.0, 7.0], [12.0, 7.0, 8.0, 7.0], [8.0, 7.0, 8.0, 3.0]])
    plan = two_storeys("stairs")
    closed = replace(
        plan, levels=(replace(plan.levels[0], walls=np.vstack([plan.levels[0].walls, box])),), connectors=()
    )
    routes = Routes(closed)
    with pytest.raises(EchostepError, match="there is no route"):
        routes.way(RoutePlace(2.0, 5.0), RoutePlace(10.0, 5.0))
    with pytest.raises(EchostepError, match="outside the plan"):
        routes.way(RoutePlace(2.0, 5.0), RoutePlace(90.0, 5.0))
    with pytest.raises(EchostepError, match="level 3"):
        routes.way(RoutePlace(2.0, 5.0), RoutePlace(2.0, 5.0, 3))


@given(st.floats(0.0, 25.0))
def test_along_and_nearest_agree(s: float) -> None:
    x, y, _ = along(LINE, s)
    found, off = nearest(LINE, x, y, 0.0, math.inf)
    assert off < 1e-9
    assert found == pytest.approx(min(s, way_m(LINE)), abs=1e-9)
