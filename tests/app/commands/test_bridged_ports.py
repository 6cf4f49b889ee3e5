# SPDX-License-Identifier: MIT
"""Both ports over a network: a live run tracks all of it, in blocks as large as the ports' own; a wearer who stands and fits everywhere."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from board_runs import ROOT, needs_twin
from bridges import bridged
from command_line import echostep, interrupt_after
from echostep.recording import open_recording
from echostep.xsens import PROJECT
from echostep_studies.simulation.devices.mtx_setup import MtxDevice
from players import walking_twin
from waiting import PATIENCE_S
from xsens.mt_lines import on_a_terminal

PLAN = ROOT / "host/core/echostep/plans/demo.json"
LEAST_BYTES = 12  # of a chunk on average: a message or two; single bytes took 10 s of a run of 25 s
pytestmark = [pytest.mark.twin, needs_twin]


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:set(Daemon|Name):DeprecationWarning")  # in pyserial
@pytest.mark.parametrize("scheme", ["socket", "rfc2217"])
def test_a_run_over_the_network_is_read_in_blocks_and_tracked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, scheme: str
) -> None:
    interrupt_after(10, monkeypatch)
    with (
        walking_twin(tmp_path) as (board_port, mtx_port),
        bridged(board_port, scheme) as board,
        bridged(mtx_port, scheme) as mtx,
    ):
        done = echostep(
            "live", "--plan", PLAN, "--board", board, "--mtx", mtx, "--headless", "--out", tmp_path, "--seconds", PATIENCE_S,
        )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "went away" not in done.stdout
    assert int(re.findall(r"estimates: (\d+)", done.stdout)[0]) >= 10
    chunks = [chunk for chunk in open_recording(tmp_path / "walk.mcap").chunks() if chunk.data]
    assert {chunk.port for chunk in chunks} == {"board", "mtx"}
    assert sum(len(chunk.data) for chunk in chunks) / len(chunks) > LEAST_BYTES


@pytest.mark.long
def test_a_wearer_who_stands_where_many_places_fit_is_named_in_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("echostep_app.xsens.setup.TIMEOUT_S", 10.0)  # the device shares this process
    interrupt_after(10, monkeypatch)
    with walking_twin(tmp_path, "--still") as (board, _), on_a_terminal(MtxDevice(PROJECT)) as mtx:
        done = echostep(
            "live", "--plan", PLAN, "--board", board, "--mtx", mtx, "--headless", "--start", "?", "--out", tmp_path,
            "--seconds", PATIENCE_S,
        )  # fmt: skip
    assert done.returncode == 0, done.stderr
    again = echostep("replay", tmp_path / "walk.mcap", "--plan", PLAN, "--headless", "--out", tmp_path / "again")
    for printed in (done.stdout, again.stdout):
        assert "end: place not known" in printed
        assert "corridor" not in printed.lower()
