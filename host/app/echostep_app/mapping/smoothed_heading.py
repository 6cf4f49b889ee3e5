# SPDX-License-Identifier: MIT
"""The foot's headings corrected by the belt's in hindsight: with the bias of the belt's gyro as the whole walk shows it.

In: `MeasuredSegment`s in order of time. Out: the same, turned. Owns nothing. Live the belt corrects the foot by the bias known then
[odometry.heading_fusion]; afterwards a smoother [Rauch, Tung, Striebel 1965] over the same filter gives the error of the foot at each stance. Where
the belt is not trusted the live headings stay.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats
from echostep.legs.trunk_path import rotated_segment
from echostep.odometry import FOOT, HeadingFilter
from echostep.path import BeltEvidence, MeasuredSegment, PathSegment, StanceHeadings

STILL_M = 0.01  # a segment without evidence that moves farther is of the legs: the foot's frame is a new one afterwards
ROUNDING = 1e-14  # rad2: a foot that has stood since the beginning has no error


class _Smoothed(NamedTuple):
    """Error of the foot's heading `error_rad` (n,) at `t_s` (n,), and the filter at the end."""

    t_s: Floats
    error_rad: Floats
    end: HeadingFilter


def with_smoothed_headings(segments: Sequence[MeasuredSegment]) -> list[MeasuredSegment]:
    """The segments with headings corrected in hindsight."""
    chain_of = _chains(segments)
    if not any(chain_of):
        return list(segments)
    smoothed = {key: _smooth(chain) for key, chain in {id(chain): chain for chain in chain_of if chain}.items()}
    corrected, live, error = [], 0.0, 0.0  # corrections of the foot's heading live, and in hindsight
    for measured, chain in zip(segments, chain_of, strict=True):
        s, belt, smooth = measured.segment, measured.segment.belt, smoothed.get(id(chain))
        if belt is None:
            turned = rotated_segment(s, live - error)
        else:
            grown = belt.correction_rad - live
            if smooth:
                begin, end = np.interp([s.t0_s, s.t1_s], smooth.t_s, smooth.error_rad).tolist()
                grown = end - begin
            turned = _turned(s, belt.correction_rad, live - error, error + 0.5 * grown, error + grown)
            turned = replace(turned, turn_sd_rad=_turn_sd(smooth, s, belt)) if smooth else turned
            live, error = belt.correction_rad, error + grown
        corrected.append(replace(measured, segment=turned))
    return corrected


def _chains(segments: Sequence[MeasuredSegment]) -> list[list[StanceHeadings]]:
    """For each segment the stances that one unbroken record of the belt joins to it, of the whole walk."""
    chain: list[StanceHeadings] = []
    chains = []
    for s in (measured.segment for measured in segments):
        if s.belt is None and (s.unobserved or math.hypot(s.dx_m, s.dy_m) > STILL_M):
            chain = []
        for stance in s.belt.stances if s.belt else ():
            if stance.begins:
                chain = []
            chain.append(stance)
        chains.append(chain)
    return chains


def _smooth(chain: list[StanceHeadings]) -> _Smoothed | None:
    """The smoothed error of the foot at the stances of a chain; None where the belt is not to be trusted."""
    known = HeadingFilter(chain[0])
    passed = [(known.state, known.P, known.state, known.P, np.eye(len(known.state)))]
    for stance in chain[1:]:
        transition = known.propagate(stance)
        predicted = known.state, known.P
        known.update(stance)
        passed.append((known.state, known.P, *predicted, transition))
    if not known.trusted:
        return None
    state, errors = known.state, [float(known.state[FOOT])]
    for (x, p, *_), (_, _, predicted_x, predicted_p, f) in zip(passed[-2::-1], passed[:0:-1], strict=True):
        gain = np.linalg.solve(predicted_p + ROUNDING * np.eye(len(x)), f @ p).T
        state = x + gain @ (state - predicted_x)
        errors.append(float(state[FOOT]))
    return _Smoothed(np.array([stance.t_s for stance in chain]), np.array(errors[::-1]), known)


def _turned(segment: PathSegment, live: float, begin: float, middle: float, end: float) -> PathSegment:
    """A segment corrected by `live`: now its way is corrected by `middle`, its last heading by `end`; its first heading turns by `begin`."""
    turned = rotated_segment(segment, live - middle)
    return replace(turned, heading0_rad=segment.heading0_rad + begin, heading1_rad=segment.heading1_rad + live - end)


def _turn_sd(found: _Smoothed, segment: PathSegment, belt: BeltEvidence) -> float:
    """Standard deviation of a turn by foot and belt."""
    foot, by_belt = belt.foot_turn_sd_rad**2, found.end.belt_variance(segment.t1_s - segment.t0_s)
    return math.sqrt(foot * by_belt / (foot + by_belt)) if foot > 0.0 else 0.0
