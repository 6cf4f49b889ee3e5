# SPDX-License-Identifier: MIT
"""A careful walk from floor marker to floor marker, as in [Girard 2011, 3.4]: steps, headings and echoes without the electronics.

In: a route, the walls that are really there, a seed. Out: `MarkerWalk`: what foot, compass and rangers measured, and the truth. Owns nothing.

The MTx's heading is wrong in three ways [Girard 2011, Figure 10: quite accurate at first, then drifting]: the iron of the shoe turns it one
way or the other with the direction of walking, the on-board filter's reference wanders, and each step has noise. `ImuModel` has one size for each.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from echostep.arrays import Bools, Floats, Ints
from echostep.board.messages import Schedule
from echostep.elementary import wrap
from echostep_simulation.devices.srf02 import FIRST_US, HALF_US, JITTER_US, LAST_US
from echostep_simulation.world.acoustics import SRF02, Acoustics
from echostep_simulation.world.echoes import echoes, ranger_bias_m

STEP_M = 1.25  # [Girard 2011, 3.3]
STEP_S = 1.0  # one user step per second [Girard 2011, 3.3]
TURN_RAD_S = 2.2  # on the spot
SWAY_M = 0.02  # of the trunk to either side, between two markers
YAW_RAD = math.radians(3.0)  # the trunk turns with every step
PASSING_S = 1.0
CARELESS_M = 0.015  # how exactly the trunk comes over a marker


@dataclass(frozen=True, slots=True)
class ImuModel:
    """Heading errors of the foot-mounted MTx, degrees.

    `iron_deg`: mean amplitude of a deviation that goes with the sine of the direction and grows along the walk, from 0.15 to 1.85 of it;
    `wander_deg`: random walk, per step; `noise_deg`: of each step. The three sizes and the growth were chosen once, on a grid, so that dead
    reckoning over the paper's 52 steps has the paper's mean, deviation, maximum and end (tests/test_girard_study.py holds them to 15 %).
    """

    iron_deg: float = 2.0
    wander_deg: float = 1.0
    noise_deg: float = 2.0
    growth: float = 0.85


@dataclass(frozen=True, slots=True)
class MarkerPings:
    """Each ping's trigger time (n,), ranger (n,) 0 left 1 right, and range (n,), nan when nothing was heard.

    Of the truth: `pose` (n, 3): x, y and the ranger's axis; `cross` (n,): whether it was the other ranger's sound.
    """

    t_s: Floats
    ranger: Ints
    range_m: Floats
    pose: Floats
    cross: Bools


@dataclass(frozen=True, slots=True)
class MarkerWalk:
    """n steps between n + 1 markers. Truth: `t_s` of arrival, `trunk_m` (n + 1, 2). Measured: the rest.

    `leaves_s` (n + 1,): when the walker goes on, having turned on the spot; `heading_rad` (n,): of each step, walk frame that starts as the map;
    `turn_sd_rad` (n,): how far the heading's error may have changed since the step before; `pair_m` (n + 1, 2): one ping of each ranger at
    each marker, left and right; `pings`: every ping on the way.
    """

    t_s: Floats
    leaves_s: Floats
    trunk_m: Floats
    start_heading_rad: float
    heading_rad: Floats
    turn_sd_rad: Floats
    pair_m: Floats
    pings: MarkerPings


def lay_markers(route_m: Floats) -> Floats:
    """Markers a step apart along a route (n, 2): each is exactly one step from the one before, (m, 2)."""
    at = route_m[0]
    markers = [at]
    for corner in route_m[1:]:
        way = corner - at
        steps = round(math.hypot(*way) / STEP_M)
        if steps:
            markers += [at + way / math.hypot(*way) * STEP_M * k for k in range(1, steps + 1)]
            at = markers[-1]
    return np.array(markers)


def walk_markers(
    markers: Floats,
    built: Floats,
    seed: int,
    passers: float = 0.0,
    model: ImuModel | None = None,
    acoustics: Acoustics = SRF02,
    offset_s: float = HALF_US[Schedule.CONCURRENT] * 1e-6,
) -> MarkerWalk:
    """Walk over markers (n + 1, 2) between the walls that are there (m, 4); `passers`: share of the pings that a passer-by answers first;
    `offset_s`: from the left ranger's ping to the right one's.
    """
    ways, imu, rangers, people = (np.random.default_rng([seed, k]) for k in range(4))
    trunk = markers + CARELESS_M * ways.standard_normal(markers.shape)
    course = np.arctan2(*np.diff(markers, axis=0).T[::-1])
    turn = np.abs(wrap(np.diff(course, prepend=course[:1])))
    dwell = np.append(turn / TURN_RAD_S, 0.0)
    t_s = np.concatenate([[0.0], np.cumsum(STEP_S + dwell[1:]) - dwell[1:]])
    leaves_s = t_s + dwell
    error, turn_sd = _heading_error(course, turn, model or ImuModel(), imu)
    body = _Body(t_s, leaves_s, trunk, course, ways.uniform(0.0, 2.0 * math.pi))
    bias_m = ranger_bias_m(rangers, acoustics)
    pair = echoes(trunk, np.append(course, course[-1]), built, bias_m, rangers, acoustics).own_us
    pair_m = np.where(pair > 0, pair * (0.5e-6 * acoustics.speed_m_s), np.nan)
    pings = _ping(body, built, bias_m, offset_s, rangers, acoustics)
    if passers > 0.0:
        pings = _pass(pings, passers, people)
    return MarkerWalk(t_s, leaves_s, trunk, float(course[0]), course + error, turn_sd, pair_m, pings)


def _heading_error(course: Floats, turn: Floats, model: ImuModel, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Error of each step's heading, and the standard deviation of its change, which the unit states with the step."""
    iron, wander, noise = (math.radians(v) for v in (model.iron_deg, model.wander_deg, model.noise_deg))
    grown = 1.0 + model.growth * np.linspace(-1.0, 1.0, len(course))
    drift = np.cumsum(wander * rng.standard_normal(len(course)))
    error = iron * grown * np.sin(course) + drift + noise * rng.standard_normal(len(course))
    return error, np.hypot(wander, math.sqrt(2.0) * iron * np.sin(0.5 * turn))


class _Body:
    """Position and heading of the trunk at any time."""

    def __init__(self, t_s: Floats, leaves_s: Floats, trunk: Floats, course: Floats, phase: float) -> None:
        self.end_s = float(t_s[-1])
        self._times = np.column_stack([t_s, np.maximum(leaves_s, t_s + 1e-9)]).ravel()
        self._xy = np.repeat(trunk, 2, axis=0)
        heading = np.unwrap(course)
        self._heading = np.repeat(np.append(heading, heading[-1]), 2)
        self._heading[2::2] = heading  # arrives as it came
        self._t_s, self._leaves_s, self._phase = t_s, leaves_s, phase

    def at(self, t_s: Floats) -> tuple[Floats, Floats]:
        """Positions (n, 2) and headings (n,)."""
        x, y = (np.interp(t_s, self._times, self._xy[:, k]) for k in range(2))
        heading = np.interp(t_s, self._times, self._heading)
        step = np.clip(np.searchsorted(self._leaves_s, t_s, side="right") - 1, 0, len(self._t_s) - 2)
        share = np.clip((t_s - self._leaves_s[step]) / STEP_S, 0.0, 1.0)
        sway = SWAY_M * np.sin(math.pi * share) * np.where(step % 2, 1.0, -1.0)
        xy = np.column_stack([x - sway * np.sin(heading), y + sway * np.cos(heading)])
        return xy, heading + YAW_RAD * np.sin(math.pi * t_s + self._phase)


def _ping(
    body: _Body, built: Floats, bias_m: Floats, offset_s: float, rng: np.random.Generator, a: Acoustics
) -> MarkerPings:
    """The rangers ping in turn, the right one `offset_s` after the left one; each takes the first sound to arrive, be it the other's."""
    period_s = 2.0 * max(offset_s, HALF_US[Schedule.CONCURRENT] * 1e-6)
    count = 2 * int(body.end_s / period_s)
    ranger = np.arange(count) % 2
    t_s = (np.arange(count) // 2) * period_s + ranger * offset_s + rng.uniform(0.0, JITTER_US * 1e-6, count)
    xy, heading = body.at(t_s)
    simulated = echoes(xy, heading, built, bias_m, rng, a)
    came = np.zeros((count, 4))  # us after the trigger: own, and the other's last three pings about this one
    came[:, 0] = simulated.own_us[np.arange(count), ranger]
    for k, other in enumerate((-3, -1, 1), start=1):
        at = np.arange(count) + other * np.where(ranger == 1, 1, -1)
        there = (at >= 0) & (at < count)
        at = np.clip(at, 0, count - 1)
        cross_us = simulated.cross_us[at, ranger].astype(float)
        came[:, k] = np.where(there & (cross_us > 0), cross_us + (t_s[at] - t_s) * 1e6, 0.0)
    came[(came < FIRST_US) | (came > max(LAST_US, 2e6 * a.maximum_m / a.speed_m_s))] = np.inf
    first_us = came.min(1)
    range_m = np.where(np.isfinite(first_us), first_us * (0.5e-6 * a.speed_m_s), np.nan)
    axis = heading + np.where(ranger == 0, 0.5 * math.pi, -0.5 * math.pi)
    return MarkerPings(t_s, ranger, range_m, np.column_stack([xy, axis]), (came.argmin(1) > 0) & np.isfinite(first_us))


def _pass(pings: MarkerPings, share: float, rng: np.random.Generator) -> MarkerPings:
    """A passer-by on one side for about a second, at random times, nearer than the echo without the passer-by."""
    range_m = pings.range_m.copy()
    for side in (0, 1):
        t_s = 0.0
        while t_s < pings.t_s[-1]:
            t_s += rng.exponential(PASSING_S * (1.0 - share) / share)
            until_s = t_s + rng.exponential(PASSING_S)
            there = (pings.ranger == side) & (pings.t_s >= t_s) & (pings.t_s < until_s)
            range_m[there] = np.where(np.isnan(range_m[there]), 2.0, range_m[there]) * rng.uniform(0.3, 0.9)
            t_s = until_s
    return replace(pings, range_m=np.maximum(range_m, SRF02.minimum_m))
