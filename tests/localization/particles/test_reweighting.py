# SPDX-License-Identifier: MIT
"""The kernel that weighs particles by a ping, against the same formula written out."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from echostep.localization.echoes.likelihood import GATE_SD, EchoSettings, echo_model
from echostep.localization.particle_arrays import ParticleArrays
from echostep.localization.particles.kernels import WeightedPing, reweight_by_ping
from echostep.walls.echo_sources import Walls

MODEL = echo_model(EchoSettings())
WALL = Walls(np.array([[-20.0, 2.0, 20.0, 2.0]]))
SPAN_M = MODEL.maximum_m - MODEL.minimum_m


def written_out(distance_m: float, hidden: float, ping: WeightedPing) -> tuple[float, float]:
    """Likelihood of a ping of one wall straight ahead, and the probability that the view is hidden after it."""
    level_db = 20.0 * math.log10(6.0 / distance_m) + 2.6 * (6.0 - distance_m)
    heard = 1.0 / (1.0 + math.exp(-level_db / 2.0))
    if ping.range_m > 0.0:
        even, off = 0.8 / SPAN_M, abs(ping.range_m - distance_m) / 0.036
        normal = math.exp(-0.5 * off**2) / (0.036 * math.sqrt(2.0 * math.pi)) if off < GATE_SD else 0.0
        planned = heard * normal + (1.0 - heard) * 0.3 * 0.5 * (ping.alike + 1.0 / SPAN_M)
    else:
        even, planned = 0.2, 0.7 * (1.0 - heard)
    before = 0.15 + math.exp(-ping.travel_m / 0.6) * (hidden - 0.15)
    of_plan = 0.95 * (planned + ping.missed) ** ping.power + 0.05 * (even + ping.missed) ** ping.power
    likelihood = before * ping.unplanned + (1.0 - before) * of_plan
    return likelihood, before * ping.unplanned / likelihood


@given(
    st.lists(st.tuples(st.floats(-3.0, 1.5), st.floats(0.0, 1.0)), min_size=1, max_size=6),
    st.floats(0.2, 5.9) | st.just(0.0), st.floats(0.05, 1.0), st.floats(0.01, 3.0),
    st.floats(0.0, 8.0), st.floats(0.05, 3.0),
)  # fmt: skip
@settings(max_examples=60)
def test_the_kernel_is_the_formula(
    places: list[tuple[float, float]], range_m: float, power: float, travel_m: float, alike: float, unplanned: float
) -> None:
    missed = 0.02 if range_m == 0.0 else 0.0
    ping = WeightedPing(0.5 * math.pi, range_m, power, travel_m, missed, alike, unplanned)
    y_m, hidden = (np.array(column) for column in zip(*places, strict=True))
    zeros = np.zeros(len(y_m))
    particles = ParticleArrays(zeros.copy(), y_m.copy(), zeros.copy(), np.ones(len(y_m)), zeros.copy())
    expected = [written_out(2.0 - y, h, ping) for y, h in zip(y_m.tolist(), hidden.tolist(), strict=True)]
    log_evidence, _ = reweight_by_ping(particles, hidden, ping, MODEL, WALL.near(zeros, y_m))
    likelihood = np.array([each[0] for each in expected])
    assert log_evidence == pytest.approx(math.log(likelihood.mean()), abs=1e-6)
    assert particles.log_weight == pytest.approx(np.log(likelihood / likelihood.max()), abs=1e-6)
    assert hidden == pytest.approx([each[1] for each in expected], abs=1e-6)
