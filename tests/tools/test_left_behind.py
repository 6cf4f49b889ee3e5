# SPDX-License-Identifier: MIT
"""What an earlier run left is damaged: the campaign, with a few files; that it sees what goes wrong; the journals of campaigns and studies."""

from __future__ import annotations

import json
import os
import random
import subprocess
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from board_runs import ROOT
from echostep_app.team.wearer_plan import _kept
from echostep_studies.frame.runs import Journal
from reliability import left_behind
from reliability.campaign import CampaignJournal
from reliability.left_behind import CASES, damages, run_again

WAYS = damages(random.Random(1))
CAMPAIGN = [sys.executable, "-m", "reliability.left_behind"]
DAMAGED = [b"", b"\0" * 40, b"\xff\x00[[[", b"[1]\n3\nnull\n", b'{"name": "a", "n": 1}\n{"name": "b", "n']


@dataclass(frozen=True, slots=True)
class Row:
    n: int


@pytest.mark.parametrize("way", [*WAYS])
@pytest.mark.parametrize("case", ["last place", "track"])
def test_a_run_goes_on_or_names_the_file(case: str, way: str) -> None:
    ended = run_again(CASES[case], WAYS[way])
    assert not ended.wrong, ended
    assert ("kept as last.json.damaged; the whole building is searched" in ended.said) == (case == "last place")


def test_the_campaign_sees_what_goes_wrong(monkeypatch: pytest.MonkeyPatch) -> None:
    plan = CASES["plan"]

    def raising(*_: object, **__: object) -> None:
        raise KeyError("x")

    assert run_again(replace(plan, own=True), WAYS["zeros"]).wrong == "does not go on"
    assert run_again(replace(plan, file="other.json"), WAYS["zeros"]).wrong == ""
    assert (
        run_again(replace(plan, file="other.json", command=("plan", "check", "no.json")), WAYS["half"]).wrong
        == "names another file"
    )
    assert run_again(replace(CASES["track"], replaced=False), WAYS["zeros"]).wrong == "deleted what was there"
    monkeypatch.setattr(left_behind, "echostep", raising)
    assert run_again(plan, WAYS["half"]).wrong == "raised KeyError('x')"


@pytest.mark.long
@pytest.mark.process
def test_the_whole_campaign(tmp_path: Path) -> None:
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    command = [*CAMPAIGN, "--out", str(tmp_path / "left.jsonl")]
    run = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout + run.stderr
    assert len((tmp_path / "left.jsonl").read_text().splitlines()) == len(CASES) * len(WAYS)


@pytest.mark.parametrize("left", DAMAGED)
def test_a_damaged_journal_of_a_campaign_is_put_aside_and_its_whole_rows_are_used(
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


@pytest.mark.parametrize("left", [*DAMAGED, None], ids=str)
def test_a_damaged_journal_of_a_study_loses_only_what_is_damaged(tmp_path: Path, left: bytes | None) -> None:
    path = tmp_path / "runs.jsonl"
    if left is None:
        path.mkdir()
    else:
        path.write_bytes(left + b'\n{"seed": 3, "rows": [["Row", {"n": "no number"}]]}\n')
    journal = Journal(path, (Row,))
    assert not journal.runs
    journal.add(1, [Row(7)])
    assert Journal(path, (Row,)).runs == {1: [Row(7)]}


@pytest.mark.parametrize("left", [b"", b"{}", None], ids=str)
def test_a_teammates_drawing_that_a_power_failure_damaged_is_put_aside(tmp_path: Path, left: bytes | None) -> None:
    path = _kept(b"drawing", "anna", tmp_path)
    assert _kept(b"drawing", "anna", tmp_path) == path
    path.unlink()
    path.mkdir() if left is None else path.write_bytes(left)
    assert _kept(b"drawing", "anna", tmp_path).read_bytes() == b"drawing"
    aside = path.with_name(f"{path.name}.damaged")
    assert aside.is_dir() if left is None else aside.read_bytes() == left
