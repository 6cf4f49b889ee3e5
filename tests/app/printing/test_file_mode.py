# SPDX-License-Identifier: MIT
"""Recordings and tracks are for their user alone; `--share` leaves them to the umask."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from board_runs import ROOT
from command_line import echostep
from echostep.file_mode import claim, share_files
from echostep.ports.chunks import Chunk
from echostep_app.recording.recorder import Recorder
from walks import walk_chunks

PLAN = ROOT / "host/core/echostep/plans/demo.json"


@pytest.fixture(autouse=True)
def _usual_umask() -> Iterator[None]:
    before = os.umask(0o022)
    yield
    os.umask(before)
    share_files(wanted=False)


def mode(path: Path) -> int:
    return path.stat().st_mode & 0o777


def test_a_new_file_is_private_and_one_that_exists_keeps_its_mode(tmp_path: Path) -> None:
    assert mode(claim(tmp_path / "track.csv")) == 0o600
    shared = tmp_path / "shared.csv"
    shared.write_text("old")
    assert mode(claim(shared)) == 0o644
    assert shared.read_text() == "old"


@pytest.mark.slow
@pytest.mark.parametrize(("option", "expected"), [([], 0o600), (["--share"], 0o644)])
def test_every_file_of_a_replay_and_of_an_export_has_the_mode(tmp_path: Path, option: list[str], expected: int) -> None:
    walk, out = tmp_path / "walk.mcap", tmp_path / "out"
    share_files(wanted=bool(option))
    with Recorder(walk, {"seed": "1"}) as recorder:
        for chunk in walk_chunks(8.0):
            recorder.write(chunk)
    assert mode(walk) == expected
    echostep(*option, "replay", walk, "--plan", PLAN, "--headless", "--out", out, ends=0)
    echostep(*option, "export", walk, "--plan", PLAN, "-o", out / "track.parquet", ends=0)
    echostep(*option, "cut", walk, "--to", 4, "-o", out / "cut.mcap", ends=0)
    modes = {path.name: mode(path) for path in out.iterdir()}
    assert modes == dict.fromkeys(("track.csv", "track.png", "track.parquet", "cut.mcap"), expected)


def test_share_is_of_one_command(tmp_path: Path) -> None:
    assert echostep("--share", "info", tmp_path / "none.mcap").returncode == 2
    with Recorder(tmp_path / "shared.mcap", {}) as recorder:
        recorder.write(Chunk("board", 1, b"x"))
    assert mode(tmp_path / "shared.mcap") == 0o644
    assert echostep("info", tmp_path / "shared.mcap").returncode == 0
    assert mode(claim(tmp_path / "private.csv")) == 0o600
