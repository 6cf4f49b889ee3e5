# SPDX-License-Identifier: MIT
"""Disturbances of a walk's echoes: people in front of walls, silence, one ranger alone, panes of glass that the plan lacks.

In: a `SimulatedWalk` and a seeded generator. Out: the same walk with other pings. Owns nothing. The path is the same in all of them.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from echostep.arrays import Floats
from echostep.path import MeasuredSegment
from echostep_studies.bench.sites import Site
from echostep_studies.bench.tours import clearance_m
from echostep_studies.bench.walks import SimulatedWalk

PASSING_S = 1.0  # mean time for which a person is beside a ranger
PERSON_M = (0.3, 3.0)  # distance of a person
LEFT, RIGHT = 0, 1
PANES, PANE_M, BESIDE_M = 8, (1.0, 2.0), (0.8, 1.8)  # number, lengths, distances from the way
PANE_CLEAR_M = 0.6  # of a pane from the way
PANE_TURN_RAD = math.radians(30.0)  # of a pane against the way

Change = Callable[[MeasuredSegment], Floats]  # segment -> its ranges


def with_people(walk: SimulatedWalk, share: float, rng: np.random.Generator) -> SimulatedWalk:
    """`share` of the time a person is beside each ranger, and answers unless a wall is nearer."""
    end_s = walk.segments[-1].segment.t1_s
    times = [_passing_times(end_s, share, rng) for _ in (LEFT, RIGHT)]

    def ranges(segment: MeasuredSegment) -> Floats:
        person_m = np.full(len(segment.t_s), np.inf)
        for ranger in (LEFT, RIGHT):
            begin_s, until_s, away_m = times[ranger].T
            k = np.searchsorted(begin_s, segment.t_s, side="right") - 1
            there = (segment.ranger == ranger) & (k >= 0) & (segment.t_s < until_s[k])
            person_m[there] = away_m[k[there]]
        nearest = np.fmin(segment.range_m, person_m)
        return np.where(np.isfinite(nearest), nearest, np.nan)

    return changed(walk, ranges)


def silenced(walk: SimulatedWalk, share: float, rng: np.random.Generator) -> SimulatedWalk:
    """`share` of the pings hear nothing."""
    return changed(walk, lambda s: np.where(rng.random(len(s.t_s)) < share, np.nan, s.range_m))


def one_ranger(walk: SimulatedWalk, ranger: int = LEFT) -> SimulatedWalk:
    """The pings of the other ranger are missing."""
    segments = []
    for s in walk.segments:
        own = s.ranger == ranger
        segments.append(replace(s, t_s=s.t_s[own], ranger=s.ranger[own], range_m=s.range_m[own]))
    return replace(walk, segments=tuple(segments))


def with_panes(site: Site, rng: np.random.Generator) -> Site:
    """The same walk in a building with panes of glass beside the way: smooth partitions and open leaves of doors, which the plan lacks."""
    way = np.array([w[:2] for w in site.waypoints])
    length = np.hypot(*np.diff(way, axis=0).T)
    panes: list[Floats] = []
    while len(panes) < PANES:
        k = int(rng.choice(len(length), p=length / length.sum()))
        along = (way[k + 1] - way[k]) / length[k]
        normal = np.array([-along[1], along[0]]) * rng.choice([-1.0, 1.0])
        middle = way[k] + rng.uniform(0.0, length[k]) * along + rng.uniform(*BESIDE_M) * normal
        turn, half = rng.uniform(-PANE_TURN_RAD, PANE_TURN_RAD), 0.5 * rng.uniform(*PANE_M)
        c, s = math.cos(turn), math.sin(turn)
        reach = half * np.array([c * along[0] - s * along[1], s * along[0] + c * along[1]])
        pane = np.concatenate([middle - reach, middle + reach])
        if _clear(pane, way):
            panes.append(pane)
    level = site.built.levels[0]
    glazed = replace(level, walls=np.vstack([level.walls, *panes]))
    return Site(replace(site.built, levels=(glazed,)), site.waypoints)


def _clear(pane: Floats, way: Floats) -> bool:
    """Whether a pane (4,) stays clear of a way (n, 2)."""
    pieces = np.hstack([way[:-1], way[1:]])
    points = pane[:2] + np.linspace(0.0, 1.0, 9)[:, None] * (pane[2:] - pane[:2])
    return all(clearance_m(x, y, pieces) > PANE_CLEAR_M for x, y in points.tolist())


def _passing_times(end_s: float, share: float, rng: np.random.Generator) -> Floats:
    """Rows of begin (s), end (s), distance (m) of people beside one ranger, in order of time; the first row is before the walk."""
    rows, t_s = [(-2.0, -1.0, 1.0)], 0.0
    while t_s < end_s:
        begin_s = t_s + rng.exponential(PASSING_S * (1.0 - share) / share)
        t_s = begin_s + rng.exponential(PASSING_S)
        rows.append((begin_s, t_s, rng.uniform(*PERSON_M)))
    return np.array(rows)


def changed(walk: SimulatedWalk, ranges: Change) -> SimulatedWalk:
    """The walk with the ranges that a change gives of each segment, in their order."""
    return replace(walk, segments=tuple(replace(s, range_m=ranges(s)) for s in walk.segments))
