# SPDX-License-Identifier: MIT
"""`echostep demo`: watched at a pace with the truth beside the estimate, ended in words, played again; fast where nobody watches; on any plan."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest

from board_runs import ELF, TWIN, needs_twin
from command_line import echostep, sha_of
from echostep.plan import Door, Plan, Room
from echostep.recording import open_recording
from echostep_app.guidance.tours import room_tour
from echostep_app.scorecard.track_columns import load_path
from echostep_app.session.runs import demo
from echostep_app.session.session import open_browser
from echostep_simulation.scenario import DEMO_WAYPOINTS, start_of
from echostep_simulation.world.tower import tower
from walks import DEMO


@pytest.fixture
def short_walk(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(demo, "DEMO_WAYPOINTS", DEMO_WAYPOINTS[:2])


@pytest.mark.long
@pytest.mark.usefixtures("short_walk")
def test_the_pace_changes_no_bit_and_the_summary_has_lines_of_its_own(tmp_path: Path) -> None:
    """With a page at 30 times real time, and as fast as it can: not on a terminal, it waits for no one."""
    fast = echostep("demo", "--headless", "--out", tmp_path / "a")
    paced = echostep("demo", "--speed", 30, "--port", 0, "--out", tmp_path / "b")
    assert (fast.returncode, paced.returncode) == (0, 0), fast.stderr + paced.stderr
    assert sha_of(fast.stdout) == sha_of(paced.stdout)
    for name in ("track.csv", "truth.csv"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()
    chunks = [list(open_recording(tmp_path / run / "walk.mcap").chunks()) for run in ("a", "b")]
    assert chunks[0] == chunks[1]
    lines = paced.stdout.splitlines()
    assert next(k for k, line in enumerate(lines) if "The page: http" in line) == 1, "the address comes first"
    again = re.fullmatch(
        r"No browser shows the page. To see the walk again: echostep (replay (\S+) --plan (\S+) --page)", lines[-1]
    )
    assert again, lines[-1]
    assert Path(again[2]).samefile(tmp_path / "b/walk.mcap")
    assert Path(again[3]).samefile(DEMO)
    assert "To see the walk again" not in fast.stdout  # nothing was to be seen
    for word in ("error: mean", "95 % ellipse:", "estimates: ", "files: "):
        assert [line for line in lines if line.startswith(word)], word


def test_a_browser_is_opened_only_where_there_is_a_screen(monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", lambda url: opened.append(url) is None)  # type: ignore[func-returns-value]
    monkeypatch.setattr("sys.platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "SSH_CONNECTION"):
        monkeypatch.delenv(name, raising=False)
    assert not open_browser("http://here/")
    monkeypatch.setenv("DISPLAY", ":0")
    assert open_browser("http://here/")
    monkeypatch.setenv("SSH_CONNECTION", "x")
    assert not open_browser("http://here/")
    assert opened == ["http://here/"]


def test_a_tour_visits_rooms_on_all_levels_that_stairs_reach() -> None:
    plan = with_rooms(tower(3))
    way = room_tour(plan)
    heights = {w[3] for w in way if len(w) > 3}
    assert {level.height_m for level in plan.levels} <= heights
    assert start_of(plan, way).level == 0


def with_rooms(plan: Plan) -> Plan:
    """Two rooms on each level, but for the middle one, which has only a door."""
    levels = [replace(level, rooms=(Room("a", (2.0, 1.5)), Room("b", (8.0, 1.5)))) for level in plan.levels]
    levels[1] = replace(levels[1], rooms=(), doors=(Door((8.0, 1.0, 8.0, 2.0)),))
    return replace(plan, levels=tuple(levels))


@pytest.mark.slow
def test_a_demo_on_another_plan_walks_through_its_rooms(tmp_path: Path) -> None:
    tree = json.loads(DEMO.read_text())
    tree["levels"][0]["rooms"] = [r for r in tree["levels"][0]["rooms"] if r["name"] in ("Office 1", "Store")]
    (tmp_path / "plan.json").write_text(json.dumps(tree))
    done = echostep("demo", "--headless", "--plan", tmp_path / "plan.json", "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    mean = re.search(r"error: mean ([\d.]+) m", done.stdout)
    assert mean
    assert float(mean[1]) < 0.5
    truth = load_path(tmp_path / "out/truth.csv", None).xy_m
    for x, y in ((3.6, 11.2), (6.3, 4.9)):
        assert min(abs(truth - [x, y]).sum(axis=1)) < 1.0
    assert open_recording(tmp_path / "out/walk.mcap").metadata["source"] == "simulated"
    tree["levels"][0]["rooms"] = []
    (tmp_path / "plan.json").write_text(json.dumps(tree))
    empty = echostep("demo", "--headless", "--plan", tmp_path / "plan.json", "--out", tmp_path / "out")
    assert (empty.returncode, empty.stderr.count("\n")) == (2, 1)
    assert "name some rooms" in empty.stderr


KIT_2026 = ("--kit", "2026", "--board-command", f"{TWIN} --elf {ELF}")


@pytest.mark.long
@needs_twin
def test_the_kit_of_2026_ends_within_the_figures_of_the_papers_kit(tmp_path: Path) -> None:
    """Through the real firmware: mean error at most 0.10 m, the ellipse holds the truth 93 to 100 % of the time; its recording is replayed alike."""
    done = echostep("demo", "--headless", *KIT_2026, "--out", tmp_path / "a")
    assert done.returncode == 0, done.stderr
    assert "parts of 2026, not built yet" in done.stdout
    mean = re.search(r"error: mean ([0-9.]+) m", done.stdout)
    share = re.search(r"holds the truth ([0-9]+) % of the time", done.stdout)
    assert mean, done.stdout
    assert share, done.stdout
    assert float(mean[1]) <= 0.10
    assert int(share[1]) >= 93
    again = echostep("replay", tmp_path / "a" / "walk.mcap", "--plan", DEMO, "--headless", "--out", tmp_path / "b")
    assert sha_of(again.stdout) == sha_of(done.stdout)


def test_the_python_board_does_not_play_the_kit_of_2026(tmp_path: Path) -> None:
    done = echostep("demo", "--headless", "--kit", "2026", "--out", tmp_path)
    assert done.returncode == 2
    assert "needs the real firmware in the simulator: make demo KIT=2026" in done.stderr
