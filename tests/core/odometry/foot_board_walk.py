# SPDX-License-Identifier: MIT
"""A walk through the demo building with two real firmwares, on belt and foot."""

from __future__ import annotations

from functools import cache
from itertools import takewhile
from typing import NamedTuple

import numpy as np

from board_runs import ELF, TWIN
from echostep.board.frames import encode
from echostep.board.reports import SUBSCRIBE
from echostep.ports.chunks import Chunk
from echostep_simulation.devices.board import BoardProcess
from echostep_simulation.devices.foot_board import HEAD_START_MS
from echostep_simulation.kits import Kit
from echostep_simulation.scenario import DEMO_WAYPOINTS, START_NS, Scenario
from walks import PLAN

SECONDS = 24.0


class Walk(NamedTuple):
    """A walk's chunks, its truth (n, 5), and the true times of the foot's samples (s of the walk)."""

    chunks: list[Chunk]
    truth: np.ndarray[tuple[int, int], np.dtype[np.float64]]
    sampled_s: np.ndarray[tuple[int], np.dtype[np.float64]]


@cache
def walk(faults: tuple[tuple[float, str], ...] = ()) -> Walk:
    """The demo's first seconds; `faults` of the foot board at times of the walk (s). A host asks it again after each."""
    belt, foot = (BoardProcess([str(TWIN), "--elf", str(ELF), "--seed", str(seed)]) for seed in (1, 2))
    scenario = Scenario(PLAN, DEMO_WAYPOINTS, 1, belt, kit=Kit.OF_2026, foot_board=foot)
    due, found = list(faults), []
    for chunk in takewhile(lambda c: c.t_arrival_ns < START_NS + SECONDS * 1e9, scenario.chunks()):
        while due and chunk.t_arrival_ns >= START_NS + due[0][0] * 1e9:
            text = due.pop(0)[1]
            foot.send(encode(SUBSCRIBE, 0)) if text == "ask" else foot.fault(text)
        found.append(chunk)
    scenario.close()
    sampled_s = np.array([t_ns * 1e-9 - 1e-3 * HEAD_START_MS for t_ns, text in foot.trace if text == "foot"])
    return Walk(found, scenario.truth, sampled_s)
