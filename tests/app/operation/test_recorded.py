# SPDX-License-Identifier: MIT
"""A recorded operation: nothing is lost, any moment is shown again as it was, damaged and hostile files do no harm."""

from __future__ import annotations

import json
import random
from pathlib import Path
from typing import Any

import msgspec
import pytest

from board_runs import ROOT
from command_line import echostep
from echostep.errors import EchostepError
from echostep.recording import open_recording
from echostep_app.operation import requests
from echostep_app.operation.operation import Operation, TableScene
from echostep_app.operation.recorded import tape
from echostep_app.operation.recorded.past import PastView
from echostep_app.operation.recorded.player import Player, load
from echostep_app.operation.recorded.record import Heard, decode_record
from echostep_app.operation.recorded.tape import Tape
from echostep_app.page.requests import Seek, SetPlaying, SetSpeed
from echostep_app.recording.repair import contents, edit
from operation.teams import TOWER, Recording, Team, place, whole_team
from team.team_reports import PLAN
from waiting import until

CAPTURES = ROOT / "tests/captures"


def played(path: Path) -> tuple[Player, Tape]:
    """A file, read to its end."""
    made = Tape(path, grows=False)
    *_, player = load(made, Operation(TOWER))
    return player, made


def look(view: PastView, clock_s: float) -> tuple[Operation, TableScene] | None:
    """What a page shows; None: now."""
    t_s = view.moment(clock_s)
    return None if t_s is None else view.at(t_s)


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
    player, _ = played(path)
    player.advance(team.now_s)
    live, again = team.scene(), player.scene()
    assert seen(again) == seen(live)
    assert (again.refused, again.connected) == (live.refused, True)
    assert abs(again.unix_s - live.unix_s) < 1e-3
    assert histories(player.operation, team.now_s, range(1, 9)) == histories(team.operation, team.now_s, range(1, 9))
    assert player.operation.roster.received == team.operation.roster.received


def test_any_moment_of_a_growing_recording_is_shown_as_it_was(tmp_path: Path) -> None:
    team = Team()
    made = Recording(tmp_path, team)
    moments: list[tuple[float, tuple[Any, ...]]] = []
    for _ in range(4):
        whole_team(team)
        team.pass_time(0.2)
        moments.append((team.now_s, seen(team.operation.copy().scene(team.now_s, team.unix_s))))
        team.pass_time(7.0)
    view = PastView(made.tape)
    assert look(view, 0.0) is None
    assert until(made.on_disk)
    assert made.tape.span_s
    found = None
    for t_s, was in [moments[2], moments[0], moments[3], moments[1]]:
        view.handle(Seek(t_s - made.tape.span_s[0]))
        found = look(view, 0.0)
        assert found is not None
        assert seen(found[1]) == was
        shown = view.shown(found[1].t_s, 1)
        assert shown is not None
        assert (shown.now, shown.live, shown.open_alarms) == (False, True, 1)
    assert look(view, 0.0) == found  # held: the same scene
    view.handle(requests.Now())
    assert look(view, 0.0) is None
    made.close()


def test_played_at_a_multiple_the_past_becomes_the_present(tmp_path: Path) -> None:
    team = Team()
    made = Recording(tmp_path, team)
    whole_team(team)
    assert until(made.on_disk)
    view = PastView(made.tape)
    view.handle(Seek(0.0))
    assert look(view, 10.0) is not None
    for request in (SetSpeed(4.0), SetPlaying(True)):
        view.handle(request)
    assert look(view, 10.0) is not None
    found = look(view, 10.5)
    assert found is not None
    assert found[1].t_s == pytest.approx((made.tape.span_s or (0.0, 0.0))[0] + 2.0)
    clock_s = 10.5
    while look(view, clock_s) is not None:
        clock_s += 0.5
        assert clock_s < 20.0
    assert not view.is_past
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
    player, _ = played(made.close())
    assert "500 x" in player.scene().refused


def test_a_file_cut_off_anywhere_shows_what_came_before(tmp_path: Path) -> None:
    team = Team()
    made = Recording(tmp_path, team)
    whole_team(team)
    whole = made.close().read_bytes()
    rng = random.Random(3)
    for k in range(6):
        path = tmp_path / f"cut{k}.mcap"
        path.write_bytes(whole[: rng.randrange(len(whole) // 3, len(whole))])
        player, _ = played(path)
        assert 0 < len(player.scene().rows) <= 8
        assert player.file.own_damage.truncated


@pytest.mark.slow
def test_damaged_bytes_end_in_no_other_error(tmp_path: Path) -> None:
    team = Team()
    made = Recording(tmp_path, team)
    whole_team(team)
    whole = made.close().read_bytes()
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
        made_tape = Tape(path, grows=False)
        for player in load(made_tape, Operation(TOWER)):
            assert len(player.operation.roster.keys) <= 256


@pytest.mark.parametrize("data", [b"", b"\x91", b"\x95\xa5heard", b"\xdd\xff\xff\xff\xff", bytes(20_000)])
def test_what_is_no_record_is_none(data: bytes) -> None:
    assert decode_record(data) is None


def test_keyframes_are_bounded_and_a_seek_finds_the_nearest(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tape, "MOST_KEYFRAMES", 8)
    team = Team()
    made = Recording(tmp_path, team, keyframe_messages=1)
    for k in range(100):
        team.hear("Kim", place(TOWER, 0.1 * k, 2.0, 0))
        team.pass_time(1.0)
    assert len(made.tape._keyframes) <= 8
    times_s = [keyframe.t_s for keyframe in made.tape._keyframes]
    found = made.tape.before(team.now_s - 20.0)
    assert found.t_s == max(t_s for t_s in times_s if t_s <= team.now_s - 20.0)
    made.close()


def test_the_command_shows_a_recorded_operation_and_names_what_is_none(tmp_path: Path) -> None:
    team = Team()
    made = Recording(tmp_path, team)
    whole_team(team)
    path = made.close()
    run = echostep("command", path, "--plan", PLAN, "--no-page", "--json")
    assert {m["name"] for m in json.loads(run.stdout)["members"]} >= {"Kim", "Finn"}
    assert "another plan" in run.stderr
    junk = tmp_path / "junk.mcap"
    junk.write_bytes(b"junk")
    for wrong, why in ((junk, "no recorded bytes"), (CAPTURES / "walk.mcap", "no recorded operation")):
        failed = echostep("command", wrong, "--plan", PLAN, "--no-page")
        assert (failed.returncode, why in failed.stderr) == (2, True)


def test_heard_holds_the_payload_as_it_came() -> None:
    record = Heard(1.0, True, "echostep/red/Kim/estimate", b"{\x00}")
    assert decode_record(msgspec.msgpack.encode(record)) == record
