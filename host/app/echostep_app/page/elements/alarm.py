# SPDX-License-Identifier: MIT
"""The wearer's alarm as a page shows and speaks it.

In: the watch over the wearer, and its time. Out: `ShownAlarm`: plain data. Owns nothing.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from echostep.odometry import AlarmKind, AlarmReason, WearerWatch
from echostep_app.wearer.steady_status import span_words

REPEAT_S = 5.0  # between two times that a sentence is spoken; assumed


@dataclass(frozen=True, slots=True)
class ShownAlarm:
    """The `text` shown, and the sentence `spoken`, again whenever `times` changes. The names are keys of the frame's JSON."""

    kind: str
    text: str
    spoken: str
    times: int


def shown_alarm(
    watch: WearerWatch,
    now_s: float,
    *,
    receipt_of: Callable[[int], str] | None = None,
    answer_to: Callable[[int], str] | None = None,
) -> ShownAlarm | None:
    """The present alarm; None while all is well. `receipt_of`: how far a mayday has come; None if the run's reports go nowhere.

    `answer_to`: what the commanders' side says of the alarm with a given number, empty without an answer: that is farther than any delivery.
    """
    alarm = watch.alarm
    if alarm is None:
        return None
    age_s = now_s - alarm.since_s
    age_s = 0.0 if math.isnan(age_s) else max(age_s, 0.0)
    times = 1000 * alarm.number + int(age_s / REPEAT_S)
    receipt = receipt_of(alarm.number) if receipt_of else "No team is connected: only this page says so."
    receipt = (answer_to(alarm.number) if answer_to else "") or receipt
    left_s = max(math.ceil((alarm.mayday_s or alarm.since_s) - alarm.since_s - age_s), 0)
    match alarm.kind, alarm.reason:
        case AlarmKind.ASKING, reason:
            asks = (
                "A fall: are you all right? Walk, or tap."
                if reason is AlarmReason.FALL
                else "Are you all right? Move, or tap."
            )
            return ShownAlarm(alarm.kind.value, f"{asks} In {left_s} s it is a mayday.", asks, times)
        case AlarmKind.MAYDAY, AlarmReason.HELP:
            return ShownAlarm(alarm.kind.value, f"Mayday: you asked for help. {receipt}", f"Mayday. {receipt}", times)
        case AlarmKind.MAYDAY, reason:
            ago = span_words(age_s)
            why = f"a fall {ago} ago" if reason is AlarmReason.FALL else f"no motion for {ago}"
            text = f"Mayday: {why}. {receipt}"
            return ShownAlarm(alarm.kind.value, text, f"Mayday. {receipt} Walk, or tap, if you are all right.", times)
    return ShownAlarm(alarm.kind.value, "The mayday is over.", "The mayday is over.", 1000 * alarm.number)
