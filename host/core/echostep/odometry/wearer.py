# SPDX-License-Identifier: MIT
"""Interface of a watch over the wearer: receives samples, segments and taps as they come, and ignores them.

In: samples of foot, legs and belt and segments of the path, each with the index of the message that brought it; taps. Out: an `Alarm`, None while
all is well. Owns nothing. A watch that is handed to the tracker overrides the methods that concern it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

from echostep.arrays import Floats, Ints
from echostep.legs.trunk_path import GyroBlock
from echostep.path import PathSegment


class AlarmKind(StrEnum):
    """Kind of an alarm."""

    ASKING = "asking"
    MAYDAY = "mayday"
    OVER = "over"


class AlarmReason(StrEnum):
    """Cause of an alarm."""

    STILL = "no motion"
    FALL = "fall"
    HELP = "help"


@dataclass(frozen=True, slots=True)
class Alarm:
    """An alarm: `number` of this run; `since_s`: time of the last motion, of the fall, of the call for help, or of its end.

    `mayday_s`: time at which a question becomes a mayday.
    """

    kind: AlarmKind
    reason: AlarmReason
    number: int
    since_s: float
    mayday_s: float | None = None


class WearerWatch:
    """The front end calls the `add_` methods with the data of a portion, then `settle`; the tracker calls the others."""

    alarm: Alarm | None = None

    def add_foot(self, t_s: Floats, gyro: Floats, accel: Floats, message_index: Ints, /) -> None:
        """Samples of the foot: t_s (n,), gyro (n, 3) rad/s, accel (n, 3) m/s2, message_index (n,)."""

    def add_belt(self, t_s: Floats, gyro: Floats, accel: Floats, thigh_accel: Floats, message_index: Ints, /) -> None:
        """Samples of the belt, in the form of the foot's samples, with the thigh's specific force (n, 3) at the same instants."""

    def add_legs(self, message_index: int, block: GyroBlock, /) -> None:
        """A block of the leg gyros."""

    def add_segments(self, message_index: int, segments: Sequence[PathSegment], /) -> None:
        """Segments of the path."""

    def settle(self) -> None:
        """The portion is complete: process its samples and segments in the order of their messages."""

    def advance(self) -> None:
        """The portion's estimates are published."""

    def call_for_help(self, t_s: float, /) -> None:
        """The wearer calls for help."""

    def answer(self, t_s: float, /, *, ends_help: bool) -> None:
        """The wearer has tapped. `ends_help`: the tap means that all is well; any other one means only that the wearer is conscious."""
