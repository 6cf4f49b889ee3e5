# SPDX-License-Identifier: MIT
"""A simulated walk: trunk, right foot, thigh and calf at 1 kHz.

In: waypoints on the plan, a seeded generator. Out: `Walk`: arrays at 1 kHz, map frame. Owns nothing.
The person walks rounded corners, and stops for a pause or a sharp turn, with a turn on the spot. Between waypoints of different height follow
stairs, with shorter strides; above one another they are a lift's. The right foot's path is built from smooth pieces (`footpath`), so that integrating
what its sensors would feel gives the path back.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from echostep.arrays import Bools, Floats
from echostep.elementary import wrap
from echostep_simulation.people.attitude import rotations
from echostep_simulation.people.foot_path import FootPath, Strides, foot_path
from echostep_simulation.people.leg_angles import STRAIGHT, LegDimensions, hip_path, leg_angles, stair_angles, sway

Waypoint = (  # x, y, how long to pause there (s), height (m; 0 when not given)
    tuple[float, float] | tuple[float, float, float] | tuple[float, float, float, float]
)

RATE_HZ = 1000
PATH_STEP_M = 0.01
SHARP_RAD = math.radians(100.0)  # sharper corners are turned on the spot; assumed
TURN_STRIDE_RAD = math.radians(75.0)  # per stride when turning on the spot
SMOOTH_MS = 301
STEEP = 0.1  # rise over run; less is a ramp, walked as the flat
STAIR_STRIDE_M = 0.58  # of run: two treads of 29 cm
LIFT_M_S, LIFT_M_S2 = 1.0, 0.8  # a passenger lift's speed and its change [ISO 8100-32, typical]
DOORS_S = 3.0  # before and after a ride
CLIMBING_M_S = 0.08  # faster than on any ramp
STEADY, LOADED = 0.85, 0.1  # effort, phase: when the hip is so low that the knee is all but straight
LEG_SMOOTH_MS = 41  # soft tissue low-pass filters the motion of a sensor on it
ANKLE = np.array([-0.06, 0.0, 0.0])  # from the sensor on the instep, foot frame (m)


@dataclass(frozen=True, slots=True)
class Manner:
    """A manner of moving: strides of a length and a time, and the body's direction relative to the way."""

    name: str
    stride_m: float
    stride_s: float
    facing_rad: float = 0.0


@dataclass(frozen=True, slots=True)
class Person:
    """Stride length and time with their spread, and how far corners are cut; typical of adults at 1.2 m/s [Perry 1992; Winter 2009].

    `manners`: of the level pieces of the way from one stop to the next, in turn; without any, and on stairs, the person walks.
    """

    stride_m: float = 1.3
    stride_s: float = 1.1
    stride_sd: float = 0.03
    corner_m: float = 0.6
    stand_s: float = 3.0
    foot: FootPath = field(default_factory=FootPath)
    leg: LegDimensions = field(default_factory=LegDimensions)
    manners: tuple[Manner, ...] = ()


@dataclass(frozen=True, slots=True)
class Walk:
    """Arrays of n milliseconds. `trunk_m` (n, 2), `heading_rad` (n,), `height_m` (n,) of the floor below it; `foot_m` (n, 3), `foot_rpy_rad` (n, 3)
    roll, pitch, yaw of the foot (x toe, y left, z up; pitch positive is toe down); `thigh_rad_s`, `calf_rad_s`, `belt_rad_s` (n,); `flat` (n,) the
    foot stands. `manners`: when a piece of the way begins, and how it is walked.
    """

    t_s: Floats
    trunk_m: Floats
    heading_rad: Floats
    foot_m: Floats
    foot_rpy_rad: Floats
    thigh_rad_s: Floats
    calf_rad_s: Floats
    belt_rad_s: Floats
    flat: Bools
    height_m: Floats
    manners: tuple[tuple[float, str], ...] = ()


def walk(waypoints: Sequence[Waypoint], person: Person, rng: np.random.Generator) -> Walk:
    """Rest, walk along the waypoints, rest again."""
    schedule = _Schedule(person, rng)
    for points, pause_s, height_m in _legs(waypoints):
        if len(points) > 1:
            schedule.walk(round_corners(points, person.corner_m))
        schedule.stand(pause_s)
        schedule.ride(height_m)
    schedule.stand(person.stand_s)
    return schedule.played()


def round_corners(points: Floats, radius_m: float) -> Floats:
    """The polyline (n, 2) or, with heights, (n, 3), each corner cut by a smooth curve, as points a centimetre apart."""
    pieces = [points[:1]]
    for before, corner, after in zip(points, points[1:], points[2:], strict=False):
        reach = min(radius_m, 0.5 * np.hypot(*(corner - before)[:2]), 0.5 * np.hypot(*(after - corner)[:2]))
        start = corner + (before - corner) * reach / np.hypot(*(before - corner)[:2])
        end = corner + (after - corner) * reach / np.hypot(*(after - corner)[:2])
        u = np.linspace(0.0, 1.0, 60)[:, None]
        pieces.append((1 - u) ** 2 * start + 2 * u * (1 - u) * corner + u**2 * end)
    corners = np.vstack([*pieces, points[-1:]])
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(corners[:, :2], axis=0).T))])  # m, seen from above
    even = np.linspace(0.0, along[-1], max(3, int(along[-1] / PATH_STEP_M)))
    return np.column_stack([np.interp(even, along, corners[:, k]) for k in range(points.shape[1])])


def _legs(waypoints: Sequence[Waypoint]) -> list[tuple[Floats, float, float]]:
    """Pieces (n, 3) of the path without a stop, the pause after each, and the height after the lift ride that follows."""
    points = [np.array([w[0], w[1], w[3] if len(w) == 4 else 0.0]) for w in waypoints]
    legs, begin = [], 0
    for k in range(1, len(points)):
        waypoint = waypoints[k]
        if _above(points[k - 1], points[k]):
            begin = k
            continue
        pause_s = waypoint[2] if len(waypoint) > 2 else 0.0
        last, rides = k + 1 == len(points), k + 1 < len(points) and _above(points[k], points[k + 1])
        if last or pause_s > 0.0 or rides or _turn(points[k - 1], points[k], points[k + 1]) > SHARP_RAD:
            legs.append((np.array(points[begin : k + 1]), pause_s, float(points[k + rides][2])))
            begin = k
    return legs


def _above(before: Floats, after: Floats) -> bool:
    """Whether one waypoint is right above the other: a lift."""
    return bool((before[:2] == after[:2]).all() and before[2] != after[2])


def _turn(before: Floats, corner: Floats, after: Floats) -> float:
    a, b = corner - before, after - corner
    return abs(math.atan2(a[0] * b[1] - a[1] * b[0], a @ b))


def _toil(points: Floats, stride_m: float) -> Floats:
    """The same, with stairs as much longer as strides are shorter there."""
    length, rise = np.hypot(*np.diff(points[:, :2], axis=0).T), np.abs(np.diff(points[:, 2]))
    return np.concatenate(
        [[0.0], np.cumsum(np.where(rise > STEEP * length, length * stride_m / STAIR_STRIDE_M, length))]
    )


class _Schedule:
    """Strides of the right foot from one mid-stance to the next: when, how far along which path, how much turned."""

    def __init__(self, person: Person, rng: np.random.Generator) -> None:
        self._person, self._rng = person, rng
        self._t = [0.0, person.stand_s]
        self._moves = [False]  # one for each interval between times
        self._trunk: list[Floats] = []
        self._heading: list[Floats] = []
        self._height: list[Floats] = []
        self._ms = 0
        self._walking = Manner("walk", person.stride_m, person.stride_s)
        self._manner, self._pieces = self._walking, 0
        self._manners: list[tuple[float, str]] = []

    def walk(self, path: Floats) -> None:
        """Walk a path (n, 3) from rest to rest; first turn on the spot to where it leads, or to where the body faces then."""
        self._manner = self._next_manner(path)
        along = _toil(path, self._manner.stride_m)
        course = np.unwrap(np.arctan2(*np.diff(path[:, :2], axis=0).T[::-1])) + self._manner.facing_rad
        self._turn_to(path[0], float(course[0]))
        self._manners.append((self._t[-1], self._manner.name))
        if self._heading:
            course += 2.0 * math.pi * round((self._heading[-1][-1] - course[0]) / (2.0 * math.pi))
        times, lengths = self._strides(float(along[-1]))
        t, s = self._t[-1] + times, lengths
        self._add_times(times[1:])
        progress = _hermite(self._grid(t[-1]), t, s)
        middle = 0.5 * (along[1:] + along[:-1])
        self._trunk.append(np.column_stack([np.interp(progress, along, path[:, k]) for k in (0, 1)]))
        self._height.append(np.interp(progress, along, path[:, 2]))
        self._heading.append(np.interp(progress, middle, course))

    def _next_manner(self, path: Floats) -> Manner:
        """How the next piece is walked: in turn, but stairs are always walked."""
        level = bool((np.abs(np.diff(path[:, 2])) <= STEEP * np.hypot(*np.diff(path[:, :2], axis=0).T)).all())
        if not self._person.manners or not level:
            return self._walking
        self._pieces += 1
        return self._person.manners[(self._pieces - 1) % len(self._person.manners)]

    def stand(self, pause_s: float) -> None:
        """Add a pause."""
        if pause_s > 0.0:
            self._t.append(self._t[-1] + pause_s)
            self._moves.append(False)
            self._hold(self._t[-1], self._trunk[-1][-1], self._heading[-1][-1:], float(self._height[-1][-1]))

    def ride(self, height_m: float) -> None:
        """Take the lift to a height, if it differs."""
        begin_m = float(self._height[-1][-1])
        if height_m == begin_m:
            return
        self.stand(DOORS_S)
        begin_s, rise = self._t[-1], height_m - begin_m
        self.stand(abs(rise) / LIFT_M_S + LIFT_M_S / LIFT_M_S2)
        ridden = _ridden(np.arange(len(self._height[-1])) / RATE_HZ, abs(rise))
        self._height[-1] = begin_m + math.copysign(1.0, rise) * ridden
        assert self._t[-1] > begin_s
        self.stand(DOORS_S)

    def played(self) -> Walk:
        """Trunk, foot, leg and belt of the whole schedule at 1 kHz."""
        trunk, heading = np.vstack(self._trunk), _smooth(np.concatenate(self._heading))
        height = np.concatenate(self._height)
        t = np.arange(len(heading)) / RATE_HZ
        strides = self._landings(trunk, heading, height)
        foot_m, rpy, flat = foot_path(t, strides, self._person.foot, height)
        phase, effort = strides.phase(t), _smooth(strides.effort(t, self._person.stride_m))
        above_floor = foot_m - height[:, None] * np.array([0.0, 0.0, 1.0])
        thigh, calf = self._leg(trunk, heading, above_floor, rpy, phase, effort, np.gradient(height) * RATE_HZ)
        left_m, twist = sway(phase, effort)
        worn = heading + twist
        trunk = trunk + left_m[:, None] * np.column_stack([-np.sin(heading), np.cos(heading)])
        return Walk(
            t, trunk, worn, foot_m, rpy, thigh, calf, np.gradient(worn) * RATE_HZ, flat, height, tuple(self._manners)
        )

    def _leg(
        self, trunk: Floats, heading: Floats, foot_m: Floats, rpy: Floats, phase: Floats, effort: Floats, climb_m_s: Floats,
    ) -> tuple[Floats, Floats]:  # fmt: skip
        """Rates of thigh and calf: they join the paths of hip and ankle, and on stairs follow people's curves there."""
        person, along = self._person, np.column_stack([np.cos(heading), np.sin(heading)])
        lever = rotations(rpy) @ ANKLE
        ankle = np.column_stack(
            [np.einsum("ni,ni->n", foot_m[:, :2] + lever[:, :2] - trunk, along), foot_m[:, 2] + lever[:, 2]]
        )
        ahead, low = hip_path(phase, effort, person.stride_m, person.leg)
        length = STRAIGHT * (person.leg.thigh_m + person.leg.shank_m)
        most = ankle[:, 1] + np.sqrt(np.maximum(length**2 - (ankle[:, 0] - ahead) ** 2, 0.01))
        upright = ankle[0, 1] + length - low
        lower = float(np.max((upright - most)[(effort > STEADY) & (phase < LOADED)], initial=0.0))
        high = np.minimum(upright - lower * np.minimum(effort, 1.0) ** 2, most)
        thigh, calf = leg_angles(ankle, np.column_stack([ahead, _smooth(high, LEG_SMOOTH_MS)]), person.leg)
        climbing = np.where(effort > 0.1, climb_m_s, 0.0)
        for up, there in ((True, climbing > CLIMBING_M_S), (False, climbing < -CLIMBING_M_S)):
            share = _smooth(there.astype(np.float64), SMOOTH_MS)
            on_stairs = stair_angles(phase, up)
            thigh, calf = (a + share * (b - a) for a, b in zip((thigh, calf), on_stairs, strict=True))
        return np.gradient(_smooth(thigh, LEG_SMOOTH_MS)) * RATE_HZ, np.gradient(_smooth(calf, LEG_SMOOTH_MS)) * RATE_HZ

    def _turn_to(self, at: Floats, course: float) -> None:
        """Turn on the spot, the short way, in several strides if needed."""
        if not self._heading:
            self._hold(self._t[-1], at[:2], np.array([course]), float(at[2]))
            return
        start = float(self._heading[-1][-1])
        turn = wrap(course - start)
        count = math.ceil(abs(turn) / TURN_STRIDE_RAD - 0.1)
        if count == 0:
            return
        begin = self._t[-1]
        self._add_times(np.cumsum(self._times(count)))
        share = np.clip((self._grid(self._t[-1]) - begin) / (self._t[-1] - begin), 0.0, 1.0)
        self._heading.append(start + turn * share**2 * (3.0 - 2.0 * share))
        self._trunk.append(np.tile(at[:2], (len(share), 1)))
        self._height.append(np.full(len(share), at[2]))

    def _strides(self, length_m: float) -> tuple[Floats, Floats]:
        """Times and lengths walked (k + 1,) from rest to rest; the first and the last stride are shorter."""
        count = max(2, round(length_m / self._manner.stride_m + 0.8))
        lengths = 1.0 + self._person.stride_sd * self._rng.standard_normal(count)
        lengths[[0, -1]] *= 0.6
        s = np.concatenate([[0.0], np.cumsum(lengths) * length_m / lengths.sum()])
        return np.concatenate([[0.0], np.cumsum(self._times(count))]), s

    def _times(self, count: int) -> Floats:
        return self._manner.stride_s * (1.0 + self._person.stride_sd * self._rng.standard_normal(count))

    def _add_times(self, after_s: Floats) -> None:
        self._t += (self._t[-1] + after_s).tolist()
        self._moves += [True] * len(after_s)

    def _grid(self, end_s: float) -> Floats:
        """The milliseconds from the end of the schedule up to a time."""
        first, self._ms = self._ms, max(self._ms, math.ceil(end_s * RATE_HZ))
        return np.arange(first, self._ms) / RATE_HZ

    def _hold(self, end_s: float, at: Floats, heading: Floats, height_m: float) -> None:
        n = len(self._grid(end_s))
        self._trunk.append(np.tile(at, (n, 1)))
        self._heading.append(np.repeat(heading, n))
        self._height.append(np.full(n, height_m))

    def _landings(self, trunk: Floats, heading: Floats, height: Floats) -> Strides:
        """Position of the resting foot at each time; while standing it stays where it landed."""
        t = np.array(self._t)
        at = np.minimum((t * RATE_HZ).astype(int), len(heading) - 1)
        landed = np.maximum.accumulate(np.where(np.concatenate([[True], self._moves]), np.arange(len(t)), 0))
        ground, at = height[at], at[landed]
        return Strides(t, np.array(self._moves), trunk[at], heading[at], ground)


def _ridden(t_s: Floats, way_m: float) -> Floats:
    """How far a lift has gone at times from its start (n,): even speed, smooth at both ends."""
    ramp_s, end_s = LIFT_M_S / LIFT_M_S2, way_m / LIFT_M_S + LIFT_M_S / LIFT_M_S2
    speed = np.clip(np.minimum(t_s, end_s - t_s) / ramp_s, 0.0, 1.0)
    speed = speed**2 * (3.0 - 2.0 * speed)
    gone = np.cumsum(speed)
    ridden_m: Floats = way_m * gone / gone[-1]
    return ridden_m


def _hermite(t: Floats, knots: Floats, values: Floats) -> Floats:
    """Cubic through the knots with mean slopes inside and slope zero at both ends, constant outside."""
    slopes = np.gradient(values, knots)
    slopes[0] = slopes[-1] = 0.0
    k = np.clip(np.searchsorted(knots, t, side="right") - 1, 0, len(knots) - 2)
    span = knots[k + 1] - knots[k]
    u = np.clip((t - knots[k]) / span, 0.0, 1.0)
    a, b = values[k], values[k + 1]
    cubic = a * (1 + 2 * u) * (1 - u) ** 2 + b * u**2 * (3 - 2 * u)
    interpolated: Floats = cubic + span * (slopes[k] * u * (1 - u) ** 2 - slopes[k + 1] * u**2 * (1 - u))
    return interpolated


def _smooth(values: Floats, width_ms: int = SMOOTH_MS) -> Floats:
    """Running mean, ends held."""
    padded = np.pad(values, width_ms // 2, mode="edge")
    total = np.concatenate([[0.0], np.cumsum(padded)])
    return (total[width_ms:] - total[:-width_ms]) / width_ms
