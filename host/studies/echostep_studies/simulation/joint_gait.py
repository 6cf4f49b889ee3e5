# SPDX-License-Identifier: MIT
"""Simulated gait from joint angle curves: the motion of the hips follows from feet that roll on the floor without slip.

In: a gait (slow, natural, fast), a person drawn from a seed, how long. Out: `SimulatedGait`: rates of thigh and shank, and where the hips are. Owns
the curves.

Nothing here knows how far a stride goes. Heel and ball of both feet hang from the hips by thigh, shank and foot; the lower one of a foot that
carries stays where it is, and the hips move against it. So the way is that of the whole chain, two legs and their ankles, each person's own.
`walker` does it the other way round: it places feet and trunk and asks which legs join them.

Joint curves every 5 % of the stride, degrees, read from [Winter 2009; Perry 1992; Kadaba 1990]; slow and fast walking scale them as in
[Winter 1991; Murray 1984; Bovi 2011]: with speed the hips' excursion and the knee's flexion under load grow, and the stride takes less time. The
foot pushes off farther and earlier: with speed the greatest plantarflexion grows from 10 to 22 degrees, and toe off comes from 65 to 60 percent of
the stride [Schwartz 2008, read from memory].
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from echostep.arrays import Floats
from echostep_simulation.people.leg_angles import HALF_PELVIS_M, KNEE_DEG, THIGH_DEG, LegDimensions, series
from echostep_simulation.people.rolling_foot import glide

RATE_HZ = 500
ANKLE_DEG = (1, -3, -1, 3, 6, 8, 10, 11, 12, 13, 9, -2, -14, -16, -7, -2, 1, 2, 2, 2)  # dorsiflexion
LOADED = 0.30  # of the stride: until then the knee's flexion is that under load
# Of the stride: begin and end of the rise and of the fall of what the pace does to the push-off
PUSHES = (0.28, 0.48, 0.66, 0.82)
DOUBLE = 0.12  # of the stride on both feet, twice [Perry 1992]
LONGEST_STEP_S = 1.0
CARRY_M = 0.004  # a point so much above the other carries a third as much
START = 0.55  # of the stride's time, from standing to the whole movement: the first step is a little shorter than the others [Breniere and Do 1986]


@dataclass(frozen=True, slots=True)
class WalkingPace:
    """Pace of walking: `hip` and `load` scale the hip's excursion and the knee's flexion under load, `swing` that in the swing, `stride_s`.

    `push` scales the ankle's plantarflexion at push-off, `late` is by how much of a stride it comes later.
    """

    hip: float
    load: float
    swing: float
    stride_s: float
    push: float
    late: float


SLOW, NATURAL, FAST = (
    WalkingPace(0.78, 0.55, 0.93, 1.42, 0.65, 0.025),
    WalkingPace(1.0, 1.0, 1.0, 1.10, 1.0, 0.0),
    WalkingPace(1.14, 1.25, 1.03, 0.97, 1.3, -0.02),
)


@dataclass(frozen=True, slots=True)
class JointGaitPerson:
    """One person: the leg, the foot (`ankle_m` high, `heel_m` behind and `ball_m` ahead of the ankle), and the factors of the joint curves."""

    leg: LegDimensions
    ankle_m: float
    heel_m: float
    ball_m: float
    thigh_deg: float  # more flexion all the time
    ankle_deg: float
    hip: float  # of the curve
    knee: float
    ankle: float
    other: float  # amplitude of the other leg against this
    pace: float
    pelvis_deg: float  # turned either way


@dataclass(frozen=True, slots=True)
class SimulatedGait:
    """Arrays of n samples at `RATE_HZ`: time, rates of thigh and shank (rad/s, forward positive), how far the hips have come."""

    t_s: Floats
    thigh_rad_s: Floats
    shank_rad_s: Floats
    way_m: Floats


def draw_person(rng: np.random.Generator) -> JointGaitPerson:
    """An adult of 1.50 to 1.95 m, proportions after [Winter 2009], each a little otherwise; curves that differ as people's do [Kadaba 1990]."""
    height = rng.uniform(1.50, 1.95)
    share = 1.0 + 0.04 * rng.standard_normal(5)
    leg = LegDimensions(0.245 * height * share[0], 0.246 * height * share[1])
    thigh_deg, ankle_deg = (3.0 * rng.standard_normal(2)).tolist()
    hip, knee, ankle, other, pace = (1.0 + np.array([0.08, 0.08, 0.15, 0.03, 0.05]) * rng.standard_normal(5)).tolist()
    pelvis_deg = 4.0 + 1.2 * rng.standard_normal()
    ankle_m, heel_m, ball_m = (np.array([0.039, 0.032, 0.075]) * height * share[2:]).tolist()
    return JointGaitPerson(
        leg, ankle_m, heel_m, ball_m, thigh_deg, ankle_deg, hip, knee, ankle, other, pace, pelvis_deg
    )  # fmt: skip


def simulate_gait(
    person: JointGaitPerson, manner: WalkingPace, walk_s: float, rng: np.random.Generator, stand_s: float = 1.5
) -> SimulatedGait:
    """Stand, walk for `walk_s` or up to half a stride longer, stand; the first leg is drawn at random.

    The walk begins with a foot that leaves the floor and ends with one that lands beside the other [Jian 1993].
    """
    t = np.arange(0.0, walk_s + 2.0 * stand_s + LONGEST_STEP_S, 1.0 / RATE_HZ)
    stride_s = manner.stride_s * person.pace
    seconds = np.arange(int(t[-1]) + 3)
    wander = np.interp(t, seconds, 1.0 + 0.03 * rng.standard_normal(len(seconds)))
    phase = np.cumsum(wander) / RATE_HZ / stride_s
    phase += rng.choice([0.62, 0.12]) - phase[int(stand_s * RATE_HZ)]
    steps = 2.0 * phase[int((stand_s + walk_s) * RATE_HZ)]
    stop_s = float(np.interp(0.5 * math.ceil(steps), phase, t))
    moves = glide((t - stand_s) / (START * stride_s)) * glide((stop_s - t) / (START * stride_s))
    right, left = (_angles(person, manner, phase + k, moves, 1.0 if k == 0.0 else person.other) for k in (0.0, 0.5))
    turned = HALF_PELVIS_M * np.sin(math.radians(person.pelvis_deg) * manner.hip * moves * np.cos(2.0 * np.pi * phase))
    moved = (
        _hip_step(_points(person, angles)) - side * np.gradient(turned) for angles, side in ((right, 1.0), (left, -1.0))
    )
    way = np.cumsum(sum(_carried(phase + k) * step for k, step in zip((0.0, 0.5), moved, strict=True)))
    thigh, shank = (np.gradient(angle) * RATE_HZ for angle in right[:2])
    return SimulatedGait(t, thigh, shank, way)


def _angles(
    person: JointGaitPerson, manner: WalkingPace, phase: Floats, moves: Floats, amplitude: float
) -> tuple[Floats, Floats, Floats]:
    """Thigh, shank and foot against their standing (rad, forward and toe up positive)."""
    part = phase % 1.0
    thigh_mean = math.radians(sum(THIGH_DEG) / len(THIGH_DEG))
    thigh = thigh_mean + manner.hip * person.hip * amplitude * (series(THIGH_DEG, phase) - thigh_mean)
    loaded = glide((LOADED + 0.08 - part) / 0.16) + glide((part - 0.96) / 0.04)
    knee = (
        series(KNEE_DEG, phase) * person.knee * (manner.swing + (manner.load - manner.swing) * np.minimum(loaded, 1.0))
    )
    ankle = person.ankle * _ankle(manner, phase) + math.radians(person.ankle_deg)
    thigh = moves * (thigh + math.radians(person.thigh_deg))
    knee = np.maximum(moves * knee, 0.0) + math.radians(3.0)
    shank = thigh - knee
    return thigh, shank, shank + moves * ankle + (1.0 - moves) * (knee - thigh)


def _ankle(manner: WalkingPace, phase: Floats) -> Floats:
    """Dorsiflexion (n,), rad, with a push-off that is farther and later by the pace."""
    part = phase % 1.0
    pushes = glide((part - PUSHES[0]) / (PUSHES[1] - PUSHES[0])) * glide((PUSHES[3] - part) / (PUSHES[3] - PUSHES[2]))
    curve = series(ANKLE_DEG, phase - manner.late * pushes)
    angles: Floats = np.where(curve < 0.0, curve * (1.0 + (manner.push - 1.0) * pushes), curve)
    return angles


def _points(person: JointGaitPerson, angles: tuple[Floats, Floats, Floats]) -> Floats:
    """Heel and ball (n, 2, 2) from the hip, forward and up."""
    thigh, shank, foot = angles
    leg, points = person.leg, []
    x = leg.thigh_m * np.sin(thigh) + leg.shank_m * np.sin(shank)
    z = -leg.thigh_m * np.cos(thigh) - leg.shank_m * np.cos(shank)
    c, s = np.cos(foot), np.sin(foot)
    for ahead in (-person.heel_m, person.ball_m):
        points.append(np.stack([x + ahead * c + person.ankle_m * s, z + ahead * s - person.ankle_m * c], axis=1))
    return np.stack(points, axis=1)


def _hip_step(points: Floats) -> Floats:
    """How far the hip goes from sample to sample (n,) over heel and ball (n, 2, 2) of which the lower does not slip."""
    low = points[:, :, 1] - points[:, :, 1].min(axis=1, keepdims=True)
    carry = np.exp(-low / CARRY_M)
    carry /= carry.sum(axis=1, keepdims=True)
    steps_m: Floats = -(carry * np.gradient(points[:, :, 0], axis=0)).sum(axis=1)
    return steps_m


def _carried(phase: Floats) -> Floats:
    """The leg's share of the weight (n,): both legs' shares are 1 together."""
    part = phase % 1.0
    return np.interp(part, [0.0, DOUBLE, 0.5, 0.5 + DOUBLE, 1.0], [0.0, 1.0, 1.0, 0.0, 0.0])
