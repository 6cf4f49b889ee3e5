# SPDX-License-Identifier: MIT
"""The portable firmware on another board layer, a process of this computer: what a port to another chip is tested with."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from board_runs import ROOT
from echostep.board.messages import Schedule
from echostep_app.board.faults.health import Severity
from echostep_app.commissioning.diagnosis import Diagnosis
from echostep_app.commissioning.doctor import examine

pytestmark = [pytest.mark.process, pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")]
ABSENT = {"SPI bus", "barometer"}


@pytest.fixture(scope="module")
def port(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Of the process, built with the sanitizers."""
    folder = tmp_path_factory.mktemp("linux")
    command = ["make", "-C", str(ROOT / "firmware"), f"BUILD={folder}", "linux"]
    subprocess.run(command, check=True, capture_output=True)
    with subprocess.Popen([Path(folder, "echostep-linux")], stdout=subprocess.PIPE, text=True) as board:
        assert board.stdout
        yield board.stdout.readline().strip()
        assert board.poll() is None, "it has ended"
        board.kill()


def rates(report: Diagnosis) -> dict[str, float]:
    """Messages a second."""
    return {name: float(rate) for line in report.lines for name, rate in re.findall(r"(\w+) ([\d.]+)/s", line)}


def check(report: Diagnosis, most_hz: float) -> None:
    """What is there answers, no faster than its rate; what is not there is named, nothing is lost."""
    text = "\n".join(report.lines)
    assert "left ranger: answers, SRF02" in text
    assert "right ranger: answers, SRF02" in text
    assert "compass: answers, CMPS10" in text
    assert "frames    0 lost, 0 damaged" in text
    assert " ppm off this computer's" in text  # its clock is asked, and answers
    # A busy computer runs the process late, never early
    assert 0.2 * most_hz < rates(report)["ping"] < most_hz
    assert 10.0 < rates(report)["sync"] < 102.0
    assert 1.0 < rates(report)["compass"] < 11.0
    assert {f.subject for f in report.findings if f.severity == Severity.FAULT} == ABSENT


@pytest.mark.slow
def test_the_host_reads_it(port: str) -> None:
    check(examine(port, None, 3.0), 32.0)


@pytest.mark.slow
def test_it_obeys_after_it_was_closed_and_opened_again(port: str) -> None:
    check(examine(port, None, 3.0, schedule=Schedule.SEQUENTIAL), 16.0)
