# SPDX-License-Identifier: MIT
"""The first seconds of the simulated demo walk, once for all tests that need a recording with steps in it."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from itertools import takewhile
from pathlib import Path

import numpy as np

from board_runs import ROOT
from echostep.localization import Estimate
from echostep.plan import load_plan
from echostep.ports.chunks import Chunk
from echostep_app.scorecard.card import Scorecard, score
from echostep_app.scorecard.track_columns import ScoredPath, track_of
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.scenario import Scenario, demo_scenario

DEMO = ROOT / "host/core/echostep/plans/demo.json"


@cache
def walk_chunks(seconds: float = 15.0) -> tuple[Chunk, ...]:
    """Chunks of both ports, Python board, seed 3."""
    scenario = demo_scenario(load_plan(DEMO), 3, PythonBoard(3))
    chunks = scenario.chunks()
    first = next(chunks)
    rest = takewhile(lambda chunk: chunk.t_arrival_ns - first.t_arrival_ns < seconds * 1e9, chunks)
    return (first, *rest)


def truth_of(scenario: Scenario) -> ScoredPath:
    """The trunk's true path."""
    t_s = scenario.walk.t_s
    return ScoredPath(Path("truth"), t_s, scenario.walk.trunk_m, np.zeros(len(t_s), bool), {})


def card_of(estimates: Sequence[Estimate], truth: ScoredPath) -> Scorecard:
    """Their scores."""
    return score(track_of(estimates), truth)
