# SPDX-License-Identifier: MIT
"""Samples of a foot board that no foot can have made: wrong bits of a board with older firmware."""

from __future__ import annotations

from typing import cast

import numpy as np
import pytest

from echostep.board import messages as m
from echostep.board.calibration import foot_axes
from echostep.board.foot_board import FootBoardReader
from echostep.board.frames import encode

Sample = tuple[int, int, int, int, int, int]
STILL: Sample = (10, -20, 30, 100, -200, 1_024)


def fed(counts: list[Sample], size: int) -> tuple[list[tuple[float, ...]], FootBoardReader]:
    """The forces that a reader believes of these samples, in portions of this many."""
    reader = FootBoardReader()
    forces: list[list[float]] = []
    frames = [encode(m.Foot(8_889 * k, k, *sample), k) for k, sample in enumerate(counts)]
    for k in range(0, len(frames), size):
        forces += reader.feed(b"".join(frames[k : k + size])).accel.tolist()
    return [tuple(each) for each in forces], reader


@pytest.mark.parametrize("size", [1, 2, 100])
@pytest.mark.parametrize("wrong", [(0, 1 << 14), (1, -(1 << 15)), (5, 1 << 14), (3, 31_000)])
def test_a_wrong_bit_is_not_believed(wrong: tuple[int, int], size: int) -> None:
    counts = [STILL] * 20
    for k in (1, 8, 19):
        spike = [*STILL]
        spike[wrong[0]] ^= wrong[1]
        counts[k] = cast("Sample", tuple(spike))
    forces, reader = fed(counts, size)
    assert len(set(forces)) == 1
    assert (len(forces), reader.spikes, reader.lost) == (17, 3, 3)


@pytest.mark.parametrize("size", [1, 3, 100])
def test_what_goes_on_is_believed_from_its_second_sample_on(size: int) -> None:
    kicked: Sample = (15_000, -20, 30, 100, 20_000, 1_024)
    forces, reader = fed([STILL] * 10 + [kicked] * 10, size)
    assert (len(forces), reader.spikes) == (19, 1)
    _, expected = foot_axes(np.array([kicked], [(name, "i2") for name in m.Foot._fields[2:]]))
    assert forces[-1] == pytest.approx(tuple(expected[0]))
