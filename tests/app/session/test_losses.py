# SPDX-License-Identifier: MIT
"""The last lines of a run say how much was lost and why, and where it ended; a start that cannot be is refused.

Since when nothing came, from which port, and how much of what was worn has estimates.
"""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from typer.testing import CliRunner

from echostep.localization import Estimate, TrackStatus
from echostep.plan import Pose
from echostep.ports.chunks import BOARD, FOOT, MTX, Chunk, portion_of
from echostep_app.cli import app
from echostep_app.session import losses
from echostep_app.session.losses import Arrivals, Losses
from echostep_app.session.metadata import run_metadata
from page.frames import told
from recording.damages import write_recording
from walks import DEMO, PLAN, walk_chunks


class Run:
    """A tracker of which only what the losses look at is played."""

    def __init__(self) -> None:
        self.state = SimpleNamespace(check_ins=0, undone=0, right=0.999)
        self.plan = SimpleNamespace(is_drawn=True)
        self.watchers: list[Any] = []
        self.losses = Losses(self)  # type: ignore[arg-type]
        self.t_s = 0.0

    def go(self, seconds: int, status: TrackStatus, *, silent: bool = False, echoes: bool = True) -> None:
        for _ in range(seconds):
            self.t_s += 1.0
            e: Estimate = told(t_s=self.t_s, status=status)
            measured: Any = SimpleNamespace(t_s=[self.t_s] if echoes else [])
            self.watchers[0](None if silent else measured, e)


def test_a_walk_that_was_never_lost() -> None:
    run = Run()
    assert run.losses.describe() == ""
    run.go(31, TrackStatus.TRACKING)
    assert run.losses.describe() == "never lost in 30 s"


def test_each_reason_with_its_time() -> None:
    run = Run()
    run.go(11, TrackStatus.TRACKING)
    run.go(4, TrackStatus.LOST, silent=True)
    run.go(2, TrackStatus.UNCERTAIN)
    run.state.check_ins = 1
    run.go(1, TrackStatus.TRACKING)
    run.state.right = 0.01
    run.go(9, TrackStatus.LOST)
    run.state.undone, run.state.right = 1, 0.999
    run.go(3, TrackStatus.TRACKING)
    run.go(8, TrackStatus.UNCERTAIN, echoes=False)
    assert run.losses.describe() == (
        "lost for 13 s of 37 s, uncertain for 10 s: the echoes did not fit the plan after the position was set by hand at 18 s (9 s), "
        "several places fitted (7 s), nothing came from the foot (4 s), there were no echoes (3 s); position set by hand once, 1 of them undone"
    )


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("walk") / "walk.mcap"
    write_recording(path, walk_chunks(), run_metadata(PLAN, Pose(2.0, 7.5, 0.0), 1, "test"))
    return path


def replayed(recording: Path, out: Path, *more: str) -> tuple[int, str]:
    command = ["replay", str(recording), "--plan", str(DEMO), "--headless", "--out", str(out), *more]
    done = CliRunner().invoke(app, command)
    return done.exit_code, done.output + str(done.exception or "")


@pytest.mark.slow
def test_a_replay_says_how_it_went_and_where_it_ended(recording: Path, tmp_path: Path) -> None:
    code, said = replayed(recording, tmp_path)
    assert code == 0, said
    lines = said.splitlines()
    assert any(line.startswith("walk: never lost in 1") for line in lines), said
    assert "end: in Office 2" in lines or "end: in North corridor" in lines, said


S = 1_000_000_000


def heard(**until_s: int) -> Arrivals:
    """One chunk a second of each port, from 100 s of the host's clock on, for so many seconds."""
    made = Arrivals()
    chunks = [Chunk(port, (100 + k) * S, b"x") for port, seconds in until_s.items() for k in range(seconds)]
    made.note(portion_of(sorted(chunks, key=lambda chunk: chunk.t_arrival_ns)))
    return made


def test_a_port_that_fell_silent_is_named_with_its_time(monkeypatch: pytest.MonkeyPatch) -> None:
    made = heard(**{BOARD: 60, FOOT: 20})
    assert made.silent() == ["nothing came from the foot board since 19 s, for the last 40 s"]
    made.urls = {BOARD: "/dev/ttyACM0", FOOT: "/dev/ttyACM1"}
    monkeypatch.setattr(losses, "now_ns", lambda: 160 * S)
    assert made.silent() == ["nothing came from the foot board (/dev/ttyACM1) since 19 s, for the last 41 s"]
    assert made.worn_s == pytest.approx(60.0)


def test_a_port_that_never_sent_is_named_and_a_whole_run_has_no_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(losses, "now_ns", lambda: 160 * S)
    made = heard(**{BOARD: 60})
    made.urls = {BOARD: "a", MTX: "b"}
    assert made.silent() == ["nothing came from the MTx (b) at all"]
    assert heard(**{BOARD: 60, MTX: 60}).silent() == []
    assert (Arrivals().worn_s, Arrivals().silent()) == (0.0, [])


def test_what_was_worn_and_has_no_estimate_is_told() -> None:
    run = Run()
    run.go(20, TrackStatus.TRACKING)
    assert run.losses.describe(22.0) == "never lost in 19 s"
    assert run.losses.describe(60.0) == "never lost in 19 s; 41 s of the 60 s that were worn have no estimate"
