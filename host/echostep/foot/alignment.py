"""The walk frame with its x to the toe, in any mounting: the one place where the sensor's place on the foot is turned into the project's frames.

In: a foot's events, each step with what is known of the toe. Out: the same events in a walk frame whose yaw zero is the toe's direction when the foot
was levelled. Owns the first steps until the toe is known, and then its angle.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from echostep.foot.steps import Stance, Step, Track

SURE_RAD = math.radians(20.0)  # the toe is found to within this; who has put x to the toe knows better
PATIENCE_STEPS, PATIENCE_S = 3, 4.0


class Alignment:
    """Live: holds the events of the first steps, two as a rule, until the toe is known.

    A foot that does not tip by PATIENCE_STEPS or PATIENCE_S is taken to have x to the toe for the time being; steps do not wait any longer.
    """

    def __init__(self) -> None:
        self.toe_rad: float | None = None
        self._held: list[Step | Stance] = []
        self._impatient = False

    @property
    def waiting(self) -> bool:
        """Whether events are held back."""
        return bool(self._held)

    def feed(self, events: Iterable[Step | Stance], now_s: float) -> list[Step | Stance]:
        """Events up to `now_s` with the toe on x; none before it is known."""
        self._held += events
        steps = [event for event in self._held if isinstance(event, Step)]
        if self.toe_rad is None:
            self.toe_rad = _known(steps)
        if self.toe_rad is None and not self._impatient:
            since_s = self._held[0].t_end_s if self._held else now_s
            self._impatient = len(steps) >= PATIENCE_STEPS or now_s - since_s > PATIENCE_S
            if not self._impatient:
                return []
        told, self._held = self._held, []
        return [turned(event, self.toe_rad or 0.0) for event in told]


def _known(steps: list[Step]) -> float | None:
    """The toe as the last of these steps knows it; who has put x to the toe is believed."""
    toes = [step.toe_rad for step in steps if step.toe_rad is not None]
    if not toes:
        return None
    return toes[-1] if abs(toes[-1]) > SURE_RAD else 0.0


def turned(event: Step | Stance, toe_rad: float) -> Step | Stance:
    """The event in the walk frame whose x was at `toe_rad`; yaw counts from there, so it stays."""
    if isinstance(event, Stance) or toe_rad == 0.0:
        return event
    r = _about_z(-toe_rad)
    x, y, z = (r @ event.move_m).tolist()
    toe = None if event.toe_rad is None else math.remainder(event.toe_rad - toe_rad, 2.0 * math.pi)
    return replace(event, move_m=(x, y, z), covariance=r @ event.covariance @ r.T, toe_rad=toe)


def aligned(track: Track) -> Track:
    """A whole walk with the toe on x, as its last steps know it."""
    toes = [step.toe_rad for step in track.steps if step.toe_rad is not None]
    if not toes:
        return track
    position = track.position_m @ _about_z(-toes[-1]).T
    return replace(
        track, position_m=position, events=[turned(event, toes[-1]) for event in track.events], toe_known=True
    )


def _about_z(angle_rad: float) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
