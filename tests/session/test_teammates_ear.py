# SPDX-License-Identifier: MIT
"""The teammates' ear: who can be met, from a real broker, and the meeting that a page tells."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import cast

import pytest

from echostep.page.live import LivePage
from echostep.plan.model import load_plan
from echostep.ports.chunks import BOARD, Chunk
from echostep.ports.meeting import MEETING, parse_meeting
from echostep.session import teammates_ear
from echostep.session.chunk_streams import with_meetings
from echostep.session.teammates_ear import TeammatesEar
from echostep.team import outbox
from echostep.team.endpoint import parse_outlet
from team.network import box_to
from team.team_broker import Broker, needs_broker
from team.team_reports import PLAN, POSITION, report
from waiting import PATIENCE_S, until


def arrival_ns(chunk: Chunk | None) -> int:
    return chunk.t_arrival_ns if chunk else 0


class Told:
    """A page on which these names were chosen."""

    def __init__(self, *names: str) -> None:
        self.names = list(names)

    def pop_meetings(self) -> list[str]:
        names, self.names = self.names, []
        return names


@needs_broker
def test_teammates_on_this_plan_can_be_met(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The wearer's own reports, those on another plan and those of another team are not among them."""
    monkeypatch.setattr(outbox, "FRESH_S", PATIENCE_S)
    monkeypatch.setattr(teammates_ear, "LOOK_S", 0.0)
    with Broker(tmp_path) as broker:
        outlet = parse_outlet([broker.url], "bo", "red")
        ear = TeammatesEar(outlet.endpoints[0], outlet, load_plan(PLAN), print)
        said: list[tuple[str, ...]] = []

        def hears(*names: str) -> bool:
            said.extend([news] if (news := ear.news()) is not None else [])
            return bool(said) and said[-1] == names

        boxes = {name: box_to(broker.url, name=name) for name in ("zoe", "bo", "eve", "anna")}
        boxes["zoe"].offer(report("zoe"))
        boxes["bo"].offer(report("bo"))
        boxes["eve"].offer(report("eve", plan_sha256="0" * 64))
        assert until(lambda: hears("zoe"))
        boxes["anna"].offer(report("anna", position=replace(POSITION, x_m=5.0)))
        assert until(lambda: hears("anna", "zoe"))
        page = Told("anna", "eve", "nobody", "bo")
        chunks = [*with_meetings([Chunk(BOARD, 7, b"")], cast("LivePage", page), ear, arrival_ns)]
        for box in boxes.values():
            box.close()
        ear.close()
    assert [(chunk.port, chunk.t_arrival_ns) for chunk in chunks if chunk] == [(BOARD, 7), (MEETING, 7)]
    met = parse_meeting(chunks[1].data if chunks[1] else b"")
    assert met is not None
    assert (met.name, met.x_m, met.level, met.range_m) == ("anna", 5.0, 0, None)
    assert met.age_s >= POSITION.age_s
