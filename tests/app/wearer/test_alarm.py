# SPDX-License-Identifier: MIT
"""The wearer's alarm: when it asks, when it calls, what ends it, after a fall too; the same from the bytes of sensors and in a replay."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echostep.odometry import Alarm, AlarmKind, AlarmReason
from echostep.plan import Pose
from echostep.ports.chunks import Chunk, portion_of
from echostep.ports.people.check_in import PERSON, Call, CheckIn
from echostep.tracker import Tracker
from echostep_app.wearer.alarm import ANSWER_S, ASK_S, MAYDAY_S, OVER_S, WearerAlarm, watch_of
from echostep_app.wearer.falls import Fall
from echostep_app.wearer.stillness import Window
from echostep_app.wearer.wearer_signs import StepTaken
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.scenario import Scenario
from echostep_studies.simulation.body_motion import MTX
from echostep_studies.simulation.falling import sideways, walk_then
from walks import PLAN
from wearer.fall_bytes import fall_chunks

END_STILL_S = 60.0


def walked(until_s: float = 10.0) -> WearerAlarm:
    """A wearer who has walked until then."""
    alarm = WearerAlarm()
    for k in range(5):
        alarm.add([StepTaken(1.0 + k)])
    alarm.add(windows(0.0, until_s, moved=True))
    return alarm


def windows(begin_s: float, end_s: float, *, moved: bool) -> list[Window]:
    return [Window(float(t_s), moved) for t_s in np.arange(begin_s + 0.5, end_s + 0.25, 0.5)]


def state(alarm: WearerAlarm) -> tuple[AlarmKind, AlarmReason] | None:
    return (alarm.alarm.kind, alarm.alarm.reason) if alarm.alarm else None


ASKING, MAYDAY, OVER = AlarmKind.ASKING, AlarmKind.MAYDAY, AlarmKind.OVER
STILL, HELP = AlarmReason.STILL, AlarmReason.HELP


def test_it_asks_after_20_s_and_calls_after_30_s_and_not_before() -> None:
    alarm = walked(10.0)
    alarm.add(windows(10.0, 30.0, moved=False))
    assert state(alarm) is None
    alarm.add(windows(30.0, 30.5, moved=False))
    assert state(alarm) == (ASKING, STILL)
    alarm.add(windows(30.5, 40.0, moved=False))
    assert state(alarm) == (ASKING, STILL)
    alarm.add(windows(40.0, 40.5, moved=False))
    assert alarm.alarm == Alarm(MAYDAY, STILL, 1, 10.0)
    assert [round(t_s - 10.0, 3) for t_s, _ in alarm.changes] == [ASK_S, MAYDAY_S]


def test_any_motion_ends_the_question_and_the_team_hears_of_no_mayday() -> None:
    alarm = walked(10.0)
    alarm.add(windows(10.0, 35.0, moved=False))
    alarm.add(windows(35.0, 36.0, moved=True))
    assert state(alarm) is None
    alarm.add(windows(36.0, 55.0, moved=False))
    assert state(alarm) is None
    assert all(change is None or change.kind is ASKING for _, change in alarm.changes)


def test_a_mayday_ends_by_three_steps_or_by_a_tap_but_not_by_a_movement() -> None:
    alarm = walked(10.0)
    alarm.add(windows(10.0, END_STILL_S, moved=False))
    alarm.add(windows(END_STILL_S, 65.0, moved=True))  # turned over by a helper
    for t_s in (61.0, 62.0):
        alarm.add([StepTaken(t_s)])
    alarm.add(windows(65.0, 66.0, moved=True))
    assert state(alarm) == (MAYDAY, STILL)
    alarm.add([StepTaken(66.5)])
    assert alarm.alarm == Alarm(OVER, STILL, 1, 66.0)
    alarm.add(windows(66.0, 66.0 + OVER_S + 1.0, moved=True))
    assert state(alarm) is None

    alarm = walked(10.0)
    alarm.add(windows(10.0, END_STILL_S, moved=False))
    alarm.answer(61.0, ends_help=True)
    assert state(alarm) == (OVER, STILL)
    alarm.add(windows(END_STILL_S, 80.0, moved=False))
    assert state(alarm) == (OVER, STILL)  # the tap was a sign of life: 20 s begin anew
    alarm.add(windows(80.0, 85.0, moved=False))
    assert state(alarm) == (ASKING, STILL)
    assert alarm.alarm
    assert alarm.alarm.number == 2


@pytest.mark.parametrize("t_s", [math.nan, 5.0])
def test_help_can_be_asked_for_at_any_time_and_walking_does_not_end_it(t_s: float) -> None:
    alarm = WearerAlarm() if math.isnan(t_s) else walked(5.0)
    alarm.call_for_help(t_s)
    assert state(alarm) == (MAYDAY, HELP)
    for k in range(10):
        alarm.add([StepTaken(6.0 + k)])
    alarm.add(windows(5.0, 16.0, moved=True))
    alarm.answer(16.0, ends_help=False)  # a check-in on the map
    assert state(alarm) == (MAYDAY, HELP)
    alarm.answer(16.0, ends_help=True)
    assert state(alarm) == (OVER, HELP)


def test_help_during_a_mayday_makes_it_one_that_was_asked_for() -> None:
    alarm = walked(10.0)
    alarm.add(windows(10.0, END_STILL_S, moved=False))
    alarm.call_for_help(61.0)
    assert state(alarm) == (MAYDAY, HELP)


def test_a_device_that_lies_ready_does_not_alarm() -> None:
    alarm = WearerAlarm()
    alarm.add(windows(0.0, 1.0, moved=True))
    alarm.add(windows(1.0, 300.0, moved=False))
    assert state(alarm) is None


def test_time_without_samples_is_no_time_without_motion() -> None:
    alarm = walked(10.0)
    alarm.add(windows(10.0, 25.0, moved=False))
    alarm.add(windows(100.0, 104.0, moved=False))  # 15 s and 4 s
    assert state(alarm) is None
    alarm.add(windows(104.0, 106.0, moved=False))
    assert state(alarm) == (ASKING, STILL)


def still_walk() -> tuple[Scenario, list[Chunk]]:
    """A walk with 45 s in which nothing moves."""
    way = ((2.0, 7.5), (6.5, 7.5, 45.0), (12.5, 7.5))
    scenario = Scenario(PLAN, way, 5, PythonBoard(seed=5))
    return scenario, list(scenario.chunks())


@pytest.mark.long
def test_from_the_bytes_of_the_sensors_to_the_mayday_within_35_s() -> None:
    scenario, chunks = still_walk()
    moving = np.flatnonzero(np.abs(np.diff(scenario.walk.foot_m, axis=0)).sum(axis=1) > 1e-9)
    pause = int(np.argmax(np.diff(moving)))
    begin_s, end_s = (scenario.walk.t_s[moving[pause + k]] for k in (0, 1))
    tracker, told_s = Tracker(PLAN, scenario.start, seed=1), math.nan
    alarm = watch_of(tracker)
    for k in range(0, len(chunks), 20):
        tracker.take(portion_of(chunks[k : k + 20]))
        if math.isnan(told_s) and alarm.alarm and alarm.alarm.kind is MAYDAY:
            told_s = tracker.front_end.newest_s
    kinds = [change.kind if change else None for _, change in alarm.changes]
    assert kinds == [ASKING, MAYDAY, OVER]  # over: walked on
    assert MAYDAY_S <= told_s - begin_s <= 32.0
    assert end_s < alarm.changes[-1][0] < end_s + 6.0


@pytest.mark.long
def test_taps_are_chunks_and_a_replay_has_the_same_alarms() -> None:
    scenario, chunks = still_walk()
    third = len(chunks) // 3
    at_ns = chunks[third].t_arrival_ns
    taps: list[Call | CheckIn] = [Call(help=True), CheckIn(5.0, 7.5, None, 0.5), Call(help=False)]
    for k, tap in enumerate(taps):
        chunks.insert(third + 500 * k, Chunk(PERSON, at_ns, tap.encode()))
    live, replayed = (Tracker(PLAN, scenario.start, seed=1) for _ in range(2))
    alarm, again = watch_of(live), watch_of(replayed)
    for k in range(0, len(chunks), 50):
        live.take(portion_of(chunks[k : k + 50]))
    for k in range(0, len(chunks), 5000):
        replayed.take(portion_of(chunks[k : k + 5000]))
    begun = [(change.kind, change.reason) for _, change in alarm.changes if change and change.kind is not OVER]
    assert begun[0] == (MAYDAY, HELP)
    assert live.state.bad_check_ins == 0
    assert [change for _, change in alarm.changes if change and change.kind is MAYDAY] == [
        change for _, change in again.changes if change and change.kind is MAYDAY
    ]


FALL = AlarmReason.FALL


def fallen() -> WearerAlarm:
    """A wearer who walked, fell at 10 s and lies; known at 14 s."""
    alarm = WearerAlarm()
    alarm.add([StepTaken(1.0 + k) for k in range(5)])
    alarm.add([*windows(0.0, 10.0, moved=True), *windows(10.0, 14.0, moved=False), Fall(10.2, 14.0)])
    return alarm


def test_it_asks_at_once_and_calls_10_s_later_though_the_wearer_moves() -> None:
    alarm = fallen()
    assert alarm.alarm == Alarm(ASKING, FALL, 1, 10.2, 14.0 + ANSWER_S)
    alarm.add(windows(14.0, 24.0, moved=True))
    assert alarm.alarm
    assert alarm.alarm.kind is ASKING
    alarm.add(windows(24.0, 24.5, moved=True))
    assert alarm.alarm == Alarm(MAYDAY, FALL, 1, 10.2)
    assert [t_s for t_s, _ in alarm.changes] == [14.0, 14.0 + ANSWER_S]


@pytest.mark.parametrize("calls", [False, True])
def test_three_steps_or_a_tap_end_the_question_and_the_mayday(calls: bool) -> None:
    for walks in (True, False):
        alarm = fallen()
        alarm.add(windows(14.0, 26.0 if calls else 16.0, moved=False))
        if walks:
            alarm.add([StepTaken(27.0), StepTaken(28.0)])
            assert alarm.alarm
            assert alarm.alarm.kind is (MAYDAY if calls else ASKING)
            alarm.add([StepTaken(29.0)])
        else:
            alarm.answer(27.0, ends_help=False)
        kind = alarm.alarm.kind if alarm.alarm else None
        assert kind is (OVER if calls else None)


def test_after_an_answer_lack_of_motion_is_asked_about_as_ever() -> None:
    alarm = fallen()
    alarm.answer(15.0, ends_help=True)
    alarm.add(windows(14.0, 36.0, moved=False))
    assert alarm.alarm == Alarm(ASKING, AlarmReason.STILL, 2, 15.0, 45.0)


def test_a_fall_before_the_first_steps_or_during_a_mayday_changes_nothing() -> None:
    alarm = WearerAlarm()
    alarm.add([Fall(1.0, 4.0)])
    assert alarm.alarm is None
    alarm = fallen()
    alarm.call_for_help(15.0)
    alarm.add([Fall(16.0, 20.0)])
    assert alarm.alarm
    assert alarm.alarm.reason is AlarmReason.HELP


@pytest.mark.slow
@pytest.mark.parametrize("belt", [True, False])
def test_from_the_bytes_of_the_sensors_and_the_same_in_portions_of_any_size(belt: bool) -> None:
    samples = walk_then(sideways, MTX, np.random.default_rng(3), walk_s=14.0)
    chunks = fall_chunks(samples, belt=belt)
    tap_ns = chunks[0].t_arrival_ns + int((samples.event_s + 18.0) * 1e9)
    at = next(k for k, chunk in enumerate(chunks) if chunk.t_arrival_ns >= tap_ns)
    chunks.insert(at, Chunk(PERSON, tap_ns, Call(help=False).encode()))
    changes = []
    for size in (37, 100_000):
        tracker = Tracker(PLAN, Pose(2.0, 7.5, 0.0), seed=1)
        alarm = watch_of(tracker)
        for k in range(0, len(chunks), size):
            tracker.take(portion_of(chunks[k : k + size]))
        changes.append(list(alarm.changes))
    assert changes[0] == changes[1]
    told = [(change.kind, change.reason) for _, change in changes[0] if change]
    assert told[:3] == [(ASKING, FALL), (MAYDAY, FALL), (OVER, FALL)]
    asked_s, mayday_s = (t_s for t_s, _ in changes[0][:2])
    assert samples.event_s + 3.0 < asked_s < samples.event_s + 7.0
    assert ANSWER_S <= mayday_s - asked_s <= ANSWER_S + 0.5
