# SPDX-License-Identifier: MIT
"""The echo model follows the ranger that the board names, from ping to ping, live and in a replay."""

from __future__ import annotations

import numpy as np
import pytest

from board_runs import ROOT
from echostep.board import messages as m
from echostep.board.frames import encode
from echostep.echoes.likelihood import EchoSettings
from echostep.echoes.rangers import ECHO_OF, echo_of
from echostep.odometry import FrontEnd
from echostep.path import MeasuredSegment
from echostep.plan import load_plan
from echostep.ports.chunks import BOARD, Chunk, portion_of
from echostep.settings import Settings
from echostep.tracker import Tracker
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.scenario import DEMO_WAYPOINTS, Scenario

PULSE = ECHO_OF[m.Part.PULSE]
PLAN = load_plan(ROOT / "host/core/echostep/plans/demo.json")


def parts(part: m.Part) -> bytes:
    """A report that names this part on both sides."""
    none = dict.fromkeys(m.Parts._fields, 0)
    return encode(m.Parts(**none | {"part_ranger_left": part, "part_ranger_right": part}), 0)


def told(reports: dict[float, m.Part]) -> list[Chunk]:
    """A walk whose board names these rangers at these times (s)."""
    due, found = sorted(reports.items()), []
    for chunk in Scenario(PLAN, DEMO_WAYPOINTS[:2], 1, PythonBoard(1)).chunks():
        while due and chunk.t_arrival_ns >= (1.0 + due[0][0]) * 1e9:
            found.append(Chunk(BOARD, chunk.t_arrival_ns, parts(due.pop(0)[1])))
        found.append(chunk)
    return found


def echoes(chunks: list[Chunk], size: int, settings: Settings | None = None) -> list[EchoSettings]:
    """The echo settings after each estimate, in portions of `size` chunks."""
    tracker, found = Tracker(PLAN, seed=1, settings=settings), []
    tracker.watchers.append(lambda *_: found.append(tracker.filter.echo if tracker.filter else EchoSettings()))
    for k in range(0, len(chunks), size):
        tracker.take(portion_of(chunks[k : k + size]))
    return found


def test_settings_of_a_run_override_the_parts_field_by_field() -> None:
    assert echo_of(m.Part.NONE, EchoSettings()) == echo_of(m.Part.SRF02, EchoSettings()) == EchoSettings()
    assert echo_of(m.Part.PULSE, EchoSettings()) == PULSE
    chosen = echo_of(m.Part.PULSE, EchoSettings(sd_m=0.05))
    assert (chosen.sd_m, chosen.maximum_m) == (0.05, PULSE.maximum_m)
    assert echo_of(200, EchoSettings()) == EchoSettings()  # a part of the future


@pytest.mark.slow
def test_the_model_is_that_of_the_named_part_in_any_portions() -> None:
    chunks = told({1.0: m.Part.PULSE})
    whole = echoes(chunks, len(chunks))
    assert whole[-1] == PULSE
    assert echoes(chunks, 7) == whole
    assert echoes(chunks, len(chunks), Settings(echo=EchoSettings(hidden=0.3)))[-1].hidden == 0.3


def test_rangers_that_are_swapped_in_mid_walk_change_the_model() -> None:
    chunks = told({1.0: m.Part.PULSE, 5.0: m.Part.SRF02})
    found = echoes(chunks, 100)
    changes = [k for k in range(1, len(found)) if found[k] != found[k - 1]]
    assert found[-1] == EchoSettings()
    assert PULSE in found
    assert len(changes) <= 2


def test_each_ping_has_the_part_that_was_named_before_it() -> None:
    s = Settings()
    front_end = FrontEnd(s.mtx, s.ranger, s.foot, s.gait)
    pieces = front_end.process(portion_of(told({1.0: m.Part.PULSE, 5.0: m.Part.SRF02})))
    measured = [p for p in pieces if isinstance(p, MeasuredSegment)]
    named = [p.ranger_part for p in measured if len(p.t_s)]
    steps = [named[0], *(b for a, b in zip(named, named[1:], strict=False) if b != a)]
    assert steps in ([0, m.Part.PULSE, m.Part.SRF02], [m.Part.PULSE, m.Part.SRF02])
    assert all(np.isin(p.ranger, (0, 1)).all() for p in measured)
