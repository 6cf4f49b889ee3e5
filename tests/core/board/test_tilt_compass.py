# SPDX-License-Identifier: MIT
"""Headings from a magnetometer of three axes and the belt's accelerometer."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from echostep.board import messages as m
from echostep.board.calibration import ImuSettings
from echostep.board.frames import BoardReader, encode
from echostep.board.tilt_compass import TiltCompass, heading_of

NORTH_AND_DOWN = np.array([0.0, 0.2, -0.45])  # gauss: east, north, up


def axes_of(heading: float, roll: float, pitch: float) -> np.ndarray:
    """Columns: x, y, z of a belt with this heading, tilted; map frame."""
    c, s = math.cos, math.sin
    yaw = np.array([[c(heading), -s(heading), 0], [s(heading), c(heading), 0], [0, 0, 1]])
    tilt_y = np.array([[c(pitch), 0, s(pitch)], [0, 1, 0], [-s(pitch), 0, c(pitch)]])
    tilt_x = np.array([[1, 0, 0], [0, c(roll), -s(roll)], [0, s(roll), c(roll)]])
    return yaw @ tilt_y @ tilt_x


@given(st.floats(-3.1, 3.1), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
def test_tilt_does_not_change_the_heading(heading: float, roll: float, pitch: float) -> None:
    r = axes_of(heading, roll, pitch)
    found = heading_of(r.T @ NORTH_AND_DOWN, r.T @ np.array([0.0, 0.0, 9.81]))
    assert math.cos(found - heading) == pytest.approx(1.0, abs=1e-9)


def test_an_upside_down_belt_has_the_same_heading() -> None:
    r = axes_of(0.7, math.pi, 0.1)
    assert heading_of(r.T @ NORTH_AND_DOWN, r.T @ np.array([0.0, 0.0, 9.81])) == pytest.approx(0.7)


def test_without_a_horizontal_field_there_is_no_heading() -> None:
    assert math.isnan(heading_of(np.array([0.0, 0.0, -1.0]), np.array([0.0, 0.0, 9.81])))


def motion(ticks: int, force: np.ndarray) -> m.Motion:
    return m.Motion(ticks, *([-32768] * 15), *np.rint(force / 9.81 * 4_098).astype(int).tolist())


def frames(forces: np.ndarray, r: np.ndarray) -> bytes:
    """Of a belt with these axes that measures forces (n, 3), 200 a second, and the field ten times a second."""
    sent = b""
    for k, force in enumerate(forces):
        sent += encode(motion(k * 10_000, force), 0)
        if k % 20 == 19:
            sent += encode(m.Magnetic(k * 10_000, *np.rint(6_842 * r.T @ NORTH_AND_DOWN).astype(int).tolist()), 0)
    return sent


def shaken(seed: int, heading: float) -> bytes:
    """Five seconds of a tilted belt that shakes at the step's frequency."""
    r, shake = axes_of(heading, 0.1, -0.2), 3.0 * np.sin(2.0 * math.pi * 1.8 * np.arange(1_000) / 200.0)
    forces = np.column_stack([shake, np.zeros(1_000), np.full(1_000, 9.81)]) @ r
    return frames(forces + 0.05 * np.random.default_rng(seed).standard_normal((1_000, 3)), r)


def test_the_steps_average_out_and_portions_change_no_bit() -> None:
    sent = shaken(1, 1.1)
    whole = TiltCompass().headings(BoardReader().frames(sent))[1]
    assert np.degrees(np.abs(whole[20:] - 1.1)).max() < 2.0
    reader, cut, parts = BoardReader(), TiltCompass(), []
    for begin in range(0, len(sent), 777):
        parts.append(cut.headings(reader.frames(sent[begin : begin + 777]))[1])
    assert np.array_equal(np.concatenate(parts), whole)


def test_a_saturated_or_missing_field_is_no_heading() -> None:
    sent = encode(m.Magnetic(0, 32_767, 0, 0), 0) + encode(m.Magnetic(0, -32768, 0, 0), 1)
    assert np.isnan(TiltCompass().headings(BoardReader().frames(sent))[1]).all()


def test_an_offset_of_the_belts_accelerometer_is_taken_out() -> None:
    """50 mg are three degrees of tilt, and five of heading where the field dips by 66 degrees."""
    offset, gain = np.array([0.4, -0.45, 0.2]), np.array([1.01, 0.99, 1.005])
    sent = frames(np.tile(gain * np.array([0.0, 0.0, 9.81]) + offset, (400, 1)), np.eye(3))
    errors = ImuSettings(*offset.tolist(), *(1.0 / gain).tolist())
    bare, corrected = (TiltCompass(e).headings(BoardReader().frames(sent))[1][-1] for e in (None, errors))
    assert abs(bare) > math.radians(4.0)
    assert abs(corrected) < math.radians(0.2)


def test_without_an_accelerometer_the_belt_counts_as_level() -> None:
    sent = encode(m.Magnetic(0, 0, 1_368, -2_736), 0)
    assert TiltCompass().headings(BoardReader().frames(sent))[1] == pytest.approx([0.0])
