# SPDX-License-Identifier: MIT
"""What an earlier run left is damaged: the campaign, with a few files; that it sees what goes wrong; the journals of campaigns and studies."""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from unittest import mock

import pytest

from echostep.errors import EchostepError
from echostep.plan import load_plan
from echostep_app.commissioning.calibrate import write_sections
from echostep_app.page.editor import PlanFile
from echostep_studies.frame.runs import Journal
from reliability import left_behind
from reliability.campaign import CampaignJournal
from reliability.left_behind import CASES, OWN, PLAN, WAYS, run_again

DAMAGED = [b"", b"\0" * 40, b"\xff\x00[[[", b"[1]\n3\nnull\n", b'{"name": "a", "n": 1}\n{"name": "b", "n']


@dataclass(frozen=True, slots=True)
class Row:
    n: int


@pytest.mark.process
@pytest.mark.parametrize("way", [*WAYS])
@pytest.mark.parametrize("case", ["last place", "track"])
def test_a_run_goes_on_or_names_the_file(case: str, way: str) -> None:
    ended = run_again(CASES[case], WAYS[way])
    assert not ended.wrong, ended
    assert ("kept as last.json.damaged; the whole building" in ended.said) == (case == "last place")


@pytest.mark.process
def test_the_campaign_sees_what_goes_wrong() -> None:
    file, content, command, _ = CASES["plan"]
    assert run_again((file, content, command, OWN), WAYS["zeros"]).wrong == "does not go on"
    assert run_again(("a.json", b"1", "plan check no.json", ""), WAYS["half"]).wrong == "names another file"
    assert run_again((*CASES["track"][:3], ""), WAYS["zeros"]).wrong == "deleted what was there"


@pytest.mark.long
@pytest.mark.process
def test_the_whole_campaign(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["left_behind", "--out", str(tmp_path / "left.jsonl")])
    assert left_behind.main() == 0
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


def test_settings_that_cannot_be_written_whole_leave_those_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "s.toml"
    write_sections(out, {"gyro": {"thigh_bias_rad_s": 0.01}})
    before = out.read_text()
    monkeypatch.setattr("os.fsync", mock.Mock(side_effect=OSError(28, "No space left on device")))
    with pytest.raises(EchostepError, match=r"s\.toml: cannot write the settings: No space left"):
        write_sections(out, {"gyro": {"thigh_bias_rad_s": 0.02}})
    assert [path.read_text() for path in tmp_path.iterdir()] == [before]


def test_a_folder_in_the_place_of_the_plan_before_is_named(tmp_path: Path) -> None:
    path = tmp_path / "plan.json"
    path.write_bytes(PLAN.read_bytes())
    path.with_suffix(".json.bak").mkdir()
    with pytest.raises(EchostepError, match=r"plan\.json\.bak: cannot write the plan: Is a directory"):
        PlanFile(path).write(replace(load_plan(path), name="Other"))
    assert path.read_bytes() == PLAN.read_bytes()
