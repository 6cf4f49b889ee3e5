# SPDX-License-Identifier: MIT
"""The real command beside the twin, which walks the protocol; Enter and the page tap in turn the points that the twin says it reached."""

from __future__ import annotations

import json
import re
import signal
import subprocess
from pathlib import Path

import pytest

from board_runs import needs_twin, tool
from command_line import PROGRAM, echostep
from page.frames import opened_url
from waiting import PATIENCE_S

TAPS = 17  # of two rounds by five points, and the first


@needs_twin
@pytest.mark.long
def test_the_twin_walks_the_protocol(tmp_path: Path) -> None:
    twin = subprocess.Popen([*tool("twin.acceptance_walk"), "8x2", "--rounds", "2"], stdout=subprocess.PIPE, text=True)
    live = None
    try:
        assert twin.stdout is not None
        board, mtx = (twin.stdout.readline().split()[1] for _ in range(2))
        command = ["acceptance", "--corridor", "8x2", "--rounds", "2", "--board", board, "--mtx", mtx, "--port", "0"]
        live = subprocess.Popen(
            [*PROGRAM, *command, "--out", tmp_path], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        assert live.stdin is not None
        assert live.stdout is not None
        url = next(line.split()[-1] for line in iter(live.stdout.readline, "") if line.startswith("The page:"))
        reached = (line for line in iter(twin.stdout.readline, "") if line.startswith("at point"))
        with opened_url(url) as page:
            assert '"title":"echostep acceptance' in page.recv(timeout=PATIENCE_S)
            for number in range(TAPS):
                next(reached)
                if number % 2:
                    page.send(json.dumps({"kind": "at_point", "number": number}))
                else:
                    live.stdin.write("\n")
                    live.stdin.flush()
        said, _ = live.communicate(timeout=PATIENCE_S)
    finally:
        for process in filter(None, (live, twin)):
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=PATIENCE_S)
    assert live.returncode == 0, said
    assert " m (simulated)" in said
    (made,) = tmp_path.glob("*.html")
    first = made.read_bytes()
    rows = {
        name: cells
        for name, *cells in re.findall(r'row">([^<]+)</th><td[^>]*>([^<]*)(?:</td><td[^>]*>([^<]*))?', first.decode())
    }
    assert rows["taps"][0] == f"{TAPS}, 0 taken back, 0 unusable"
    assert rows["firmware of the board"][0].startswith("1.")
    assert b"Simulated: no board was worn" in first
    if rows["steps of the host&#x27;s clock"][0] == "0":  # else the computer was too busy for a walk in real time
        assert float(rows["CE50 (CEP)"][1].removesuffix(" m")) < 0.3  # standing; points are 1.5 m apart
        assert float(rows["points"][0]) == TAPS
    recorded = made.with_suffix(".mcap").read_bytes()
    assert not [name for name in (board, mtx, str(tmp_path)) if name.encode() in recorded + first]
    echostep("acceptance", "--recording", made.with_suffix(".mcap"), ends=0)
    assert made.read_bytes() == first


@pytest.mark.parametrize(
    "given",
    [
        [],
        ["--corridor", "20x2", "--plan", "plan.json"],
        ["--plan", "plan.json"],
        ["--points", "points.csv"],
        ["--recording", "w.mcap", "--corridor", "20x2"],
    ],
)
def test_one_place_is_given(given: list[str]) -> None:
    done = echostep("acceptance", *given, ends=2)
    assert "give --corridor LENGTHxWIDTH, or --plan FILE with --points FILE, or --recording FILE" in done.stderr
