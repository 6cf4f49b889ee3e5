"""A person who walks: trunk, right foot, thigh and calf, a thousand times a second.

In: waypoints on the plan, a seeded generator. Out: `Walk`: arrays at 1 kHz, map frame. Owns nothing.
The foot's path is built from smooth pieces, so that integrating what its sensors would feel gives the path back.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

RATE_HZ = 1000


@dataclass(frozen=True, slots=True)
class Person:
    """Stride length and time with their spread, and the right foot: its distance from the trunk's line, toe angle and clearance.

    Typical of adults at 1.2 m/s [Perry 1992; Winter 2009].
    """

    stride_m: float = 1.3
    stride_s: float = 1.1
    stride_sd: float = 0.03
    foot_left_m: float = -0.08
    toe_out_deg: float = 7.0
    clearance_m: float = 0.12
    flat_share: float = 0.4
    corner_m: float = 0.6
    stand_s: float = 3.0


@dataclass(frozen=True, slots=True)
class Walk:
    """Arrays of n milliseconds. `trunk_m` (n, 2), `heading_rad` (n,); `foot_m` (n, 3), `foot_rpy_rad` (n, 3) roll, pitch, yaw of the
    foot (x toe, y left, z up; pitch positive is toe down); `thigh_rad_s`, `calf_rad_s`, `belt_rad_s` (n,); `flat` (n,) the foot stands.
    """

    t_s: Floats
    trunk_m: Floats
    heading_rad: Floats
    foot_m: Floats
    foot_rpy_rad: Floats
    thigh_rad_s: Floats
    calf_rad_s: Floats
    belt_rad_s: Floats
    flat: NDArray[np.bool_]


def walk(waypoints: Sequence[tuple[float, float]], person: Person, rng: np.random.Generator) -> Walk:
    """Stand, walk along the waypoints with rounded corners, stand again."""
    path = round_corners(np.asarray(waypoints, float), person.corner_m)
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
    strides = _strides(float(along[-1]), person, rng)
    t = np.arange(int((strides.t_s[-1] + person.stand_s) * RATE_HZ)) / RATE_HZ
    progress = _hermite(t, strides.t_s, strides.s_m)
    trunk = np.column_stack([np.interp(progress, along, path[:, k]) for k in (0, 1)])
    course = _smooth(np.unwrap(np.arctan2(*np.diff(path, axis=0).T[::-1])), 9)
    heading = _smooth(np.interp(progress, 0.5 * (along[1:] + along[:-1]), course), 301)
    foot, rpy, flat = _foot(t, strides, trunk, heading, person)
    thigh, calf = _leg_rates(t, strides)
    belt = np.gradient(heading, 1.0 / RATE_HZ)
    return Walk(t, trunk, heading, foot, rpy, thigh, calf, belt, flat)


def round_corners(points: Floats, radius_m: float) -> Floats:
    """The polyline (n, 2) with each corner cut by a smooth curve, as points a centimetre apart."""
    pieces = [points[:1]]
    for before, corner, after in zip(points, points[1:], points[2:], strict=False):
        reach = min(radius_m, 0.5 * np.hypot(*(corner - before)), 0.5 * np.hypot(*(after - corner)))
        start = corner + (before - corner) * reach / np.hypot(*(before - corner))
        end = corner + (after - corner) * reach / np.hypot(*(after - corner))
        u = np.linspace(0.0, 1.0, 60)[:, None]
        pieces.append((1 - u) ** 2 * start + 2 * u * (1 - u) * corner + u**2 * end)
    corners = np.vstack([*pieces, points[-1:]])
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))])
    even = np.linspace(0.0, along[-1], max(2, int(along[-1] / 0.01)))
    return np.column_stack([np.interp(even, along, corners[:, k]) for k in (0, 1)])


@dataclass(frozen=True, slots=True)
class _Strides:
    """Mid-stances of the right foot: when, and how far along the path."""

    t_s: Floats
    s_m: Floats


def _strides(length_m: float, person: Person, rng: np.random.Generator) -> _Strides:
    count = max(1, round(length_m / person.stride_m))
    lengths = 1.0 + person.stride_sd * rng.standard_normal(count)
    times = person.stride_s * (1.0 + person.stride_sd * rng.standard_normal(count))
    s = np.concatenate([[0.0], np.cumsum(lengths) * length_m / lengths.sum()])
    return _Strides(person.stand_s + np.concatenate([[0.0], np.cumsum(times)]), s)


def _hermite(t: Floats, knots: Floats, values: Floats) -> Floats:
    """Cubic through the knots with mean slopes inside and slope zero at both ends, constant outside."""
    slopes = np.gradient(values, knots)
    slopes[0] = slopes[-1] = 0.0
    k = np.clip(np.searchsorted(knots, t, side="right") - 1, 0, len(knots) - 2)
    span = knots[k + 1] - knots[k]
    u = np.clip((t - knots[k]) / span, 0.0, 1.0)
    a, b = values[k], values[k + 1]
    return (
        a * (1 + 2 * u) * (1 - u) ** 2
        + b * u**2 * (3 - 2 * u)
        + span * (slopes[k] * u * (1 - u) ** 2 - slopes[k + 1] * u**2 * (1 - u))
    )


def _smooth(values: Floats, width: int) -> Floats:
    """Running mean, ends held."""
    padded = np.pad(values, width // 2, mode="edge")
    return np.convolve(padded, np.full(width, 1.0 / width), mode="valid")[: len(values)]


def _foot(
    t: Floats, strides: _Strides, trunk: Floats, heading: Floats, person: Person
) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """Foot position (n, 3), roll pitch yaw (n, 3) and whether it is flat: still in stance, minimum-jerk in swing [Flash and Hogan 1985]."""
    at = np.clip((strides.t_s * RATE_HZ).astype(int), 0, len(t) - 1)
    yaw = heading[at] - math.radians(person.toe_out_deg)
    left = np.column_stack([-np.sin(heading[at]), np.cos(heading[at])])
    prints = trunk[at] + person.foot_left_m * left
    span = np.diff(strides.t_s)
    k = np.clip(np.searchsorted(strides.t_s, t, side="right") - 1, 0, len(span) - 1)
    half = 0.5 * person.flat_share
    u = np.clip(((t - strides.t_s[k]) / span[k] - half) / (1.0 - 2.0 * half), 0.0, 1.0)
    share = u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
    foot = np.zeros((len(t), 3))
    foot[:, :2] = prints[k] + share[:, None] * (prints[k + 1] - prints[k])
    foot[:, 2] = person.clearance_m * _bump(u, 0.0, 1.0)
    rpy = np.zeros((len(t), 3))
    rpy[:, 1] = math.radians(60.0) * _bump(u, 0.0, 0.55) - math.radians(22.0) * _bump(u, 0.55, 1.0)
    rpy[:, 2] = yaw[k] + share * (yaw[k + 1] - yaw[k])
    return foot, rpy, (u <= 0.0) | (u >= 1.0)


def _bump(u: Floats, start: float, end: float) -> Floats:
    """A smooth rise to 1 and back between two values of u, with two vanishing derivatives at either end."""
    v = np.clip((u - start) / (end - start), 0.0, 1.0)
    return 64.0 * v**3 * (1.0 - v) ** 3


def _leg_rates(t: Floats, strides: _Strides) -> tuple[Floats, Floats]:
    """Pitch rates of thigh and calf, forward positive.

    Hip between 30 degrees of flexion and 10 of extension; knee with its peaks of 18 degrees in loading (15 % of the cycle after
    heel strike) and 60 degrees in swing (72 %) [Perry 1992]. Heel strike is 30 % of a cycle before mid-stance.
    """
    count = np.arange(len(strides.t_s))
    phase = (np.interp(t, strides.t_s, count) + 0.3) % 1.0
    moving = _smooth(((t >= strides.t_s[0]) & (t <= strides.t_s[-1])).astype(float), 201)
    hip = np.radians(10.0 + 20.0 * np.cos(2 * np.pi * (phase - 0.9)))
    knee = np.radians(5.0 + 13.0 * _peak(phase, 0.15, 0.07) + 55.0 * _peak(phase, 0.72, 0.09))
    rate = float(RATE_HZ)
    return np.gradient(hip * moving) * rate, np.gradient((hip - knee) * moving) * rate


def _peak(phase: Floats, at: float, width: float) -> Floats:
    """A periodic bell of height 1."""
    distance = (phase - at + 0.5) % 1.0 - 0.5
    return np.exp(-0.5 * (distance / width) ** 2)
