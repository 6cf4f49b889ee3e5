# SPDX-License-Identifier: MIT
"""The journal of a campaign: damaged rows are made anew."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import pytest

from reliability.campaign import CampaignJournal


@dataclass(frozen=True, slots=True)
class Row:
    n: int


@pytest.mark.parametrize(
    "left", [b"", b"\0" * 40, b"\xff\x00[[[", b"[1]\n3\nnull\n", b'{"name": "a", "n": 1}\n{"name": "b", "n']
)
def test_a_damaged_journal_is_put_aside_and_its_whole_rows_are_used(
    tmp_path: Path, left: bytes, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "runs.jsonl"
    path.write_bytes(left)
    rows = CampaignJournal(path).play("runs", {name: lambda: Row(1) for name in "ab"})
    assert [row["n"] for row in rows] == [1, 1]
    assert {json.loads(line)["name"] for line in path.read_text().splitlines()} == {"a", "b"}
    aside = tmp_path / "runs.jsonl.damaged"
    assert (aside.read_bytes() if left else b"") == left
    assert capfd.readouterr().err.count("is damaged") == bool(left)
