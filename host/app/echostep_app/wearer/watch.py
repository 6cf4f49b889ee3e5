# SPDX-License-Identifier: MIT
"""The watch over a tracker's wearer: signs of motion, steps and falls, and the alarm that follows from them.

In: output of the tracker's front end. Out: `alarm`, the trunk's tilt. Owns the signs and the alarm.
"""

from __future__ import annotations

from collections.abc import Sequence

from echostep.arrays import Floats, Ints
from echostep.legs.trunk_path import GyroBlock
from echostep.odometry import Alarm, WearerWatch
from echostep.path import PathSegment
from echostep.tracker import Tracker
from echostep_app.wearer.alarm import WearerAlarm
from echostep_app.wearer.wearer_signs import WearerSigns


def watch_of(tracker: Tracker) -> AlarmWatch:
    """The watch over this tracker's wearer, which begins when it is first asked for."""
    if not isinstance(tracker.watch, AlarmWatch):
        tracker.watch = AlarmWatch()
    assert isinstance(tracker.watch, AlarmWatch)
    return tracker.watch


class AlarmWatch(WearerWatch):
    """Passes the output of the front end to the signs, and these to the alarm, message by message."""

    def __init__(self) -> None:
        self.wearer_alarm = WearerAlarm()
        self.signs = WearerSigns()

    @property
    def alarm(self) -> Alarm | None:  # type: ignore[override]  # read only
        """The present alarm."""
        return self.wearer_alarm.alarm

    def trunk_tilt_rad(self, t_s: float) -> float:
        """The trunk's tilt at a time; NaN if the belt does not give it."""
        return self.signs.falls.trunk_tilt_rad(t_s)

    def add_foot(self, t_s: Floats, gyro: Floats, accel: Floats, message_index: Ints) -> None:
        """Samples of the foot."""
        self.signs.add_foot(t_s, gyro, accel, message_index)

    def add_belt(self, t_s: Floats, gyro: Floats, accel: Floats, thigh_accel: Floats, message_index: Ints) -> None:
        """Samples of the belt, with the thigh's specific force."""
        self.signs.add_belt(t_s, gyro, accel, thigh_accel, message_index)

    def add_legs(self, message_index: int, block: GyroBlock) -> None:
        """A block of the leg gyros."""
        self.signs.add_legs(message_index, block)

    def add_segments(self, message_index: int, segments: Sequence[PathSegment]) -> None:
        """Segments of the path."""
        self.signs.add_segments(message_index, segments)

    def settle(self) -> None:
        """Put the signs in the order of their messages."""
        self.signs.settle()

    def advance(self) -> None:
        """Hand the signs to the alarm."""
        self.wearer_alarm.add(self.signs.pop())

    def call_for_help(self, t_s: float) -> None:
        """Raise a mayday."""
        self.wearer_alarm.call_for_help(t_s)

    def answer(self, t_s: float, *, ends_help: bool) -> None:
        """A tap is a sign of life."""
        self.wearer_alarm.answer(t_s, ends_help=ends_help)
