# SPDX-License-Identifier: MIT
"""`echostep bench-report`: what a board tells of itself in one file, and its measurements are those of firmware/bench.md."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from board_runs import ROOT, needs_twin
from command_line import echostep
from echostep.board import messages as m
from echostep_app.commissioning.bench_report import MEASUREMENTS, text
from echostep_app.commissioning.diagnosis import Diagnosis
from echostep_app.commissioning.probe import ProbeResult, probe
from players import twin_board


def test_the_measurements_are_those_of_the_page() -> None:
    page = (ROOT / "firmware/bench.md").read_text()
    assert re.findall(r"^## (\d+)\. (.*)$", page, flags=re.M) == [(str(n), t) for n, t in enumerate(MEASUREMENTS, 1)]
    assert [int(n) for n in re.findall(r"^\| .* \| (\d+) \|$", page, flags=re.M)] == list(range(1, 16))


def test_a_gyro_that_varies_at_rest_is_named() -> None:
    """One wrong byte in a thousand gave an sd of 89 counts, and no finding."""
    rng = np.random.default_rng(7)
    counts = rng.normal(0.0, 0.5, (400, 3)).round().astype(int)
    counts[::50, 2] += 700
    probed = ProbeResult(gyros=[m.Gyros(0, *map(int, row)) for row in counts])
    said = [line for line in text(Diagnosis(probed={"board": probed})) if "WARNING" in line]
    assert len(said) == 1
    assert "board: belt: the rates vary by more than 4 counts at rest" in said[0]


@pytest.mark.long
@needs_twin
@pytest.mark.process
def test_the_report_of_a_board(tmp_path: Path) -> None:
    out = tmp_path / "report.txt"
    with twin_board("kit=2026") as port:
        done = echostep("bench-report", "--board", port, "--seconds", 4, "--out", out, "--schedule", "simultaneous")
        after = probe({"board": port}, 3.0).reports.configuration
    assert done.returncode == 0, done.stderr
    assert after is not None
    assert after.schedule == m.Schedule.CONCURRENT  # as it was
    found = out.read_text()
    for words in (
        "schedule 2, ",
        "levels    MISO low, D4 high ",
        "Identity: ticks ",
        "Parts: ticks ",
        "Electrical: ticks ",
        "left: ",
        "median 1.001 m (5831 us)",
        "thigh: ",
        "15. Temperature of an ADIS16100: ",
    ):
        assert words in found, (words, found)
    assert str(out) in done.stdout


@pytest.mark.process
def test_without_a_board_there_is_one_clear_error(tmp_path: Path) -> None:
    done = echostep(
        "bench-report", "--board", "/dev/no-such-port", "--seconds", 3, "--out", tmp_path / "report.txt", ends=2
    )
    assert "there is no such port" in done.stderr
    assert "Traceback" not in done.stderr
