# SPDX-License-Identifier: MIT
"""Simulated walks there and back along the x axis of a corridor, recorded with a tap wherever the wearer stands."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from echostep.plan import Plan, Pose
from echostep.ports.chunks import Chunk
from echostep.ports.people.check_in import PERSON, CheckIn
from echostep.walk.recorded import SIMULATED
from echostep_app.session.metadata import run_metadata
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.people.walker import Walk
from echostep_simulation.scenario import START_NS, Scenario
from recording.damages import write_recording

STAND_S, NEAR_M = 2.0, 0.3  # at each place; within which the trunk stands there
SD_M = 0.3  # of a tap on the page


class Stand(NamedTuple):
    """At `t_s` of the walk the trunk was here."""

    t_s: float
    x_m: float
    y_m: float

    def tap(self, off_m: float = 0.0, heading_rad: float | None = None, level: int = 0) -> Chunk:
        """The tap, beside the true place along the x axis."""
        return said(self.t_s, CheckIn(self.x_m + off_m, self.y_m, heading_rad, SD_M, level).encode())


def said(t_s: float, message: bytes) -> Chunk:
    """What the wearer said on the page."""
    return Chunk(PERSON, START_NS + round(1e9 * t_s), message)


def walked(plan: Plan, xs_m: Sequence[float], y_m: float) -> tuple[tuple[Chunk, ...], tuple[Stand, ...]]:
    """The chunks of both ports, and where the wearer stood, along these places and back."""
    there_and_back = [*xs_m, *xs_m[-2::-1]]
    scenario = Scenario(plan, [(x_m, y_m, STAND_S) for x_m in there_and_back], 3, PythonBoard(3))
    return tuple(scenario.chunks()), tuple(_stands(scenario.walk, there_and_back))


def _stands(walk: Walk, xs_m: Sequence[float]) -> list[Stand]:
    """The middle of each stay."""
    stands, begin = [], 0
    for x_m in xs_m:
        away = np.abs(walk.trunk_m[:, 0] - x_m) > NEAR_M
        away[:begin] = True
        arrives = int((~away).argmax())
        leaves = arrives + int(away[arrives:].argmax() or len(away) - arrives)
        middle = (arrives + leaves) // 2
        stands.append(Stand(float(walk.t_s[middle]), *walk.trunk_m[middle].tolist()))
        begin = leaves
    return stands


def record(path: Path, plan: Plan, chunks: Sequence[Chunk], taps: Sequence[Chunk], start: Pose | None = None) -> Path:
    """A live run with these taps; without a start it waits for the first of them."""
    write_recording(
        path,
        sorted([*chunks, *taps], key=lambda chunk: chunk.t_arrival_ns),
        run_metadata(plan, start, 3, "live", source=SIMULATED),
    )
    return path


def along(plan: Plan) -> tuple[tuple[float, ...], float]:
    """Five places on the middle line of a corridor, the first and the last 1 m from its ends."""
    x, y = plan.levels[0].walls.reshape(-1, 2).T
    return tuple(np.linspace(x.min() + 1.0, x.max() - 1.0, 5).round(2).tolist()), 0.5 * float(y.min() + y.max())


def tapped(path: Path, plan: Plan) -> None:
    """A walk along the corridor of a plan, which begins at its start, with all taps but that one."""
    xs_m, y_m = along(plan)
    chunks, stands = walked(plan, xs_m, y_m)
    record(path, plan, chunks, [stand.tap() for stand in stands[1:]], Pose(xs_m[0], y_m, math.radians(0.0)))
