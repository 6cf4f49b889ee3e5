# SPDX-License-Identifier: MIT
"""The walk frame turned so that its x axis points to the toe, whatever the mounting of the sensor.

In: `Step` and `Stance` in the walk frame of `foot.steps`; each step carries the toe's direction as estimated so far (`toe_rad`).
Out: the same events in a walk frame whose yaw zero is the direction of the toe when the foot was levelled.
Owns the events that wait until the toe's direction is known, and then that direction.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from echostep.elementary import product
from echostep.foot.steps import Stance, Step, Track

SURE_DEG = 20.0  # error bound of the estimate, assumed; below it the wearer's x-to-toe mounting is trusted
SURE_RAD = math.radians(SURE_DEG)
# The estimate needs two steps as a rule; output must not wait much longer.
PATIENCE_STEPS = 3
PATIENCE_S = 4.0


class Alignment:
    """Live alignment: the events of the first steps, two as a rule, wait until the toe's direction is known.

    If it is still unknown after PATIENCE_STEPS or PATIENCE_S, x is assumed to point to the toe until an estimate exists, and no event waits.
    """

    def __init__(self) -> None:
        self.toe_rad: float | None = None
        self._held: list[Step | Stance] = []
        self._timed_out = False

    @property
    def waiting(self) -> bool:
        """Whether events are held back."""
        return bool(self._held)

    def feed(self, events: Iterable[Step | Stance], now_s: float) -> list[Step | Stance]:
        """Aligned events that are ready at `now_s`; empty while the toe's direction is awaited."""
        self._held += events
        steps = [event for event in self._held if isinstance(event, Step)]
        if self.toe_rad is None:
            self.toe_rad = _known(steps)
        if self.toe_rad is None and not self._timed_out:
            since_s = self._held[0].t_end_s if self._held else now_s
            self._timed_out = len(steps) >= PATIENCE_STEPS or now_s - since_s > PATIENCE_S
            if not self._timed_out:
                return []
        ready, self._held = self._held, []
        return [rotated_event(event, self.toe_rad or 0.0) for event in ready]


def _known(steps: list[Step]) -> float | None:
    """Toe direction (rad) from the newest step that has one; 0 if it is within SURE_RAD of x; None if no step has one."""
    toes = [step.toe_rad for step in steps if step.toe_rad is not None]
    if not toes:
        return None
    return toes[-1] if abs(toes[-1]) > SURE_RAD else 0.0


def rotated_event(event: Step | Stance, toe_rad: float) -> Step | Stance:
    """The event in the walk frame turned about z by `toe_rad`; headings count from the toe's direction, so they keep their values."""
    if isinstance(event, Stance) or toe_rad == 0.0:
        return event
    r = _about_z(-toe_rad)
    x, y, z = product(r, np.array(event.move_m)).tolist()
    toe = None if event.toe_rad is None else math.remainder(event.toe_rad - toe_rad, 2.0 * math.pi)
    return replace(event, move_m=(x, y, z), covariance=product(product(r, event.covariance), r.T), toe_rad=toe)


def aligned(track: Track) -> Track:
    """The whole track with x to the toe, from the last step that has an estimate of the toe's direction."""
    toes = [step.toe_rad for step in track.steps if step.toe_rad is not None]
    if not toes:
        return track
    position = product(track.position_m, _about_z(-toes[-1]).T)
    return replace(
        track, position_m=position, events=[rotated_event(event, toes[-1]) for event in track.events], toe_known=True
    )


def _about_z(angle_rad: float) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """Rotation matrix about z."""
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
