# SPDX-License-Identifier: MIT
"""The wearer's alarm: a question after 20 s without motion, a mayday after 30 s; a question after a fall, a mayday 10 s later; a call for help.

In: signs of the wearer (windows with or without motion, steps, falls), taps. Out: the present `Alarm`, and every change of it. Owns the time of the
last motion. All times are the samples' times.

The times follow NFPA 1982 (PASS), quoted from memory: alarm after 30 s without motion (+5/-0 s), a warning about 10 s before; to be compared with a
copy of the standard before use. Differences: a mayday for lack of motion also ends when the wearer walks, there only by hand; a fall leads to a
question and a mayday sooner, and motion alone, which ends a question for lack of motion, does not end this one. There is no sound of 95 dB, no
housing and no test by the standard: this is not a PASS.
`AlarmWatch` is the tracker's watch over its wearer: the signs, and the alarm that follows from them.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

from echostep.odometry import Alarm, AlarmKind, AlarmReason
from echostep.tracker import Tracker
from echostep_app.wearer.falls import Fall
from echostep_app.wearer.stillness import WINDOW_S, Window
from echostep_app.wearer.wearer_signs import Sign, StepTaken, WearerSigns

ASK_S, MAYDAY_S = 20.0, 30.0  # without motion
ANSWER_S = 10.0  # to answer after a fall: as long as between question and mayday for lack of motion
WALKED_STEPS = 3  # of the foot: the wearer walks; a helper who turns a wearer over makes fewer
OVER_S = 30.0  # an alarm that has ended is reported as over for this long
SWAY_S = 120.0  # after the last movement, for which sway alone suppresses the question: a foot at rest is moved more often than that
GAP_S = 2.0  # a longer time without samples does not count as time without motion
MARGIN_S = WINDOW_S  # how late windows of the other sensor may come
MOST_CHANGES = 1000  # that are kept


class WearerAlarm:
    """`add` takes signs in order; `alarm` is the present one, None while all is well."""

    def __init__(self) -> None:
        self.alarm: Alarm | None = None
        self.changes: deque[tuple[float, Alarm | None]] = deque(maxlen=MOST_CHANGES)  # with their times
        self._number = 0
        self._seen_s = math.nan  # end of the newest window
        self._motion_s = math.nan  # end of the last one with motion; later after a tap
        self._moved_s = math.nan  # the same, without sway
        self._steps: deque[float] = deque(maxlen=WALKED_STEPS)  # times of the last ones
        self._begun_s = math.nan  # when the last question or mayday began

    def add(self, signs: Sequence[Sign]) -> None:
        """Take signs in order; there is no alarm before the first steps: a device that lies ready is not worn yet."""
        for sign in signs:
            if isinstance(sign, StepTaken):
                self._steps.append(sign.t_s)
                self._end_by_walking()
            elif len(self._steps) < WALKED_STEPS:
                continue
            elif isinstance(sign, Fall):
                self._ask_about(sign)
            else:
                self._pass(sign)

    def _ask_about(self, fall: Fall) -> None:
        """Begin a question, unless a question or a mayday is active."""
        if self.alarm is None or self.alarm.kind is AlarmKind.OVER:
            self._begin(AlarmKind.ASKING, AlarmReason.FALL, fall.t_s, fall.known_s)

    def _pass(self, window: Window) -> None:
        if math.isnan(self._seen_s):
            self._seen_s = self._motion_s = self._moved_s = window.end_s
        gap_s = window.end_s - self._seen_s
        if window.moved:
            self._motion_s = self._moved_s = max(window.end_s, self._motion_s)
        elif window.sways and window.end_s - self._moved_s <= SWAY_S:
            self._motion_s = max(window.end_s, self._motion_s)
        elif gap_s > GAP_S:
            self._motion_s += gap_s
        self._seen_s = max(window.end_s, self._seen_s)
        self._advance(self._seen_s - MARGIN_S)

    def call_for_help(self, t_s: float) -> None:
        """Raise a mayday: the wearer calls for help."""
        if self.alarm is None or self.alarm.kind is not AlarmKind.MAYDAY or self.alarm.reason is not AlarmReason.HELP:
            self._begin(AlarmKind.MAYDAY, AlarmReason.HELP, self._time(t_s), self._time(t_s))

    def answer(self, t_s: float, *, ends_help: bool) -> None:
        """The wearer has tapped. `ends_help`: the tap means that all is well; any other one means only that the wearer is conscious."""
        self._motion_s = self._moved_s = self._time(t_s)
        if self.alarm and (ends_help or self.alarm.reason is not AlarmReason.HELP):
            self._end(self._time(t_s))

    def _time(self, t_s: float) -> float:
        """A time, also before the first samples."""
        return 0.0 if math.isnan(t_s) else t_s

    def _advance(self, t_s: float) -> None:
        """Changes that are due by a time."""
        alarm, still_s = self.alarm, t_s - self._motion_s
        if alarm and alarm.kind is AlarmKind.OVER and t_s >= alarm.since_s + OVER_S:
            self._change(t_s, None)
        if alarm and alarm.kind is AlarmKind.MAYDAY:
            return
        if alarm and alarm.kind is AlarmKind.ASKING and alarm.reason is AlarmReason.FALL:
            if alarm.mayday_s is not None and t_s >= alarm.mayday_s:
                self._begin(AlarmKind.MAYDAY, AlarmReason.FALL, alarm.since_s, t_s)
            return
        if still_s >= MAYDAY_S:
            self._begin(AlarmKind.MAYDAY, AlarmReason.STILL, self._motion_s, t_s)
        elif still_s >= ASK_S and (alarm is None or alarm.kind is not AlarmKind.ASKING):
            self._begin(AlarmKind.ASKING, AlarmReason.STILL, self._motion_s, t_s)
        elif still_s < ASK_S and alarm and alarm.kind is AlarmKind.ASKING:
            self._change(t_s, None)  # the team was not alarmed

    def _end_by_walking(self) -> None:
        """A mayday without a call for help ends when the wearer walks, and so does the question about a fall."""
        alarm = self.alarm
        asks = alarm is not None and alarm.kind is AlarmKind.ASKING and alarm.reason is AlarmReason.FALL
        calls = alarm is not None and alarm.kind is AlarmKind.MAYDAY and alarm.reason is not AlarmReason.HELP
        if (asks or calls) and len(self._steps) == WALKED_STEPS and self._steps[0] > self._begun_s:
            self._motion_s = self._moved_s = max(self._seen_s, self._motion_s)
            self._end(self._seen_s)

    def _begin(self, kind: AlarmKind, reason: AlarmReason, since_s: float, t_s: float) -> None:
        if kind is AlarmKind.ASKING or self.alarm is None or self.alarm.kind is not AlarmKind.ASKING:
            self._number += 1
        self._begun_s = t_s
        mayday_s = t_s + ANSWER_S if reason is AlarmReason.FALL else since_s + MAYDAY_S
        self._change(t_s, Alarm(kind, reason, self._number, since_s, mayday_s if kind is AlarmKind.ASKING else None))

    def _end(self, t_s: float) -> None:
        alarm = self.alarm
        if alarm and alarm.kind is AlarmKind.MAYDAY:
            self._change(t_s, Alarm(AlarmKind.OVER, alarm.reason, alarm.number, t_s))
        elif alarm and alarm.kind is AlarmKind.ASKING:
            self._change(t_s, None)

    def _change(self, t_s: float, alarm: Alarm | None) -> None:
        self.alarm = alarm
        self.changes.append((t_s, alarm))


def watch_of(tracker: Tracker) -> AlarmWatch:
    """The watch over this tracker's wearer, which begins when it is first asked for."""
    if not isinstance(tracker.watch, AlarmWatch):
        tracker.watch = AlarmWatch()
    assert isinstance(tracker.watch, AlarmWatch)
    return tracker.watch


class AlarmWatch(WearerAlarm, WearerSigns):
    """The signs of a tracker's wearer, handed to the alarm message by message."""

    def __init__(self) -> None:
        WearerAlarm.__init__(self)
        WearerSigns.__init__(self)

    def trunk_tilt_rad(self, t_s: float) -> float:
        """The trunk's tilt at a time; NaN if the belt does not give it."""
        return self.falls.trunk_tilt_rad(t_s)

    def advance(self) -> None:
        """Hand the signs to the alarm."""
        self.add(self.pop())
