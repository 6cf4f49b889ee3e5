# SPDX-License-Identifier: MIT
"""Guidance along the trail [Fischer 2008, Figure 8]: the turn towards a target some metres ahead, for the paper's fusion and for the cloud.

In: an estimate, the trail. Out: `Advice`. Owns nothing. When the walker is sent back, and on, is the tracker's rule (`guidance/contact.py`).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats
from echostep.beacons.step import mean_place
from echostep.jit import part
from echostep_app.guidance.contact import Contact, allowed_silence, update_contact
from echostep_app.guidance.cues import AHEAD_M, ARRIVED_M, SILENCE_S
from echostep_app.plan.polyline import nearest, turn_ahead
from echostep_studies.fischer2008.beacon_cloud import BeaconCloud
from echostep_studies.fischer2008.learnt_trail import believed_trail, span_near_heard
from echostep_studies.fischer2008.paper_fusion import Fusion, note_reliable
from echostep_studies.fischer2008.walker import TICK_S, GuidedWalker


class Advice(NamedTuple):
    """Estimated place (m), turn to be made (rad), and whether guidance ends because the exit is reached by the estimate."""

    x_m: float
    y_m: float
    turn_rad: float
    at_exit: bool


@part
def advise_by_fusion(fusion: Fusion, trail: Floats, walker: GuidedWalker) -> Advice:
    """One guidance event by the paper's fusion."""
    note_reliable(fusion)
    turn, rest_m = _target(trail, fusion.x, fusion.y, walker.heading + walker.error + fusion.offset, 0.0, np.inf)
    return Advice(fusion.x, fusion.y, turn, rest_m < ARRIVED_M)


@part
def note_contact(contact: Contact, walker: GuidedWalker, tick: int, measured: bool) -> bool:
    """Whether the walker is to go back; `measured`: a beacon measures now. Places are those of dead reckoning."""
    t_s = tick * TICK_S
    known_s = t_s if measured else contact.known_s
    return update_contact(contact, t_s, known_s, walker.path_x, walker.path_y, False, SILENCE_S)


@part
def advise_by_cloud(
    cloud: BeaconCloud, contact: Contact, trail: Floats, deployed: bool, walker: GuidedWalker, tick: int
) -> Advice:
    """One guidance event by the cloud; `deployed`: each particle goes by the map that it learnt on the way in, else by the trail."""
    x, y = mean_place(cloud.particles)
    measured, silence_s = walker.heading + walker.error, allowed_silence(contact, SILENCE_S)
    turn, rest_m = _mean_turn(cloud, trail, deployed, measured, tick - silence_s / TICK_S)
    if note_contact(contact, walker, tick, False):
        turn = math.atan2(contact.known_y - walker.path_y, contact.known_x - walker.path_x) - measured
    return Advice(x, y, turn, rest_m < ARRIVED_M and tick * TICK_S - contact.known_s < silence_s)


@part
def _mean_turn(
    cloud: BeaconCloud, trail: Floats, deployed: bool, measured: float, since_tick: float
) -> tuple[float, float]:
    """Weighted means over the particles of the turn (rad) to the target and of the distance of the exit (m).

    `measured`: heading. Turns are averaged, not places: on maps that are bent differently a mean place has no meaning. On a learnt map a particle
    is looked for near the beacons that were heard at or after `since_tick`.
    """
    particles, recent = cloud.particles, cloud.heard_ticks >= since_tick
    total, east, north, rest = 0.0, 0.0, 0.0, 0.0
    path, from_m, to_m = trail, 0.0, np.inf
    for i in range(len(particles.x_m)):
        w = math.exp(particles.log_weight[i])
        if deployed:
            path = believed_trail(cloud, i, trail[-1])
            from_m, to_m = span_near_heard(path, recent)
        turn, rest_m = _target(path, particles.x_m[i], particles.y_m[i], measured + particles.turn_rad[i], from_m, to_m)
        total += w
        east += w * math.cos(turn)
        north += w * math.sin(turn)
        rest += w * rest_m
    return math.atan2(north, east), rest / total


@part
def _target(path: Floats, x: float, y: float, heading: float, from_m: float, to_m: float) -> tuple[float, float]:
    """Turn (rad) from a heading at (x, y) to the target AHEAD_M along a path (k, 2), and the distance of its end (m).

    The place on the path is the nearest one between the lengths `from_m` and `to_m` along it.
    """
    s, _ = nearest(path, x, y, from_m, to_m)
    return turn_ahead(path, s + AHEAD_M, x, y, heading), math.hypot(x - path[-1, 0], y - path[-1, 1])
