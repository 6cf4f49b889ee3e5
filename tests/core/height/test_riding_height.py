# SPDX-License-Identifier: MIT
"""The height by pressure at this moment: no delay in a lift, less noise than one median of half a second."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echostep.arrays import Floats
from echostep.height.height_filter import RidingHeight

SEGMENT_S, SAMPLES = 0.5, 5
NOISE_M = 0.25  # of an SCP1000 in its fast mode [SCP1000 data sheet]: 3 Pa
RIDE_M, SPEED_M_S, STARTING_M_S2 = 7.0, 1.0, 0.8  # a lift [ISO 8100-32, typical]


def ridden_m(t_s: Floats) -> Floats:
    """Height (n,) at times since a ride's beginning: faster, evenly, slower."""
    start_s = SPEED_M_S / STARTING_M_S2
    end_s = RIDE_M / SPEED_M_S + start_s
    t = np.clip(t_s, 0.0, end_s)
    early, late = np.minimum(t, start_s), np.maximum(t - (end_s - start_s), 0.0)
    height = 0.5 * STARTING_M_S2 * early**2 + SPEED_M_S * np.clip(t - start_s, 0.0, end_s - 2.0 * start_s)
    return np.asarray(height + SPEED_M_S * late - 0.5 * STARTING_M_S2 * late**2)


def errors_of_ride(seed: int) -> tuple[Floats, Floats]:
    """Of the filter and of the median, at the end of each half second from 3 s before a ride to 3 s after it."""
    rng, riding = np.random.default_rng(seed), RidingHeight(0.3)
    found, medians, true = [], [], []
    for k in range(30):
        t_s = -3.0 + SEGMENT_S * (k + np.arange(1, SAMPLES + 1) / SAMPLES)
        heights = 100.0 + ridden_m(t_s) + NOISE_M * rng.standard_normal(SAMPLES)
        riding.add(heights, SEGMENT_S)
        found.append(riding.height_m)
        medians.append(float(np.median(heights)))
        true.append(100.0 + float(ridden_m(t_s)[-1]))
    return np.array(found) - true, np.array(medians) - true


def test_a_ride_is_followed_without_delay() -> None:
    found, medians = (np.array(errors)[:, 8:20] for errors in zip(*(errors_of_ride(k) for k in range(40)), strict=True))
    assert abs(found.mean()) < 0.06
    assert abs(medians.mean()) > 0.15
    assert math.sqrt((found**2).mean()) < 0.17
    assert math.sqrt((medians**2).mean()) > 0.23


def test_another_barometer_begins_anew() -> None:
    riding = RidingHeight(0.3)
    assert math.isnan(riding.height_m)
    riding.add(np.full(5, 100.0), SEGMENT_S)
    riding.add(np.zeros(0), SEGMENT_S)
    assert riding.height_m == pytest.approx(100.0)
    riding.forget()
    riding.add(np.full(5, 3.0), SEGMENT_S)
    assert riding.height_m == pytest.approx(3.0)
