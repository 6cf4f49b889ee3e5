# SPDX-License-Identifier: MIT
"""`[ranger] learn`: after a walk, what it tells of the rangers lies beside its recording; the values are those of `calibrate rangers`."""

from __future__ import annotations

import io
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console
from typer.testing import CliRunner

from commissioning.test_rangers import calibrated, pings_of, recorded
from echostep.plan import load_plan
from echostep.ports.chunks import BOARD, Chunk
from echostep.settings import Settings, parse_settings
from echostep_app.cli import app
from echostep_app.commands.actions import rangers as learning
from echostep_app.commands.actions.rangers import learn_rangers
from echostep_app.commissioning.rangers.poses import PosedPings
from echostep_app.session.metadata import run_metadata, start_recording
from echostep_app.session.options import TrackingOptions
from walks import DEMO

LEARN = "[ranger]\nlearn = true\n\n[foot]\nheight_m = 0.07\n"


def said(walk: Path, plan: Path | None = DEMO) -> str:
    """What is printed after a walk."""
    text = io.StringIO()
    learn_rangers(walk, TrackingOptions(plan), Console(file=text, width=1000))
    return text.getvalue()


def files(walk: Path) -> list[Path]:
    return list(walk.parent.glob("*-rangers.toml"))


@pytest.fixture(scope="module")
def walk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The demo walk, recorded by rangers that measure too much (simulated)."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("echostep_simulation.stimulus.ranger_bias_m", lambda *_: np.array([0.06, 0.02]))
        return recorded(tmp_path_factory.mktemp("walk"), LEARN)


def known(walk: Path, monkeypatch: pytest.MonkeyPatch, pings: PosedPings | BaseException) -> None:
    """From now on tracking a walk gives these pings, or ends by this."""

    def tracked(paths: list[Path], _: Any) -> Any:
        assert [path.name for path in paths] == [walk.name]
        if isinstance(pings, BaseException):
            raise pings
        return None, pings

    monkeypatch.setattr(learning, "tracked", tracked)


@pytest.mark.parametrize(("settings", "chunks"), [("[ranger]\nahead_deg = 5.0\n", 1), (LEARN, 0)])
def test_it_is_off_by_default_and_a_run_without_bytes_ends_as_ever(tmp_path: Path, settings: str, chunks: int) -> None:
    assert not Settings().ranger.learn
    fields = run_metadata(load_plan(DEMO), None, 1, "simulated", settings, source="simulated")
    with start_recording(tmp_path / "walk.mcap", fields) as recorder:
        for _ in range(chunks):
            recorder.write(Chunk(BOARD, 1, b"x"))
    assert said(Path(recorder.path)) == ""
    assert files(Path(recorder.path)) == []


@pytest.mark.long
def test_a_walk_leaves_what_calibrate_rangers_finds_in_it(walk: Path) -> None:
    words = said(walk)
    (out,) = files(walk)
    learned = parse_settings(out.read_text(), str(out))
    by_command = parse_settings(calibrated(walk), "command")
    assert learned.echo == by_command.echo
    assert learned.ranger.left_bias_m == by_command.ranger.left_bias_m == pytest.approx(0.06, abs=0.025)
    assert learned.ranger.right_bias_m == by_command.ranger.right_bias_m
    assert learned.ranger.learn
    assert learned.foot.height_m == 0.07
    assert out.name == f"{walk.stem}-rangers.toml"
    assert "# left: measures too much by" in out.read_text()
    assert " +- " in out.read_text()
    assert words.startswith("Rangers learned from this walk: maximum_m ")
    assert f"left_bias_m {learned.ranger.left_bias_m:.3g} (0)" in words
    assert words.count("\n") == 1
    first = out.read_bytes()
    said(walk)
    assert out.read_bytes() == first


def test_a_walk_that_was_doubted_or_is_without_plan_teaches_nothing(
    walk: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    alone = tmp_path / walk.name
    shutil.copy(walk, alone)
    assert "without a plan" in said(alone, None)
    _, pings = pings_of()
    known(alone, monkeypatch, pings._replace(believed=0.85))
    assert said(alone) == "Rangers: nothing was learned: the place was doubted for 15 % of the pings\n"
    known(alone, monkeypatch, KeyboardInterrupt())
    assert f"interrupted; echostep calibrate rangers {alone} --plan PLAN does it later" in said(alone)
    assert files(alone) == []


def test_a_plan_that_is_gone_ends_no_run(walk: Path, tmp_path: Path) -> None:
    assert said(walk, tmp_path / "gone.json").startswith("Rangers: nothing was learned: ")


def test_the_live_command_learns_when_its_run_is_over(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[tuple[Path, Path | None]] = []
    settings = tmp_path / "own.toml"
    settings.write_text(LEARN)
    monkeypatch.setattr("echostep_app.session.runs.live.live", lambda *_: tmp_path / "walk.mcap")
    monkeypatch.setattr(learning, "learn_rangers", lambda walk, tracking, _: seen.append((walk, tracking.plan_path)))
    given = ["live", "--plan", str(DEMO), "--board", "socket://localhost:1", "--no-page"]
    for more in ([], ["--settings", str(settings)]):
        done = CliRunner().invoke(app, [*given, *more])
        assert done.exit_code == 0, done.output
    assert seen == [(tmp_path / "walk.mcap", DEMO)]
