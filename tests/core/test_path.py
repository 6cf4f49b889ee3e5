# SPDX-License-Identifier: MIT
"""The path between two anchors: a curve that turns with the trunk, whichever way the trunk faces."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from echostep.particles.arrays import Move
from echostep.particles.kernels import piece_of
from echostep.path import BENT, MeasuredSegment, PathSegment

TURNS = st.floats(-2.0, 2.0)
FACING = st.floats(-3.0, 3.0)  # heading at the begin: forward, sideways, backward
SHARES = np.linspace(0.0, 1.0, 21)


def segment(turn_rad: float, facing_rad: float = 0.0) -> PathSegment:
    return PathSegment(2.0, 3.0, 0.6, 0.8, facing_rad, facing_rad + turn_rad, 0.01, 0.0, 1)


def on_circle(chord: complex, turn_rad: float) -> np.ndarray:
    """Places (n,) at SHARES on the arc of a circle from 0 to `chord` that turns by `turn_rad`."""
    if abs(turn_rad) < 1e-6:
        return SHARES * chord
    turned = np.exp(1j * turn_rad * SHARES) - 1.0
    return np.asarray(turned * chord / turned[-1])


@given(TURNS, FACING)
def test_the_way_lies_between_the_chord_and_the_arc_of_a_circle(turn_rad: float, facing_rad: float) -> None:
    x, y = segment(turn_rad, facing_rad).way_m(SHARES)
    chord = 0.6 + 0.8j
    between = SHARES * chord + BENT * (on_circle(chord, turn_rad) - SHARES * chord)
    assert np.abs(x + 1j * y - between).max() < 0.02


def test_a_left_turn_bends_the_way_to_the_right_of_the_chord() -> None:
    x, y = segment(math.radians(90.0)).way_m(0.5)
    right = (x * 0.8 - y * 0.6, x * 0.6 + y * 0.8)  # to the right of the chord, and along it
    assert right == pytest.approx((BENT * 0.5 * math.tan(math.radians(22.5)), 0.5))


@given(TURNS, FACING, st.floats(0.0, 0.95))
def test_a_part_of_the_way_leads_on_to_its_end(turn_rad: float, facing_rad: float, share: float) -> None:
    whole = segment(turn_rad, facing_rad)
    rest = MeasuredSegment(whole, np.zeros(0), np.zeros(0, np.int64), np.zeros(0)).after(2.0 + share).segment
    way = np.array(whole.way_m(share))
    assert way + [rest.dx_m, rest.dy_m] == pytest.approx([0.6, 0.8])
    middle = np.array(whole.way_m(0.5 * (1.0 + share)))
    assert way + np.array(rest.way_m(0.5)) == pytest.approx(middle, abs=0.04)


@given(TURNS, st.lists(st.floats(0.0, 1.0), max_size=5).map(sorted))
def test_the_pieces_of_a_move_are_the_way(turn_rad: float, shares: list[float]) -> None:
    s = segment(turn_rad)
    move = Move(s.dx_m, s.dy_m, 0.0, 0.0, 0.0, *s.bend_m)
    at = np.zeros(2)
    for begin, end in zip([0.0, *shares], [*shares, 1.0], strict=True):
        at += piece_of(move, begin, end)[:2]
        assert at == pytest.approx(s.way_m(end), abs=1e-12)
    assert at == pytest.approx([0.6, 0.8])
