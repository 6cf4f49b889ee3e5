# SPDX-License-Identifier: MIT
"""The first seconds of the simulated demo walk, once for all tests that need a recording with steps in it; how good a track is."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from itertools import takewhile
from typing import NamedTuple

import numpy as np

from board_runs import ROOT
from echostep.arrays import Floats
from echostep.foot.steps import FootCounts, Step, Track
from echostep.localization import Estimate
from echostep.particles.ellipse import in_ellipse95
from echostep.plan import load_plan
from echostep.ports.chunks import Chunk
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.scenario import Scenario, demo_scenario

DEMO = ROOT / "host/core/echostep/plans/demo.json"
WALK = ROOT / "tests/captures/walk.mcap"
PLAN = load_plan(DEMO)


def foot_track() -> Track:
    """One step ahead."""
    t_s, ahead_m = np.arange(4.0), np.array([0.0, 0.0, 0.7, 0.7])
    step = Step(1.0, 2.0, (0.7, 0.0, 0.0), np.eye(3), 0.0, 0.0)
    position_m, stance = np.column_stack([ahead_m, 0 * ahead_m, 0 * ahead_m]), np.array([True, True, False, True])
    return Track(t_s, position_m, 0 * t_s, stance, [step], FootCounts(4, 0, 0, 0, 0, 0))


@cache
def walk_chunks(seconds: float = 15.0) -> tuple[Chunk, ...]:
    """Chunks of both ports, Python board, seed 3."""
    scenario = demo_scenario(PLAN, 3, PythonBoard(3))
    chunks = scenario.chunks()
    first = next(chunks)
    rest = takewhile(lambda chunk: chunk.t_arrival_ns - first.t_arrival_ns < seconds * 1e9, chunks)
    return (first, *rest)


class Errors(NamedTuple):
    """Of n estimates: distances (n,) from the trunk's true place, and the share whose 95 % ellipse holds it."""

    horizontal_m: Floats
    in_ellipse95: float


def errors_of(estimates: Sequence[Estimate], scenario: Scenario) -> Errors:
    """Those of the estimates within the time of the walk."""
    true_s, true_m = scenario.walk.t_s, scenario.walk.trunk_m
    within = [e for e in estimates if true_s[0] <= e.t_s <= true_s[-1]]
    t_s = [e.t_s for e in within]
    error_m = np.array([(e.x_m, e.y_m) for e in within]) - np.column_stack(
        [np.interp(t_s, true_s, axis) for axis in true_m.T]
    )
    covariance_m2 = np.array([(e.xx_m2, e.xy_m2, e.yy_m2) for e in within])
    return Errors(np.hypot(*error_m.T), float(in_ellipse95(error_m, covariance_m2).mean()))
