# SPDX-License-Identifier: MIT
"""Captured logs: the twin's own captures decode to their golden text, from Python and from the command line."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path

import pytest

import command_line
import echostep
from board_runs import ROOT
from echostep.errors import EchostepError
from echostep.recording import Decoder, as_json, read_capture

CAPTURES = ROOT / "tests/captures"
NAMES = ("board.bin", "mtx.bin", "walk.mcap")


@pytest.mark.parametrize("name", NAMES)
def test_a_capture_decodes_to_its_golden_text(name: str) -> None:
    golden = [json.loads(line) for line in (CAPTURES / name).with_suffix(".jsonl").read_text().splitlines()]
    found = [json.loads(json.dumps(as_json(message))) for message in echostep.read_capture(CAPTURES / name)]
    assert found == golden
    assert len(found) > 300


@pytest.mark.parametrize("name", NAMES)
def test_the_command_prints_the_same(name: str) -> None:
    done = command_line.echostep("decode", CAPTURES / name)
    assert done.stdout == (CAPTURES / name).with_suffix(".jsonl").read_text()


def test_the_missing_bytes_are_counted() -> None:
    decoder = Decoder()
    kinds = Counter(type(message).__name__ for message in read_capture(CAPTURES / "board.bin", decoder))
    counts = decoder.board.counts
    assert 1 <= counts.rejected <= 2
    assert 1 <= counts.lost <= 5
    assert {"Identity", "Configuration", "Ping", "Gyros", "Pressure", "Compass", "Sync", "Status", "GyroHealth"} == set(
        kinds
    )


def test_the_example_of_the_readme() -> None:
    ranges = [
        0.5 * 343.2e-6 * message.time_of_flight_us
        for message in echostep.read_capture(CAPTURES / "board.bin")
        if isinstance(message, echostep.messages.Ping) and message.outcome == echostep.messages.Outcome.ECHO
    ]
    assert all(0.1 < r < 6.1 for r in ranges)
    assert len(ranges) > 40


@pytest.mark.parametrize("content", [b"", b"hello world", bytes(1000), b"\x89MCAP0\r\n" + bytes(50)])
def test_what_is_no_capture_is_named(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "x.bin").write_bytes(content)
    with pytest.raises(EchostepError, match=r"x\.bin"):
        list(read_capture(tmp_path / "x.bin"))
