# SPDX-License-Identifier: MIT
"""Results of a run: each sink gets every portion and the end; tables and summary are there before the picture; no server without a page."""

from __future__ import annotations

import gc
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from board_runs import ROOT
from command_line import echostep
from echostep.errors import EchostepError
from echostep.localization import Estimate
from echostep.ports.chunks import Portion, portion_of
from echostep.tracker import Tracker
from echostep_app.page.live import LivePage
from echostep_app.session import results
from echostep_app.session.options import OutputOptions
from echostep_app.session.runs import demo
from echostep_app.session.session import Session
from echostep_app.session.sinks import Sink, derived_sink
from echostep_simulation.scenario import DEMO_WAYPOINTS
from page.browser import demo_walk
from page.frames import PLAN, told
from waiting import PATIENCE_S

# What the results ask of a tracker
TRACKER: Any = SimpleNamespace(plan=PLAN, beacon_places=lambda _: [])


def test_track_and_summary_come_before_the_picture(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    seen: list[str] = []
    monkeypatch.setattr(
        results,
        "draw_track",
        lambda path, *_: seen.append((path.parent / "track.csv").read_text() + capsys.readouterr().out),
    )
    results.write_results(tmp_path, TRACKER, None, results.Result("walk", [told(t_s=1.0)]))
    assert seen[0].startswith("t_s,x_m")
    assert "estimates: 1" in seen[0]


def test_a_picture_that_cannot_be_written_is_one_error_after_the_summary(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "track.png").mkdir()
    with pytest.raises(EchostepError, match="cannot write the picture: Is a directory"):
        results.write_results(tmp_path, TRACKER, None, results.Result("walk", [told(t_s=1.0)]))
    assert "estimates: 1" in capsys.readouterr().out
    assert (tmp_path / "track.csv").exists()


def test_a_table_that_cannot_be_written_is_an_error_of_a_run_without_estimates_too(tmp_path: Path) -> None:
    (tmp_path / "track.csv").mkdir()
    with pytest.raises(EchostepError, match=r"track\.csv: cannot write the track: Is a directory"):
        results.write_results(tmp_path, TRACKER, None, results.Result("walk", []))


LISTED = "import atexit, sys; atexit.register(lambda: print(*sys.modules, file=sys.stderr)); from echostep.cli import main; main()"


@pytest.mark.process
@pytest.mark.parametrize(
    ("command", "unused"),
    [
        ("--help", "numpy numba rich pydantic scipy"),
        ("doctor", "matplotlib shapely mcap msgspec uvicorn scipy.linalg"),
        (f"replay {ROOT}/tests/captures/walk.mcap --headless --out .", "scipy.linalg echostep_app.page echostep_app.team echostep_app.mapping"),
    ],
)  # fmt: skip
def test_a_command_loads_nothing_that_it_does_not_use(command: str, unused: str, tmp_path: Path) -> None:
    words = [sys.executable, "-c", LISTED, *command.split()]
    told = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, timeout=PATIENCE_S, check=False).stderr
    assert {"echostep_app.cli", *unused.split()} & set(told.splitlines()[-1].split()) == {"echostep_app.cli"}


def alive() -> set[int]:
    gc.collect()
    return {id(o) for o in gc.get_objects() if type(o) in {Tracker, Session, LivePage}}


@pytest.mark.slow
def test_runs_in_one_process_leave_no_tracker_and_no_page_behind(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(demo, "DEMO_WAYPOINTS", DEMO_WAYPOINTS[:2])
    before = alive()
    for seed in (1, 2):
        echostep("demo", "--port", 0, "--seed", seed, "--out", tmp_path, "--no-open", ends=0)
    assert alive() <= before


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
