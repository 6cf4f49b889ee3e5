# SPDX-License-Identifier: MIT
"""Effect of the newest meeting with a teammate, in words for pages.

In: the tracker's state. Out: `ShownMeeting`. Owns the words.
"""

from __future__ import annotations

from dataclasses import dataclass

from echostep.localization.team.meeting_memory import MeetingEffect
from echostep.tracker.state import TrackerState

WORDS = {
    MeetingEffect.USED: "{} and you agree about the place.",
    MeetingEffect.MOVED: "Your position is now beside {}.",
    MeetingEffect.CONTRADICTS: "{} is elsewhere by their tracker. Your position was kept: if it is wrong, tap where you are or meet another one.",
    MeetingEffect.EMPTY: "The tracker of {} does not know the place: nothing was changed.",
    MeetingEffect.REPEATED: "You met {} just now: nothing was changed. It counts again after 10 m.",
}


@dataclass(frozen=True, slots=True)
class ShownMeeting:
    """Meeting `number` in words. The names are keys of the frame's JSON."""

    number: int
    text: str


def shown_meeting(state: TrackerState) -> ShownMeeting | None:
    """The newest meeting; None before the first."""
    news = state.met
    return None if news is None else ShownMeeting(news.number, WORDS[news.effect].format(news.name))
