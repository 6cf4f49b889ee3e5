# SPDX-License-Identifier: MIT
"""The simulated person: walks in the direction of the last cue, with dead reckoning whose heading magnetic sources disturb [Fischer 2008, 4.1.2].

In: a `BeaconGround`, turns to be made. Out: the true position and the dead-reckoned path. Owns the fields of a `GuidedWalker` record.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

import numpy as np

from echostep.arrays import Bools, record_dtype
from echostep.jit import part
from echostep_simulation.world.beacon_ground import BeaconGround, disturbance

TICK_S = 0.01  # between inertial events [Fischer 2008, 4.2]
SPEED_M_S = 1.0  # a slow walk
STEP_M = SPEED_M_S * TICK_S  # of one inertial event
WRONG_TURN_RAD = 0.5 * math.pi  # error of a wrong turn, to either side; assumed


class Obedience(NamedTuple):
    """How well the person follows a cue: delay, error of the direction taken, share of cues after which the turn is wrong by WRONG_TURN_RAD."""

    delay_s: float = 0.0
    heading_sd_deg: float = 0.0
    wrong_turns: float = 0.0


EXACT = Obedience()


class GuidedWalker(Protocol):
    """A record of floats. Headings are counter-clockwise from x (rad); places in metres."""

    x: float  # true place
    y: float
    heading: float  # true
    error: float  # measured heading - true heading
    path_x: float  # dead-reckoned place in the walk frame, since the start
    path_y: float
    moved_x: float  # dead reckoning since the last ultrasound event, in the walk frame
    moved_y: float
    turn: float  # of the last cue
    turn_tick: float  # at which it is made


WALKER = record_dtype(GuidedWalker)


@part
def walk(world: BeaconGround, inside: Bools, walker: GuidedWalker) -> tuple[float, float]:
    """One inertial event: a step in the true heading, and its dead reckoning."""
    walker.x += STEP_M * math.cos(walker.heading)
    walker.y += STEP_M * math.sin(walker.heading)
    return dead_reckon(world, inside, walker)


@part
def dead_reckon(world: BeaconGround, inside: Bools, walker: GuidedWalker) -> tuple[float, float]:
    """One step of dead reckoning in the measured heading, which the sources disturb; returns it (m, walk frame).

    `inside` (s,): the sources within whose radius the walker is; updated.
    """
    walker.error += disturbance(world.sources, inside, walker.x, walker.y, walker.heading)
    measured = walker.heading + walker.error
    dx, dy = STEP_M * math.cos(measured), STEP_M * math.sin(measured)
    walker.path_x += dx
    walker.path_y += dy
    walker.moved_x += dx
    walker.moved_y += dy
    return dx, dy


@part
def obey(walker: GuidedWalker, turn: float, obedience: Obedience, tick: int, rng: np.random.Generator) -> None:
    """Decide on the turn (rad) of a cue, as well as the person obeys, and when it is made."""
    walker.turn = turn + math.radians(obedience.heading_sd_deg) * rng.standard_normal()
    if rng.random() < obedience.wrong_turns:
        walker.turn += WRONG_TURN_RAD if rng.random() < 0.5 else -WRONG_TURN_RAD
    walker.turn_tick = tick + round(obedience.delay_s / TICK_S)
