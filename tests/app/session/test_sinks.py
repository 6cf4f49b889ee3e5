# SPDX-License-Identifier: MIT
"""Sinks of a run: each gets every portion, after the tracker has taken it, and the end."""

from __future__ import annotations

from pathlib import Path

import pytest

from echostep.localization import Estimate
from echostep.ports.chunks import Portion, portion_of
from echostep.tracker import Tracker
from echostep_app.session.options import OutputOptions
from echostep_app.session.session import Session
from echostep_app.session.sinks import Sink, derived_sink
from page.browser import PLAN, demo_walk


class Heard:
    """What a sink is called with."""

    def __init__(self, tracker: Tracker) -> None:
        self.calls: list[str] = []
        self.estimates: list[Estimate] = []
        self._tracker = tracker

    def arrive(self) -> None:
        self.calls.append("arrive")

    def take(self, portion: Portion, estimates: list[Estimate]) -> None:
        assert not estimates or self._tracker.state.estimate == estimates[-1]
        self.calls.append(f"take {len(portion.t_arrival_ns)}")
        self.estimates += estimates

    def end(self, summary: str) -> None:
        self.calls.append(summary)


def test_a_sink_gets_every_portion_and_the_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    start, chunks = demo_walk(beacons=False)
    tracker = Tracker(PLAN, start, seed=1)
    session, sink = Session(tracker, "sinks", "live", OutputOptions(tmp_path, terminal=False)), Heard(tracker)
    monkeypatch.setattr(session, "_sinks", [Sink(sink.take, sink.arrive, sink.end)])
    with session:
        session.track([portion_of(chunks[:3000]), portion_of([]), portion_of(chunks[3000:6000])])
    assert sink.calls == ["arrive", "take 3000", "arrive", "take 0", "arrive", "take 3000"]
    assert sink.estimates == session.estimates
    assert len(sink.estimates) > 2
    session.finish("sinks")
    assert "positions" in sink.calls[-1]


def test_every_writer_gets_what_is_derived() -> None:
    start, chunks = demo_walk(beacons=False)
    tracker = Tracker(PLAN, start, seed=1)
    written: tuple[list[object], list[object]] = ([], [])
    sink, portion = derived_sink(tracker, [w.extend for w in written]), portion_of(chunks[:3000])
    sink.take(portion, tracker.take(portion))
    assert written[0] == written[1]
    assert written[0]
