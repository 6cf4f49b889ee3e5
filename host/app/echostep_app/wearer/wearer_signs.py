# SPDX-License-Identifier: MIT
"""Signs of the wearer, the input of the alarm: motion or none, steps, falls.

In: samples of foot, legs and belt and segments of the path, each with the index of the message that brought it. Out: `Sign`s in order of those
messages, so that a replay has the same ones in portions of any size. Owns the windows, the tenths and the detection of falls.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from operator import itemgetter
from typing import NamedTuple

from echostep.arrays import Floats, Ints
from echostep.legs.trunk_path import GyroBlock
from echostep.odometry import WearerWatch
from echostep.path import PathSegment
from echostep_app.wearer.falls import Fall, Falls
from echostep_app.wearer.stillness import Stillness, Window
from echostep_app.wearer.tenths import Tenth, Tenths

FOOT, BELT = "foot", "belt"
MOST_SIGNS = 100_000  # that wait to be read, half a day; beyond it the oldest are dropped


class StepTaken(NamedTuple):
    """The wearer made a step that ended at `t_s`."""

    t_s: float


class _Stride(NamedTuple):
    t0_s: float
    t1_s: float
    length_m: float


Sign = Window | StepTaken | Fall
_Found = Window | StepTaken | _Stride | tuple[str, Tenth]


class WearerSigns(WearerWatch):
    """Call the `add_` methods with the contents of a portion, then `settle`; `pop` when convenient."""

    def __init__(self) -> None:
        self.falls = Falls()
        self._stillness = Stillness()
        self._foot, self._belt = Tenths(), Tenths()
        self._step: int | None = None  # of the last segment
        self._found: list[tuple[int, _Found]] = []  # in this portion, with the index of the message
        self._signs: deque[Sign] = deque(maxlen=MOST_SIGNS)

    def add_foot(self, t_s: Floats, gyro: Floats, accel: Floats, message_index: Ints) -> None:
        """Samples of the foot: t_s (n,), gyro (n, 3) rad/s, accel (n, 3) m/s2, message_index (n,)."""
        self._found += [(int(message_index[k]), window) for k, window in self._stillness.add_foot(t_s, gyro, accel)]
        tenths = self._foot.cut(t_s, accel, gyro)
        self._found += [(int(message_index[k]), (FOOT, tenth)) for k, tenth in tenths]

    def add_belt(self, t_s: Floats, gyro: Floats, accel: Floats, thigh_accel: Floats, message_index: Ints) -> None:
        """Samples of the belt, as for the foot, with the thigh's specific force (n, 3) at the same instants."""
        tenths = self._belt.cut(t_s, accel, gyro, thigh_accel)
        self._found += [(int(message_index[k]), (BELT, tenth)) for k, tenth in tenths]

    def add_legs(self, message_index: int, block: GyroBlock) -> None:
        """A block of the leg gyros."""
        self._found += [(message_index, window) for window in self._stillness.add_legs(block)]

    def add_segments(self, message_index: int, segments: Sequence[PathSegment]) -> None:
        """Segments of the path."""
        for segment in segments:
            if self._step is not None and segment.step != self._step:
                length_m = math.hypot(segment.dx_m, segment.dy_m)
                self._found.append((message_index, _Stride(segment.t0_s, segment.t1_s, length_m)))
                self._found.append((message_index, StepTaken(segment.t1_s)))
            self._step = segment.step

    def pop(self) -> list[Sign]:
        """The signs since the last call."""
        signs = list(self._signs)
        self._signs.clear()
        return signs

    def settle(self) -> None:
        """Put the portion's signs in order of its messages."""
        found, self._found = self._found, []
        for _, sign in sorted(found, key=itemgetter(0)):
            fall = None
            if isinstance(sign, Window | StepTaken):
                self._signs.append(sign)
            elif isinstance(sign, _Stride):
                self.falls.add_stride(*sign)
            else:
                place, tenth = sign
                fall = self.falls.add_foot(tenth) if place == FOOT else self.falls.add_belt(tenth)
            if fall is not None:
                self._signs.append(fall)
