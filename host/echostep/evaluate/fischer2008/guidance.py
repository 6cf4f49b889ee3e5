"""Guidance along the trail [Fischer 2008, Figure 8]: the turn towards a target some metres ahead, for the paper's fusion and for the cloud.

In: an estimate, the trail. Out: `Advice`. Owns the fields of a `Contact` record: when and where a beacon last measured.

One rule differs from the tracker's, going back when no beacon measures: here the walker is sent back after SILENCE_S, to the dead-reckoned place of
the last measurement; the tracker's guide warns then, sends back after twice this time to the last estimated place, and says "stop" there and where
the heading is uncertain. Both double the allowed time after each return. The tracker's rules lost more returns: see `beacon_cloud`.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

import numpy as np

from echostep.arrays import Floats, record_dtype
from echostep.evaluate.fischer2008.beacon_cloud import BeaconCloud, mean_place
from echostep.evaluate.fischer2008.learnt_trail import believed_trail, span_near_heard
from echostep.evaluate.fischer2008.paper_fusion import Fusion, note_reliable
from echostep.evaluate.fischer2008.walker import TICK_S, GuidedWalker
from echostep.jit import kernel
from echostep.plan.polyline import along, nearest

AHEAD_M = 3.0  # "a few metres ahead along the path" [Fischer 2008, 4.2]
ARRIVED_M = 1.0  # distance of the estimate from the exit at which guidance ends; by reason
SILENCE_S = 3.0  # without a measurement until the walker is sent back; by reason
SAFE_S = 15.0  # of measurements after which a longer allowed time is reset; by reason


class Advice(NamedTuple):
    """Estimated place (m), turn to be made (rad), and whether guidance ends because the exit is reached by the estimate."""

    x_m: float
    y_m: float
    turn_rad: float
    at_exit: bool


class Contact(Protocol):
    """A record of floats: the contact of the walker with any beacon. Ticks since the start; places in the walk frame (m)."""

    last_tick: float  # of the last measurement
    last_x: float  # where it was made
    last_y: float
    silent_tick: float  # of the last ultrasound event without a measurement
    limit_s: float  # without a measurement until the walker is sent back
    sent_back: float  # 1: has been sent back since the last measurement


CONTACT = record_dtype(Contact)


@kernel
def update_contact(contact: Contact, walker: GuidedWalker, heard: bool, tick: int, silence_s: float) -> None:
    """One ultrasound event; `heard`: a beacon measured. The allowed silence doubles after each return, and is `silence_s` again after SAFE_S."""
    if not heard:
        contact.silent_tick = tick
        return
    contact.last_tick, contact.last_x, contact.last_y = tick, walker.path_x, walker.path_y
    if contact.sent_back:
        contact.limit_s, contact.sent_back = 2.0 * contact.limit_s, 0.0
    elif (tick - contact.silent_tick) * TICK_S > SAFE_S:
        contact.limit_s = silence_s


@kernel
def advise_by_fusion(fusion: Fusion, trail: Floats, walker: GuidedWalker) -> Advice:
    """One guidance event by the paper's fusion."""
    note_reliable(fusion)
    direction, rest_m = _target(trail, fusion.x, fusion.y, 0.0, np.inf)
    turn = direction - (walker.heading + walker.error + fusion.offset)
    return Advice(fusion.x, fusion.y, turn, rest_m < ARRIVED_M)


@kernel
def advise_by_cloud(
    cloud: BeaconCloud, contact: Contact, trail: Floats, deployed: bool, walker: GuidedWalker, tick: int,
    silence_s: float,
) -> Advice:  # fmt: skip
    """One guidance event by the cloud; `deployed`: each particle goes by the map that it learnt on the way in, else by the trail."""
    x, y = mean_place(cloud.particles)
    measured = walker.heading + walker.error
    turn, rest_m = _mean_turn(cloud, trail, deployed, measured, tick - silence_s / TICK_S)
    silent_s = (tick - contact.last_tick) * TICK_S
    if silent_s > contact.limit_s:
        turn = math.atan2(contact.last_y - walker.path_y, contact.last_x - walker.path_x) - measured
        contact.sent_back = 1.0
    return Advice(x, y, turn, rest_m < ARRIVED_M and silent_s < silence_s)


@kernel
def _mean_turn(
    cloud: BeaconCloud, trail: Floats, deployed: bool, measured: float, since_tick: float
) -> tuple[float, float]:
    """Weighted means over the particles of the turn (rad) to the target and of the distance of the exit (m).

    `measured`: heading. Turns are averaged, not places: on maps that are bent differently a mean place has no meaning. On a learnt map a particle
    is looked for near the beacons that were heard at or after `since_tick`.
    """
    particles, heard = cloud.particles, cloud.heard_ticks >= since_tick
    total, east, north, rest = 0.0, 0.0, 0.0, 0.0
    path, from_m, to_m = trail, 0.0, np.inf
    for i in range(len(particles.x_m)):
        w = math.exp(particles.log_weight[i])
        if deployed:
            path = believed_trail(cloud, i, trail[-1])
            from_m, to_m = span_near_heard(path, heard)
        turn, rest_m = _target(path, particles.x_m[i], particles.y_m[i], from_m, to_m)
        turn -= measured + particles.turn_rad[i]
        total += w
        east += w * math.cos(turn)
        north += w * math.sin(turn)
        rest += w * rest_m
    return math.atan2(north, east), rest / total


@kernel
def _target(path: Floats, x: float, y: float, from_m: float, to_m: float) -> tuple[float, float]:
    """Direction (rad) from (x, y) to the target AHEAD_M along a path (k, 2), and the distance of its end (m) [Fischer 2008, Figure 8].

    The place on the path is the nearest one between the lengths `from_m` and `to_m` along it.
    """
    s, _ = nearest(path, x, y, from_m, to_m)
    to_x, to_y, _ = along(path, s + AHEAD_M)
    return math.atan2(to_y - y, to_x - x), math.hypot(x - path[-1, 0], y - path[-1, 1])
