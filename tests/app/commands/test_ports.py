# SPDX-License-Identifier: MIT
"""Mistakes with ports: swapped, given twice, in use, not given at all; ports over a network are read in blocks and tracked."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from board_runs import needs_twin
from bridges import bridged
from command_line import echostep, interrupt_after, interrupt_when
from echostep.ports.chunks import Chunk
from echostep.recording import open_recording
from echostep.xsens import PROJECT
from echostep_app.board.faults.findings import Severity
from echostep_app.commissioning import serial_ports as port_search
from echostep_app.commissioning.doctor import examine
from echostep_app.commissioning.serial_ports import PortSeen, Role, find_ports
from echostep_app.recording.device import sender
from echostep_studies.simulation.devices.mtx_setup import FACTORY, MtxDevice
from players import babbling_port, pseudo_terminal, python_board, walking_twin
from waiting import PATIENCE_S
from walks import DEMO as PLAN
from xsens.mt_lines import on_a_terminal


@contextmanager
def board_and_mtx() -> Iterator[tuple[str, str]]:
    with python_board() as board, on_a_terminal(MtxDevice(FACTORY, deaf=True)) as mtx:
        yield board, mtx


@pytest.mark.parametrize("command", ["live", "record"])
def test_swapped_ports_are_named_as_swapped_and_their_bytes_are_kept(tmp_path: Path, command: str) -> None:
    more = ["--plan", PLAN, "--headless", "--out", tmp_path] if command == "live" else ["--out", tmp_path / "walk.mcap"]
    with board_and_mtx() as (board, mtx):
        done = echostep(command, "--board", mtx, "--mtx", board, "--seconds", PATIENCE_S, *more)
    assert done.returncode == 2
    assert "the ports are swapped" in done.stderr
    assert f"give --board {board} --mtx {mtx}" in done.stderr
    assert sum(len(chunk.data) for chunk in open_recording(tmp_path / "walk.mcap").chunks()) > 100


@pytest.mark.slow
def test_an_mtx_alone_at_the_boards_port_is_named() -> None:
    with on_a_terminal(MtxDevice(PROJECT)) as mtx:
        report = examine(mtx, None, 1.0)
    assert f"{mtx} is the MTx, not the sensor board" in str(report.findings[0])
    assert f"--mtx {mtx}" in str(report.findings[0])


def test_a_port_given_twice_is_refused(tmp_path: Path) -> None:
    with pseudo_terminal() as (_, port):
        (tmp_path / "link").symlink_to(port)
        for again in (port, tmp_path / "link"):
            done = echostep("record", "--board", port, "--mtx", again, "--out", tmp_path / "a.mcap")
            assert (done.returncode, done.stderr.count("\n")) == (2, 1)
            assert "given twice, for board and mtx" in done.stderr
    assert not list(tmp_path.glob("*.mcap"))


HOLD = """
import sys, time
from echostep_app.ports.serial_ports import SerialPorts
ports = SerialPorts({"board": sys.argv[1]}, {"board": 115200})
print("open", flush=True)
sys.stdin.read()
"""


@pytest.mark.process
def test_the_second_program_on_a_port_is_told_who_has_it(tmp_path: Path) -> None:
    with pseudo_terminal() as (_, port):
        first = subprocess.Popen(
            [sys.executable, "-c", HOLD, port], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        assert first.stdout is not None
        assert first.stdout.readline() == "open\n"
        second = echostep("record", "--board", port, "--out", tmp_path / "a.mcap", "--seconds", 1)
        doctor = echostep("doctor", "--board", port)
        first.communicate("")
        third = echostep("record", "--board", port, "--out", tmp_path / "a.mcap", "--seconds", 0.1)
    assert second.returncode == 2
    assert f"{port} is in use by {Path(sys.executable).name}" in second.stderr.replace(f"{sys.prefix}/bin/", "")
    assert f"(process {first.pid})" in second.stderr
    assert f"(process {first.pid})" in doctor.stdout
    assert third.returncode == 0, third.stderr


@pytest.mark.long
def test_live_finds_both_ports_by_what_they_say(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The board's identifiers are another program's, the adapter of the MTx is unknown, a third device talks nonsense."""
    with board_and_mtx() as (board, mtx), babbling_port(b"$GPGGA,123519,4807.038,N\r\n") as other:
        seen = [PortSeen(other, Role.MTX, ""), PortSeen(mtx, Role.OTHER, ""), PortSeen(board, Role.SKETCH, "")]
        monkeypatch.setattr(port_search, "list_seen", lambda: seen)
        monkeypatch.setattr(port_search, "ROLES", {})
        assert (find_ports().board, find_ports().mtx) == (board, mtx)
        heard = set[str]()

        def both_are_heard(chunk: Chunk) -> bool:
            heard.add(chunk.port)
            return heard >= {"board", "mtx"}

        interrupt_when(both_are_heard, monkeypatch)
        done = echostep("record", "--out", tmp_path / "a.mcap", "--seconds", PATIENCE_S)
    assert f"Ports: --board {board} --mtx {mtx}" in done.stdout
    assert {chunk.port for chunk in open_recording(tmp_path / "a.mcap").chunks()} == {"board", "mtx"}


@pytest.mark.slow
def test_a_search_without_a_board_says_what_is_there(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(port_search, "list_seen", list)
    assert "no USB serial port is plugged in" in echostep("live", "--plan", PLAN).stderr
    with on_a_terminal(MtxDevice(PROJECT)) as mtx, pseudo_terminal() as (_, silent):
        seen = [PortSeen(mtx, Role.MTX, ""), PortSeen(silent, Role.OTHER, ""), PortSeen("/dev/none", Role.BOARD, "")]
        monkeypatch.setattr(port_search, "list_seen", lambda: seen)
        done = echostep("record")
    assert done.returncode == 2
    for words in (f"{mtx}: an MTx", f"{silent}: something else", "/dev/none: there is no such port", "--board"):
        assert words in done.stderr


@pytest.mark.long
@needs_twin
def test_two_boards_are_found_told_apart_tracked_and_replayed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    track = tmp_path / "live/track.csv"
    with walking_twin(tmp_path, "--kit", "2026") as (board, foot):
        seen = [PortSeen(port, Role.BOARD, "", number) for port, number in ((foot, "17"), (board, "4"))]
        monkeypatch.setattr(port_search, "list_seen", lambda: seen)
        swapped = echostep(
            "record", "--board", foot, "--foot", board, "--out", tmp_path / "a.mcap", "--seconds", PATIENCE_S
        )
        interrupt_after(10, monkeypatch)
        live = echostep("live", "--plan", PLAN, "--headless", "--out", tmp_path / "live", "--seconds", PATIENCE_S)
        monkeypatch.setattr("echostep_app.commissioning.doctor.list_seen", lambda: seen)
        report = examine(None, None, 3.0)
    assert swapped.returncode == 2
    assert f"the ports are swapped: give --board {board} --foot {foot}" in swapped.stderr
    assert live.returncode == 0, live.stderr
    assert f"Ports: --board {board} --foot {foot}" in live.stdout
    assert {chunk.port for chunk in open_recording(tmp_path / "live/walk.mcap").chunks()} == {"board", "foot"}
    echostep("replay", tmp_path / "live/walk.mcap", "--plan", PLAN, "--out", tmp_path / "again", "--headless")
    assert track.read_bytes().count(b"\n") > 10
    assert (tmp_path / "again/track.csv").read_bytes() == track.read_bytes()
    text = "\n".join(report.lines)
    assert f"board     {board}: firmware 1.9.1" in text
    assert f"foot board {foot}: firmware 1.9.1" in text
    assert "foot      ICM-20649, identity 0xE1, running, 24 degC" in text
    assert "several" not in text
    assert not [f for f in report.findings if "foot" in f.subject and f.severity is Severity.FAULT]  # the wearer walks


@needs_twin
def test_a_foot_board_alone_at_the_boards_port_is_named(tmp_path: Path) -> None:
    with walking_twin(tmp_path, "--kit", "2026") as (_, foot):
        done = echostep("record", "--board", foot, "--out", tmp_path / "a.mcap", "--seconds", PATIENCE_S)
    assert f"{foot} is the foot board, not the sensor board: name its port with --foot {foot}" in done.stderr


def test_an_mtx_and_a_foot_board_are_not_worn_together() -> None:
    done = echostep("record", "--board", "a", "--mtx", "b", "--foot", "c")
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert "only one of them is on the foot" in done.stderr


def test_random_bytes_are_no_device() -> None:
    assert sender(os.urandom(1 << 14)) is None
    assert sender(b"") is None


LEAST_BYTES = 12  # of a chunk on average: a message or two; single bytes took 10 s of a run of 25 s


@pytest.mark.long
@needs_twin
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
@needs_twin
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
