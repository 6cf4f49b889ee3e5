# SPDX-License-Identifier: MIT
"""Falls, and what looks like them: the sensors of belt, thigh and foot on a wearer who walks, then falls, jumps, sits down hard, kneels, lies down.

In: a manner, a seeded generator. Out: `BodySamples`. Owns the manners, which are composed of the movements of `body_motion.py`.

Ranges of drops, times and angles are assumed, except: hips meet the floor at 2 to 3.5 m/s [Feldman and Robinovitch 2007, as remembered], which is
what a drop of 0.45 to 0.9 m by 0.5 to 0.8 of gravity gives. World: x ahead, y left, z up. Pitch: forward positive; of a foot, the heel goes up.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats
from echostep_studies.simulation.body_motion import G0_M_S2, LSM6DSO, BodyMotion, MotionSamples, SensorPart

STRIDE_S, STRIDE_M = 1.1, 1.4
SETTLED_S = 16.0  # of rest after the movement
BREATH_HZ, BREATH_RAD = 0.3, 0.012  # of the belt of a wearer at rest


class BodySamples(NamedTuple):
    """Samples of a run; `strides` (k, 2): their begin and end; `event_s`: when the movement after the walk begins."""

    belt: MotionSamples
    thigh: MotionSamples
    foot: MotionSamples
    strides: Floats
    event_s: float


class Body(NamedTuple):
    """The places of a wearer, and the generator."""

    belt: BodyMotion
    thigh: BodyMotion
    foot: BodyMotion
    rng: np.random.Generator

    def between(self, low: float, high: float) -> float:
        """A number drawn evenly."""
        return float(self.rng.uniform(low, high))

    def side(self) -> float:
        """Left or right."""
        return float(self.rng.choice([-1.0, 1.0]))


Manner = Callable[[Body, float], None]  # adds its movement from that time on


def walk_then(manner: Manner, foot: SensorPart, rng: np.random.Generator, walk_s: float = 8.0) -> BodySamples:
    """A walk, a second or two of standing, then the manner, then rest."""
    strides = round(walk_s / STRIDE_S)
    end_s = strides * STRIDE_S
    event_s = end_s + rng.uniform(0.3, 2.0)
    belt, thigh, leg = (BodyMotion(event_s + 6.0 + SETTLED_S) for _ in range(3))
    body = Body(belt, thigh, leg, rng)
    for k in range(strides):
        _stride(body, k * STRIDE_S)
    manner(body, event_s)
    resting = body.belt.t_s > event_s + 4.0
    body.belt.rpy[:, 1] += np.where(resting, BREATH_RAD * np.sin(math.tau * BREATH_HZ * body.belt.t_s), 0.0)
    begins = STRIDE_S * np.arange(strides)
    spans = np.column_stack([begins, begins + STRIDE_S])
    return BodySamples(
        body.belt.samples(LSM6DSO, rng), body.thigh.samples(LSM6DSO, rng), body.foot.samples(foot, rng), spans, event_s
    )


def _stride(body: Body, begin_s: float) -> None:
    """A stride of the foot from mid-stance to mid-stance, and two steps of the trunk."""
    foot, t_s = body.foot, begin_s + 0.3 * STRIDE_S
    foot.turn(t_s - 0.15, 0.25, 65.0)  # heel rise
    foot.move(t_s + 0.05, 0.42, 0.0, STRIDE_M)
    foot.move(t_s + 0.05, 0.2, 0.1)
    foot.move(t_s + 0.25, 0.22, -0.1)
    foot.turn(t_s + 0.12, 0.33, -85.0)
    foot.stop(t_s + 0.47, 0.5, 0.015)  # heel strike
    foot.stop(t_s + 0.47, 0.5, 0.03, 0)
    foot.turn(t_s + 0.48, 0.1, 20.0)
    body.thigh.turn(begin_s, 0.5 * STRIDE_S, -40.0)
    body.thigh.turn(begin_s + 0.5 * STRIDE_S, 0.5 * STRIDE_S, 40.0)
    for k in range(2):
        step_s = begin_s + (0.2 + 0.5 * k) * STRIDE_S
        body.belt.move(step_s, 0.25 * STRIDE_S, 0.03)
        body.belt.move(step_s + 0.25 * STRIDE_S, 0.25 * STRIDE_S, -0.03)
        body.belt.stop(step_s + 0.5 * STRIDE_S, 0.1, 0.03)


def forward(body: Body, t_s: float) -> None:
    """A trip: the trunk turns over the feet, on the belly; the feet come to lie on toes or instep, turned in or out."""
    met_s = body.belt.drop(t_s, body.between(0.75, 0.9), body.between(0.5, 0.8), body.between(0.03, 0.09))
    body.belt.stop(met_s, body.between(0.3, 1.2), body.between(0.05, 0.15), 0)
    for place in (body.belt, body.thigh):
        place.turn(t_s, met_s - t_s, body.between(80.0, 95.0), body.between(-15.0, 15.0))
    _flail(body, t_s, met_s, body.between(70.0, 120.0), body.side() * body.between(20.0, 90.0))


def sideways(body: Body, t_s: float) -> None:
    """On the hip."""
    met_s = body.belt.drop(t_s, body.between(0.7, 0.85), body.between(0.6, 0.85), body.between(0.03, 0.08))
    side = body.side()
    body.belt.turn(t_s, met_s - t_s, body.between(-10.0, 30.0), side * body.between(75.0, 100.0))
    body.thigh.turn(t_s, met_s - t_s, body.between(-60.0, 20.0), side * body.between(70.0, 100.0))
    _flail(body, t_s, met_s, body.between(-20.0, 40.0), side * body.between(55.0, 100.0))


def backward(body: Body, t_s: float) -> None:
    """A slip, on the back; the feet point up and fall outwards."""
    met_s = body.belt.drop(t_s, body.between(0.7, 0.85), body.between(0.7, 0.95), body.between(0.03, 0.08))
    body.belt.turn(t_s, met_s - t_s + 0.1, -body.between(75.0, 95.0))
    body.thigh.turn(t_s, met_s - t_s + 0.1, -body.between(70.0, 95.0))
    _flail(body, t_s, met_s, -body.between(40.0, 75.0), body.side() * body.between(20.0, 75.0))


def syncope(body: Body, t_s: float) -> None:
    """The knees give way: down on them or on the buttocks, then over to a side, to the back or on the belly."""
    met_s = body.belt.drop(t_s, body.between(0.4, 0.55), body.between(0.45, 0.8), body.between(0.06, 0.15))
    bent_deg = body.between(20.0, 80.0)
    body.thigh.turn(t_s, met_s - t_s, -bent_deg)
    pause_s = body.between(0.0, 0.6)
    second_s = body.belt.drop(met_s + 0.1 + pause_s, body.between(0.2, 0.35), body.between(0.3, 0.7), 0.08)
    which = body.between(0.0, 3.0)
    pitch, roll = (0.0, 85.0 * body.side()) if which < 1.0 else (85.0 if which < 2.0 else -85.0, 0.0)
    over_s, share = second_s - met_s, body.between(0.9, 1.05)
    body.belt.turn(met_s + 0.1 + pause_s, over_s, pitch * share, roll)
    body.thigh.turn(met_s + 0.1 + pause_s, over_s, pitch * share + bent_deg + body.between(-30.0, 10.0), roll)
    _flail(body, t_s, second_s, body.between(20.0, 110.0), body.side() * body.between(10.0, 90.0))


def _flail(body: Body, t_s: float, met_s: float, pitch_deg: float, roll_deg: float) -> None:
    """The foot leaves its stance, turns and meets the floor about when the trunk does."""
    begin_s = t_s + body.between(0.1, 0.4)
    body.foot.turn(begin_s, max(met_s - begin_s, 0.2), pitch_deg, roll_deg)
    body.foot.drop(met_s - 0.1, body.between(0.08, 0.35), body.between(0.5, 0.95), body.between(0.01, 0.03))


def jump(body: Body, t_s: float) -> None:
    """Down from a ledge, landing on the feet with bent knees, then standing."""
    height_m = body.between(0.2, 0.8)
    for place, stop in ((body.belt, (0.08, 0.2)), (body.thigh, (0.08, 0.2)), (body.foot, (0.01, 0.04))):
        place.drop(t_s, height_m, 1.0, body.between(*stop))
    met_s = t_s + math.sqrt(2.0 * height_m / G0_M_S2)
    _bend(body, met_s, 0.3, body.between(10.0, 50.0), -body.between(20.0, 80.0))
    _bend(body, met_s + body.between(0.4, 2.0), 0.6, -30.0, 50.0)


def sit_hard(body: Body, t_s: float) -> None:
    """On a chair or a step, heavily; the feet stand."""
    met_s = body.belt.drop(t_s, body.between(0.3, 0.45), body.between(0.4, 0.9), body.between(0.03, 0.12))
    _bend(body, t_s, met_s - t_s, -body.between(-30.0, 40.0), -90.0)


def sit_on_floor(body: Body, t_s: float) -> None:
    """Down on the floor within 1 to 2 s, the last part a drop, the legs stretched or crossed."""
    down_s = body.between(0.8, 1.6)
    body.belt.move(t_s, down_s, -0.7)
    met_s = body.belt.drop(t_s + down_s, body.between(0.05, 0.2), body.between(0.4, 0.9), body.between(0.04, 0.1))
    _bend(body, t_s, down_s, -body.between(5.0, 40.0), -body.between(80.0, 110.0))
    crossed = body.rng.random() < 0.5
    pitch, roll = (20.0, 70.0) if crossed else (-70.0, body.between(-30.0, 30.0))
    body.foot.turn(met_s, body.between(0.5, 1.0), pitch, roll * body.side())
    body.foot.stop(met_s + 0.6, body.between(0.1, 0.5), 0.02)


def drop_to_knees(body: Body, t_s: float) -> None:
    """On both knees at once, then still: the thighs are upright, the soles point up and back."""
    met_s = body.belt.drop(t_s, body.between(0.35, 0.45), body.between(0.4, 0.9), body.between(0.04, 0.12))
    _bend(body, t_s, met_s - t_s, body.between(0.0, 40.0), body.between(-15.0, 15.0))
    body.foot.turn(t_s + 0.1, max(met_s - t_s - 0.1, 0.15), body.between(70.0, 120.0), body.between(-35.0, 35.0))
    body.foot.stop(met_s, body.between(0.2, 1.0), body.between(0.01, 0.03))


def all_fours(body: Body, t_s: float) -> None:
    """On the knees, then on the hands as well, and a pause there: the trunk lies, the thighs do not."""
    drop_to_knees(body, t_s)
    body.belt.turn(t_s + body.between(0.6, 1.5), body.between(0.4, 0.8), body.between(40.0, 70.0))
    body.belt.stop(t_s + 1.6, body.between(0.2, 0.6), 0.05)


def crouch(body: Body, t_s: float) -> None:
    """Down quickly, bent forward, on the balls of the feet."""
    body.belt.move(t_s, body.between(0.4, 1.0), -0.5)
    _bend(body, t_s, 0.6, body.between(20.0, 55.0), -body.between(80.0, 120.0))
    body.foot.turn(t_s, 0.5, body.between(0.0, 50.0))


def stoop(body: Body, t_s: float) -> None:
    """Bent over to the floor right after a hard step, legs straight, and so for a while."""
    body.belt.stop(t_s, body.between(0.5, 1.0), 0.04)
    body.belt.turn(t_s + 0.1, body.between(0.6, 1.2), body.between(60.0, 100.0))


def lie_down(body: Body, t_s: float) -> None:
    """On the belly on purpose: on a knee, on the hands, down within 2 to 4 s."""
    body.belt.move(t_s, 0.9, -0.45)
    body.belt.stop(t_s + 0.9, body.between(0.2, 0.6), 0.06)
    begin_s, down_s = t_s + body.between(1.0, 2.0), body.between(1.0, 2.0)
    body.belt.move(begin_s, down_s, -0.4)
    for place in (body.belt, body.thigh):
        place.turn(begin_s, down_s, 88.0)
    body.foot.turn(t_s + 0.3, 1.0, body.between(70.0, 110.0), body.side() * body.between(0.0, 80.0))
    body.foot.stop(t_s + 1.2, body.between(0.1, 0.5), 0.02)


def stumble(body: Body, t_s: float) -> None:
    """Caught after a stumble: hard steps, the trunk comes up again."""
    for k in range(3):
        step_s = t_s + 0.35 * k
        body.belt.drop(step_s, body.between(0.02, 0.12), body.between(0.5, 0.9), body.between(0.03, 0.08))
        body.foot.stop(step_s + 0.2, body.between(0.5, 2.0), 0.015)
    _bend(body, t_s, 0.6, body.between(20.0, 55.0), -30.0)
    _bend(body, t_s + 0.8, 0.8, -35.0, 30.0)


def _bend(body: Body, t_s: float, seconds: float, trunk_deg: float, thigh_deg: float) -> None:
    body.belt.turn(t_s, seconds, trunk_deg)
    body.thigh.turn(t_s, seconds, thigh_deg)


FALLS: dict[str, Manner] = {"forward": forward, "sideways": sideways, "backward": backward, "syncope": syncope}
NO_FALLS: dict[str, Manner] = {
    "jump down": jump, "sit down hard": sit_hard, "sit on the floor": sit_on_floor, "drop to the knees": drop_to_knees,
    "all fours": all_fours, "crouch": crouch, "stoop": stoop, "lie down on purpose": lie_down, "stumble": stumble,
}  # fmt: skip
