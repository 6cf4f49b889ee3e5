# SPDX-License-Identifier: MIT
"""The studies of teams and of operations on short ones: who meets whom, manners of moving, what the rows say."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from echostep.arrays import Floats
from echostep.board.gateway import Gateway
from echostep.localization import Estimate, TrackStatus
from echostep_simulation.people.walker import Manner, Person, walk
from echostep_simulation.scenario import START_NS
from echostep_simulation.world.tower import STOREY_M, stairs_from, tower
from echostep_studies.frame.study import StudyRequest, run_study
from echostep_studies.operation import study as operation_study
from echostep_studies.operation.walks import CHANGE_S, MANNERS, operation, waypoints
from echostep_studies.team import study, tracking, walks
from echostep_studies.team.beacons import MOST_EACH, dropped_on, with_dropped_beacons
from echostep_studies.team.walks import AGAIN_S, TeamWalks, encounters
from walks import PLAN

T_S = np.arange(0.0, 100.0, 0.02)


def walked(x_m: Floats | float, y_m: float, z_m: float = 0.0) -> Floats:
    """A truth along x."""
    zero = np.zeros_like(T_S)
    return np.column_stack([T_S, zero + x_m, zero + y_m, zero, zero + z_m])


def test_two_who_pass_in_a_corridor_meet_at_their_nearest() -> None:
    """In the corridor of the demo office (y from 6.5 to 8.5 m), at 1 m/s each, once; not through a wall and not on another floor."""
    going, coming = walked(4.0 + 0.15 * T_S, 7.2), walked(20.0 - 0.15 * T_S, 7.8)
    (met,) = encounters(PLAN, [going, coming])
    assert met.who == (0, 1)
    assert met.t_s == pytest.approx(16.0 / 0.3, abs=0.02)
    assert met.distance_m == pytest.approx(0.6, abs=0.01)
    assert not encounters(PLAN, [walked(4.5 + 0.05 * T_S, 8.2), walked(7.5, 8.8)])  # an office's wall between
    assert not encounters(PLAN, [going, walked(20.0 - 0.15 * T_S, 7.8, 3.0)])


def test_two_who_stay_together_meet_once_and_again_after_a_while() -> None:
    swinging = walked(10.0 + 3.0 * np.sin(2.0 * np.pi * T_S / 10.0), 7.2)
    met = encounters(PLAN, [swinging, walked(10.0, 7.8)])
    assert len(met) == 100.0 // AGAIN_S or len(met) == 100.0 // AGAIN_S + 1
    assert min(np.diff([e.t_s for e in met])) >= AGAIN_S
    assert len(encounters(PLAN, [walked(10.0, 7.2), walked(10.0, 7.8)])) == 1


def test_beacons_are_heard_from_when_they_are_dropped_on_their_floor_and_through_no_wall() -> None:
    """One wearer walks along the corridor at 0.2 m/s and drops beacons, a second one waits there, a third one in an office, a fourth upstairs."""
    going = walked(4.0 + 0.2 * T_S, 7.5)
    truth = (going, walked(20.0, 7.5), walked(20.0, 10.5), walked(20.0, 7.5, 3.0))
    heard = with_dropped_beacons(TeamWalks(PLAN, ((),) * 4, truth, (), ()), 3).chunks
    dropped = {b.number: b for b in dropped_on(going, 0, np.random.default_rng(1))}
    assert [b.x_m for b in dropped.values()] == pytest.approx([4.0, 9.0, 14.0, 19.0], abs=0.31)
    assert [b.t_s for b in dropped.values()] == pytest.approx([0.0, 25.0, 50.0, 75.0], abs=0.03)
    for who, chunks in enumerate(heard):
        gateway, first_s = Gateway(), dict[int, float]()
        for chunk in chunks:
            for reading in gateway.read(chunk.data, 1e-9 * (chunk.t_arrival_ns - START_NS)):
                first_s.setdefault(gateway.numbers[reading.slot], reading.t_s)
        of_first = {number: t_s for number, t_s in first_s.items() if number in dropped}
        assert all(t_s >= dropped[number].t_s - 0.01 for number, t_s in of_first.items())
        assert set(of_first) == ({1, 2, 3, 4} if who == 0 else {3, 4} if who == 1 else set())
        assert who * MOST_EACH + 1 in first_s  # its own


def test_the_columns_are_those_of_all_wearers() -> None:
    rows = [
        study.WearerRun(
            name="office/tap",
            wearer=k,
            meetings=2,
            alone_m=a,
            false_alone=0.0,
            together_m=b,
            false_together=0.0,
            again_m=a,
            false_again=0.0,
            seed=1,
        )
        for k, a, b in ((0, 4.0, 1.0), (1, 0.5, 0.5), (2, 0.5, 0.55))
    ]
    found = study._summary(rows)
    assert (found["ratio"], found["worst"], found["by_chance"]) == (0.41, 1.1, 1.0)
    assert (found["first_alone_m"], found["others_together_m"]) == (4.0, 0.525)


def test_a_short_team(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two wearers on one way; the first one's start is wrong. They meet when, alone, it says lost and the other says tracking.

    It changes the first one's track alone.
    """
    for module in (walks, study):
        monkeypatch.setattr(module, "WEARERS", 2)
    made, alone = walks.team_walks, []

    def on_one_way(*args: Any, **more: Any) -> walks.TeamWalks:
        team = made(*args, **more)
        return replace(team, chunks=(team.chunks[0],) * 2, truth=(team.truth[0],) * 2, starts=(team.starts[0],) * 2)

    def with_encounter(team: walks.TeamWalks, told: Any, how: tracking.How | None, seed: int) -> list[list[Estimate]]:
        if how is None:
            alone.append(tracking.track_team(team, told, None, seed))
            return alone[-1]
        encounter = walks.Encounter(meeting_time_s(*alone[0]), (0, 1), 0.0)
        return tracking.track_team(replace(team, encounters=(encounter,)), told, how, seed)

    monkeypatch.setattr(study, "team_walks", on_one_way)
    monkeypatch.setattr(study, "track_team", with_encounter)
    short = replace(study.team_study("office/tap", 12.0), parquet=None)
    run_study(short, StudyRequest(1, 6, tmp_path / "rows.json", tmp_path))
    (row,) = json.loads((tmp_path / "rows.json").read_text())["rows"]
    assert set(study.COLUMNS) <= set(row)
    assert row["first_alone_m"] > 2.0  # its start is wrong, and the walk is short
    assert row["first_together_m"] < row["first_alone_m"]
    assert row["worst"] == pytest.approx(1.0, abs=0.05)


def meeting_time_s(first: list[Estimate], second: list[Estimate]) -> float:
    """From when on the first wearer says lost and the second one tracking, for as long as a tap may take."""
    fits = [
        (a.t_s, (a.status, b.status) == (TrackStatus.LOST, TrackStatus.TRACKING))
        for a, b in zip(first, second, strict=True)
    ]
    return next(t_s for t_s, _ in fits if all(fit for at_s, fit in fits if t_s <= at_s <= t_s + 2.0 * tracking.TAP_S))


@pytest.mark.parametrize("manner", {m.name: m for m in MANNERS}.values(), ids=lambda m: m.name)
def test_the_body_faces_where_the_manner_says(manner: Manner) -> None:
    """Backward: against the way; sidestep: across it; the speed is that of the strides."""
    found = walk([(0.0, 0.0), (12.0, 0.0)], Person(manners=(manner,)), np.random.default_rng(1))
    velocity = np.gradient(found.trunk_m, axis=0) * 1000.0
    speed = np.hypot(*velocity.T)
    fast = speed > 0.6 * manner.stride_m / manner.stride_s
    off = np.arctan2(velocity[fast, 1], velocity[fast, 0]) - found.heading_rad[fast] + manner.facing_rad
    assert abs(np.median((off + math.pi) % (2.0 * math.pi) - math.pi)) < 0.03
    assert np.median(speed[fast]) == pytest.approx(manner.stride_m / manner.stride_s, rel=0.12)


def test_without_manners_people_walk_as_before() -> None:
    way = [(0.0, 0.0), (8.0, 0.0), (8.0, 5.0)]
    plain, named = (
        walk(way, Person(manners=manners), np.random.default_rng(4)) for manners in ((), (Manner("walk", 1.3, 1.1),))
    )
    assert np.array_equal(plain.foot_m, named.foot_m)
    assert np.array_equal(plain.heading_rad, named.heading_rad)


def test_stairs_are_walked() -> None:
    found = walk([(5.0, 1.5), *stairs_from(0, up=True)], Person(manners=MANNERS[1:2]), np.random.default_rng(1))
    assert [name for _, name in found.manners] == ["walk"]
    assert found.height_m[-1] == STOREY_M


def test_the_battery_is_changed_at_a_stop() -> None:
    way, stop = waypoints(tower(3), 3, 30.0)
    assert way[stop][2:3] > (CHANGE_S,)
    assert 0 < stop < len(way) - 1
    assert all(len(w) == 4 for w in way)


@pytest.mark.long
def test_a_short_operation(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Both trackers give estimates, none during the change; the rows are complete and the parts add up."""
    walked = operation(5, 12.0)
    monkeypatch.setattr(operation_study, "operation", lambda *_: walked)
    assert walked.before[-1].t_s < walked.restart_s - CHANGE_S + 1.0
    assert walked.after[0].t_s > walked.restart_s - 1.0
    run_study(operation_study.operation_study(12.0), StudyRequest(1, 5, tmp_path / "rows.json", tmp_path))
    rows = {row["name"]: row for row in json.loads((tmp_path / "rows.json").read_text())["rows"]}
    whole = rows["all"]
    assert set(operation_study.COLUMNS) <= set(whole)
    assert whole["points"] == rows["known start"]["points"] + rows["unknown start"]["points"]
    manners = [rows[m]["points"] for m in {m.name for m in MANNERS} if m in rows]
    assert rows["known start"]["points"] == sum(manners)
    assert rows["known start"]["ce95_m"] < 0.5
    assert rows["known start"]["floor_tied"] == 1.0
    assert rows["all, resumed"]["points"] == rows["known start"]["points"] + rows["resumed"]["points"]
    assert rows["resumed"]["floor_tied"] == 1.0
    assert rows["resumed"]["ce95_m"] < rows["unknown start"]["ce95_m"]
