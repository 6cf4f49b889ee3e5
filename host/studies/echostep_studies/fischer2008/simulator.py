# SPDX-License-Identifier: MIT
"""One guided return: the event-based simulator of [Fischer 2008, 4.2] around the paper's fusion and around a particle filter with beacons.

In: a `BeaconGround`, a system, the response to cues. Out: true and estimated places at each guidance, and whether the exit was reached. Owns the
loop of events: inertial every 10 ms, ultrasound every 200 ms, guidance every 2 s. Everything here is simulated.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.beacons.model import BeaconSettings
from echostep.jit import kernel, part
from echostep_app.guidance.contact import CONTACT, Contact, start_contact
from echostep_app.plan.polyline import along, way_m
from echostep_simulation.world.beacon_ground import BeaconGround
from echostep_studies.fischer2008.beacon_cloud import BeaconCloud, new_cloud, set_beacons, update_by_ultrasound
from echostep_studies.fischer2008.guidance import Advice, advise_by_cloud, advise_by_fusion, note_contact
from echostep_studies.fischer2008.learnt_trail import walk_in
from echostep_studies.fischer2008.paper_fusion import FUSION, Fusion, add_step, fuse_nearest, start_fusion
from echostep_studies.fischer2008.walker import EXACT, SPEED_M_S, TICK_S, WALKER, GuidedWalker, Obedience, obey, walk

PDR, PAPER, OURS = 0, 1, 2  # systems: dead reckoning alone, the paper's fusion, the particle filter with beacons
GUIDANCE_TICKS = 200  # between cues [Fischer 2008, 4.2]
NEAR_EXIT_M = 3.0  # "within a short distance of the end" [Fischer 2008, 4.2]
TIME_FACTOR = 2.5  # time allowed, in walks along the trail: "under a certain delay" [Fischer 2008, 4.2]; assumed
PARTICLES = 100
MORE_PARTICLES = 300  # where the map is learnt or uncertain, or measurements are rare
RARE_S = 2.0  # time between rare measurements
COMPASS = BeaconSettings(kick_per_m=0.3, tries_per_m=0.5)  # heading by a compass near iron, as the paper's; assumed
MAPPING = replace(COMPASS, kick_per_m=0.1)  # each accepted jump bends a map that is learnt


@dataclass(frozen=True, slots=True)
class Knowledge:
    """What is known of the beacons: place and axis within these standard deviations; `deployed`: only what was measured on the way in."""

    place_sd_m: float = 0.0
    axis_sd_rad: float = 0.0
    deployed: bool = False


EXACTLY = Knowledge()


class Return(NamedTuple):
    """`truth`, `believed` (n, 2): places at each guidance; `end_m`: final distance from the exit; `arrived`: came near it in time."""

    truth: Floats
    believed: Floats
    end_m: float
    arrived: bool


class _Rules(NamedTuple):
    """What does not change during a return."""

    system: int
    ultrasound_ticks: int
    deployed: bool
    obedience: Obedience


class _ReturnState(NamedTuple):
    """What changes during a return. Each system uses its part: the paper's `fusion`, the particle filter's `contact` and `cloud`."""

    walker: GuidedWalker
    fusion: Fusion
    contact: Contact
    cloud: BeaconCloud


def guided_return(
    world: BeaconGround, system: int, seed: int, period_s: float = 0.2, obedience: Obedience = EXACT,
    knowledge: Knowledge = EXACTLY,
) -> Return:  # fmt: skip
    """Guide one person back along the trail; equal seeds, equal returns. `period_s`: between ultrasound events."""
    rng = np.random.default_rng(seed)
    ticks = max(round(period_s / TICK_S), 1)
    rules = _Rules(system, ticks, knowledge.deployed, obedience)
    walker, fusion, contact = np.zeros(1, WALKER), np.zeros(1, FUSION), np.zeros(1, CONTACT)
    cloud = _first_cloud(world, system, period_s, knowledge, rng)
    if knowledge.deployed:
        walker["error"] = walk_in(world, cloud, ticks, rng)
    longest = int(TIME_FACTOR * way_m(world.trail) / SPEED_M_S / (GUIDANCE_TICKS * TICK_S)) + 2
    truth, believed = np.zeros((longest, 2)), np.zeros((longest, 2))
    state = _ReturnState(walker[0], fusion[0], contact[0], cloud)
    n, end_m, arrived = _walk_back(world, rules, state, rng, truth, believed)
    return Return(truth[:n], believed[:n], end_m, arrived)


def _first_cloud(
    world: BeaconGround, system: int, period_s: float, knowledge: Knowledge, rng: np.random.Generator
) -> BeaconCloud:
    """The cloud at the start: at the exit before the way in, else at the deepest point; of one unused particle in the other systems."""
    many = knowledge.deployed or knowledge.place_sd_m > 0.0 or period_s >= RARE_S
    size = (MORE_PARTICLES if many else PARTICLES) if system == OURS else 1
    x, y = world.trail[-1 if knowledge.deployed else 0].tolist()
    cloud = new_cloud(size, len(world.beacons), x, y, MAPPING if knowledge.deployed else COMPASS, rng)
    if not knowledge.deployed:
        set_beacons(cloud, world.believed, knowledge.place_sd_m, knowledge.axis_sd_rad)
    return cloud


@kernel
def _walk_back(
    world: BeaconGround, rules: _Rules, state: _ReturnState, rng: np.random.Generator, truth: Floats, believed: Floats
) -> tuple[int, float, bool]:
    """The loop of events. Writes the true and the estimated place at each guidance; returns their number, `end_m` and `arrived` of a `Return`."""
    walker, fusion, trail = state.walker, state.fusion, world.trail
    walker.x, walker.y, walker.heading = along(trail, 0.0)
    start_fusion(fusion, walker.x, walker.y)
    start_contact(state.contact, 0.0, 0.0, 0.0)
    inside = np.zeros(len(world.sources), np.bool_)
    order = np.arange(len(world.beacons))
    arrived, n, end_m = False, 0, np.inf
    for tick in range(GUIDANCE_TICKS * (len(truth) - 1) + 1):
        if tick % rules.ultrasound_ticks == 0:
            _measure(world, rules, state, tick, order, rng)
        if tick % GUIDANCE_TICKS == 0:
            advice = _advise(trail, rules, state, tick)
            obey(walker, advice.turn_rad, rules.obedience, tick, rng)
            truth[n], believed[n] = (walker.x, walker.y), (advice.x_m, advice.y_m)
            n += 1
            if advice.at_exit:
                break
        if tick == walker.turn_tick:
            walker.heading += walker.turn
        dx, dy = walk(world, inside, walker)
        add_step(fusion, dx, dy)
        end_m = math.hypot(walker.x - trail[-1, 0], walker.y - trail[-1, 1])
        arrived = arrived or end_m < NEAR_EXIT_M
    return n, end_m, arrived


@part
def _measure(
    world: BeaconGround, rules: _Rules, state: _ReturnState, tick: int, order: Ints, rng: np.random.Generator
) -> None:
    """One ultrasound event."""
    if rules.system == OURS:
        measured = update_by_ultrasound(world, state.cloud, state.walker, tick, order, rng)
        note_contact(state.contact, state.walker, tick, measured)
    elif rules.system == PAPER:
        fuse_nearest(world, state.walker, state.fusion, rng)


@part
def _advise(trail: Floats, rules: _Rules, state: _ReturnState, tick: int) -> Advice:
    """One guidance event."""
    if rules.system == OURS:
        return advise_by_cloud(state.cloud, state.contact, trail, rules.deployed, state.walker, tick)
    return advise_by_fusion(state.fusion, trail, state.walker)
