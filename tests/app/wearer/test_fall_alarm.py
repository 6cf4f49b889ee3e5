# SPDX-License-Identifier: MIT
"""The alarm after a fall: it asks at once and calls 10 s later; from the bytes of the sensors too, and the same in a replay."""

from __future__ import annotations

import numpy as np
import pytest

from board_runs import ROOT
from echostep.odometry import Alarm, AlarmKind, AlarmReason
from echostep.plan import Pose, load_plan
from echostep.ports.chunks import Chunk, portion_of
from echostep.ports.people.check_in import PERSON, Call
from echostep.tracker import Tracker
from echostep_app.wearer.alarm import ANSWER_S, WearerAlarm, watch_of
from echostep_app.wearer.falls import Fall
from echostep_app.wearer.stillness import Window
from echostep_app.wearer.wearer_signs import StepTaken
from echostep_studies.simulation.body_motion import MTX
from echostep_studies.simulation.falling import sideways, walk_then
from wearer.fall_bytes import fall_chunks

PLAN = load_plan(ROOT / "host/core/echostep/plans/demo.json")
ASKING, MAYDAY, OVER = AlarmKind.ASKING, AlarmKind.MAYDAY, AlarmKind.OVER
FALL = AlarmReason.FALL


def windows(begin_s: float, end_s: float, *, moved: bool) -> list[Window]:
    return [Window(float(t_s), moved) for t_s in np.arange(begin_s + 0.5, end_s + 0.25, 0.5)]


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
        alarm = watch_of(tracker).wearer_alarm
        for k in range(0, len(chunks), size):
            tracker.take(portion_of(chunks[k : k + size]))
        changes.append(list(alarm.changes))
    assert changes[0] == changes[1]
    told = [(change.kind, change.reason) for _, change in changes[0] if change]
    assert told[:3] == [(ASKING, FALL), (MAYDAY, FALL), (OVER, FALL)]
    asked_s, mayday_s = (t_s for t_s, _ in changes[0][:2])
    assert samples.event_s + 3.0 < asked_s < samples.event_s + 7.0
    assert ANSWER_S <= mayday_s - asked_s <= ANSWER_S + 0.5
