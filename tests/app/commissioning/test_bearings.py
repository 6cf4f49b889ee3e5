# SPDX-License-Identifier: MIT
"""Headings of a magnetometer of three axes, as calibrate takes them."""

from __future__ import annotations

import numpy as np

from board.test_tilt_compass import shaken
from echostep.board import messages as m
from echostep.board.frames import BoardReader
from echostep_app.commissioning.fitting import headings
from echostep_app.commissioning.probe import ProbeResult


def test_calibrate_takes_the_headings_of_a_magnetometer() -> None:
    probed = ProbeResult()
    for message in BoardReader().feed(shaken(2, 1.1)):
        assert isinstance(message, m.Motion | m.Magnetic)
        probed.axes.append(message)
        probed.ticks.setdefault(type(message).__name__, []).append(message.ticks)
    t_s, found = headings(probed)
    assert len(t_s) == len(found) == 50
    assert np.degrees(np.abs(found[20:] - 1.1)).max() < 2.0
