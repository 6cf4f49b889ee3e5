# SPDX-License-Identifier: MIT
"""Where the rangers look: abeam, or ahead of it by `[ranger] ahead_deg`, from the board's bytes to the filter."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echostep.arrays import Floats
from echostep.board.calibration import RangerSettings
from echostep.echoes.likelihood import EchoSettings, echo_model
from echostep.echoes.unplanned import UsablePings
from echostep.errors import EchostepError
from echostep.foot.steps import FootSettings
from echostep.foot.trunk_path import GaitSettings
from echostep.localization import Building
from echostep.odometry import FrontEnd
from echostep.path import MeasuredSegment, PathSegment
from echostep.ports.chunks import Chunk, portion_of
from echostep.settings import parse_settings
from echostep.timing.timeline import MtxTiming
from echostep.walls.echo_sources import Walls
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.scenario import Scenario
from walks import PLAN

AHEAD_DEG, HEADING_RAD = 20.0, 0.7
# A ranger that looks ahead looks less far from the heading, on either side.
AXES_RAD = np.array([1.0, -1.0]) * math.radians(90.0 - AHEAD_DEG)
ROOM = Building(Walls(np.array([[0, 0, 30, 0], [30, 0, 30, 8], [30, 8, 0, 8], [0, 8, 0, 0]], float)), None)


def step() -> MeasuredSegment:
    """A step with a ping of each ranger."""
    segment = PathSegment(0.0, 1.0, 1.0, 0.0, HEADING_RAD, HEADING_RAD, sd_m=0.01, turn_sd_rad=0.001, step=1)
    return MeasuredSegment(
        segment, np.array([0.4, 0.6]), np.array([0, 1]), np.array([2.0, 3.0]), ahead_rad=math.radians(AHEAD_DEG)
    )


def pinged(ahead_deg: float) -> list[MeasuredSegment]:
    """The segments with pings that the front end makes of a short walk."""
    ours = FrontEnd(MtxTiming(), RangerSettings(ahead_deg=ahead_deg), FootSettings(), GaitSettings())
    chunks: list[Chunk] = list(Scenario(PLAN, ((2.0, 7.5), (5.0, 7.5)), 5, PythonBoard(5)).chunks())
    pieces = ours.process(portion_of(chunks))
    return [piece for piece in pieces if isinstance(piece, MeasuredSegment) and len(piece.t_s)]


def test_the_setting_reaches_every_segment() -> None:
    abeam, ahead = pinged(0.0), pinged(AHEAD_DEG)
    assert len(abeam) == len(ahead) > 5
    for a, b in zip(abeam, ahead, strict=True):
        sides: Floats = np.where(a.ranger == 0, 1.0, -1.0)
        assert a.off_heading_rad == pytest.approx(0.5 * math.pi * sides)
        assert b.off_heading_rad == pytest.approx(AXES_RAD[0] * sides)
        assert np.array_equal(a.range_m, b.range_m, equal_nan=True)


def test_the_filter_takes_the_axis() -> None:
    expected = pytest.approx(HEADING_RAD + AXES_RAD)
    echo = EchoSettings()
    assert UsablePings(ROOM.background(echo_model(echo)), echo).take(step())[0].axis_rad == expected


def test_the_rest_of_a_segment_looks_the_same_way() -> None:
    rest = step().after(0.5)
    assert rest.off_heading_rad == pytest.approx(AXES_RAD[1:])
    assert rest.range_m.tolist() == [3.0]


@pytest.mark.parametrize("ahead_deg", [-75.0, 90.0])
def test_rangers_that_look_along_the_way_are_refused(ahead_deg: float) -> None:
    with pytest.raises(EchostepError, match=r"me\.toml: .*ahead_deg: rangers look aside"):
        parse_settings(f"[ranger]\nahead_deg = {ahead_deg}\n", "me.toml")
