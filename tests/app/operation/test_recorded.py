# SPDX-License-Identifier: MIT
"""A recorded operation: nothing is lost, any moment is shown again as it was, damaged and hostile files do no harm."""

from __future__ import annotations

import json
import random
from pathlib import Path
from typing import Any

import pytest

from board_runs import ROOT
from command_line import echostep
from echostep.errors import EchostepError
from echostep.recording import open_recording
from echostep_app.operation.operation import Operation, TableScene
from echostep_app.operation.recorded import tape
from echostep_app.operation.recorded.record import decode_record
from echostep_app.operation.recorded.tape import OperationTape, Reader, TapeHead
from echostep_app.recording.repair import contents, edit
from operation.teams import TOWER, Recording, Team, place, whole_team
from waiting import until
from walks import DEMO

CAPTURES = ROOT / "tests/captures"


def read(path: Path) -> tuple[Reader, OperationTape]:
    """A file, read to its end."""
    made = OperationTape(path, Operation(TOWER))
    *_, reader = made.read()
    return reader, made


def whole_recording(folder: Path) -> Path:
    team = Team()
    made = Recording(folder, team)
    whole_team(team)
    return made.close()


def seen(scene: TableScene) -> tuple[Any, ...]:
    """What is shown of a moment."""
    return [(row.id, row.name, row.state, row.words, row.notes) for row in scene.rows], scene.places, scene.marks


def histories(operation: Operation, now_s: float, numbers: range) -> list[list[str]]:
    return [[event.text for event in d.history] for n in numbers if (d := operation.details(n, now_s))]


@pytest.mark.parametrize("rewritten", [False, True])
def test_a_recorded_operation_is_shown_as_it_was(tmp_path: Path, *, rewritten: bool) -> None:
    team = Team()
    made = Recording(tmp_path, team)
    whole_team(team)
    team.put_bytes("echostep/red/Kim/estimate", b"hostile")
    team.pass_time(2.2)
    path = made.close()
    assert contents.info(path)[-1] == "  whole"
    if rewritten:
        edit.repair(path, path := tmp_path / "rewritten.mcap")
    reader, _ = read(path)
    reader.advance(team.now_s)
    live, again = team.scene(), reader.scene()
    assert seen(again) == seen(live)
    assert (again.refused, again.connected) == (live.refused, True)
    assert abs(again.unix_s - live.unix_s) < 1e-3
    assert histories(reader.operation, team.now_s, range(1, 9)) == histories(team.operation, team.now_s, range(1, 9))
    assert reader.operation.roster.received == team.operation.roster.received


@pytest.mark.parametrize("being_written", [False, True])
def test_any_moment_is_shown_as_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, *, being_written: bool) -> None:
    monkeypatch.setattr(tape, "KEYFRAME_S", 5.0)
    monkeypatch.setattr("echostep.recording.message_runs.PORTION_BYTES", 1 << 12)  # it is read in many portions
    team = Team()
    made = Recording(tmp_path, team)
    moments: list[tuple[float, tuple[Any, ...]]] = []
    for _ in range(4):
        whole_team(team)
        team.pass_time(0.2)
        moments.append((team.now_s, seen(team.operation.copy().scene(team.now_s, team.unix_s))))
        team.pass_time(7.0)
    if not being_written:
        made.close()
    assert until(made.on_disk)
    kept = read(made.file.path)[1]
    assert len(kept._keyframes) > 4
    head = TapeHead(kept)
    for t_s, was in [moments[2], moments[0], moments[3], moments[1]]:
        assert seen(head.at(t_s)[1]) == was
    assert head.at(moments[1][0]) == head.at(moments[1][0])  # the same scene
    made.close()


def test_rejected_messages_are_counted_and_do_not_fill_the_disk(tmp_path: Path) -> None:
    team = Team()
    made = Recording(tmp_path, team)
    team.hear("Kim", place(TOWER, 1.0, 2.0, 0))
    before = made.file.offset
    for k in range(500):
        team.put_bytes(f"echostep/red/x{k}/estimate", bytes(8000))
    team.pass_time(2.0)
    assert made.file.offset - before < 1000
    reader, _ = read(made.close())
    assert "500 x" in reader.scene().refused


def test_a_file_cut_off_anywhere_shows_what_came_before(tmp_path: Path) -> None:
    whole = whole_recording(tmp_path).read_bytes()
    rng = random.Random(3)
    for k in range(6):
        path = tmp_path / f"cut{k}.mcap"
        path.write_bytes(whole[: rng.randrange(len(whole) // 3, len(whole))])
        reader, _ = read(path)
        assert 0 < len(reader.scene().rows) <= 8
        assert reader.file.own_damage.truncated


@pytest.mark.slow
def test_damaged_bytes_end_in_no_other_error(tmp_path: Path) -> None:
    whole = whole_recording(tmp_path).read_bytes()
    rng = random.Random(4)
    for k in range(20):
        damaged = bytearray(whole)
        for _ in range(20):
            damaged[rng.randrange(len(whole))] = rng.randrange(256)
        path = tmp_path / f"damaged{k}.mcap"
        path.write_bytes(damaged)
        try:
            open_recording(path)
        except EchostepError:
            continue
        for reader in OperationTape(path, Operation(TOWER)).read():
            assert len(reader.operation.roster.keys) <= 256


@pytest.mark.parametrize("data", [b"", b"\x91", b"\x95\xa5heard", b"\xdd\xff\xff\xff\xff", bytes(20_000)])
def test_what_is_no_record_is_none(data: bytes) -> None:
    assert decode_record(data) is None


def test_the_command_shows_a_recorded_operation_and_names_what_is_none(tmp_path: Path) -> None:
    path = whole_recording(tmp_path)
    run = echostep("command", path, "--plan", DEMO, "--no-page", "--json")
    assert {m["name"] for m in json.loads(run.stdout)["members"]} >= {"Kim", "Finn"}
    assert "another plan" in run.stderr
    junk = tmp_path / "junk.mcap"
    junk.write_bytes(b"junk")
    for wrong, why in ((junk, "no recorded bytes"), (CAPTURES / "walk.mcap", "no recorded operation")):
        failed = echostep("command", wrong, "--plan", DEMO, "--no-page")
        assert (failed.returncode, why in failed.stderr) == (2, True)
