# SPDX-License-Identifier: MIT
"""The main commands as on Windows, as far as Linux can play it: without the names that only POSIX systems have, with one-byte encodings.

`without_posix/sitecustomize.py` takes the names away from the package's own code. No test here ran on Windows or macOS.
"""

from __future__ import annotations

import csv
import json
import os
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

from board_runs import ROOT
from command_line import PROGRAM
from echostep.recording import open_recording
from waiting import PATIENCE_S
from walks import DEMO

HOOK = Path(__file__).parent / "without_posix"
WALK = ROOT / "tests/captures/walk.mcap"
CAPTURE = ROOT / "tests/captures/board.bin"
NAME = "Büro 出口"  # the second word is in no one-byte encoding of Windows
pytestmark = pytest.mark.process


def environment() -> dict[str, str]:
    """Files are ASCII where no encoding is given, output is Windows' cp1252 and raises where it cannot."""
    paths = os.pathsep.join([str(HOOK), *filter(None, [os.environ.get("PYTHONPATH")])])
    encodings = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0", "PYTHONIOENCODING": "cp1252:strict"}
    return {**os.environ, **encodings, "PYTHONPATH": paths}


def echostep(*arguments: object, status: int = 0) -> str:
    """What a command prints; it must end with this status, and without a traceback."""
    done = subprocess.run(
        [*PROGRAM, *map(str, arguments)], env=environment(), capture_output=True, check=False, timeout=PATIENCE_S,
        stdin=subprocess.DEVNULL,
    )  # fmt: skip
    printed = done.stdout.decode("cp1252") + done.stderr.decode("cp1252")
    assert done.returncode == status, printed
    assert "Traceback" not in printed
    return printed


@pytest.fixture(scope="module")
def plan(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The demo's plan with names that a one-byte encoding lacks."""
    tree = json.loads(DEMO.read_text(encoding="utf-8"))
    tree["name"] = NAME
    for level in tree["levels"]:
        for room in level.get("rooms", []):
            room["name"] = f"{NAME} {room['name']}"
    path = tmp_path_factory.mktemp("plan") / "plan.json"
    path.write_text(json.dumps(tree, ensure_ascii=False), encoding="utf-8")
    return path


def test_the_names_are_gone() -> None:
    """For the package and for nothing else: else the other tests here show nothing."""
    tried = """
import os, select, signal, sys, time
names = {"__name__": "echostep.tried", "os": os, "select": select, "signal": signal, "sys": sys, "time": time}
for gone in ("os.getuid", "os.sched_getaffinity", "signal.SIGHUP", "time.clock_gettime_ns", "select.poll"):
    eval(gone)
    try:
        eval(gone, names)
    except AttributeError as error:
        print(error)
for module in ("fcntl", "termios", "pty", "resource", "pwd"):
    exec(f"import {module}")
    try:
        exec(f"import {module}", names)
    except ImportError as error:
        print(error)
try:
    eval("select.select([0], [], [], 0)", names)
except OSError as error:
    print(error)
print(eval("sys.platform, os.name", names), sys.platform)
"""
    done = subprocess.run(
        [sys.executable, "-c", tried], env=environment(), capture_output=True, text=True, check=True
    ).stdout.splitlines()
    assert len(done) == 12
    assert done[0] == "module 'os' has no attribute 'getuid'"
    assert done[5] == "No module named 'fcntl'"
    assert done[-1] == f"('win32', 'nt') {sys.platform}"


@pytest.mark.parametrize("command", ["live", "doctor", "plan import"])
def test_help(command: str) -> None:
    assert "Usage:" in echostep(*command.split(), "--help")


@contextmanager
def board_over_tcp() -> Iterator[str]:
    """A port that sends a recorded board's bytes, then nothing more."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def send() -> None:
            with suppress(OSError):
                connection, _ = server.accept()
                with connection:
                    connection.sendall(CAPTURE.read_bytes())
                    while connection.recv(4096):  # requests; until the run ends
                        pass

        thread = threading.Thread(target=send, daemon=True)
        thread.start()
        yield f"socket://127.0.0.1:{server.getsockname()[1]}"
    thread.join(PATIENCE_S)


@pytest.mark.long
def test_a_port_is_recorded_and_the_recording_handled(tmp_path: Path) -> None:
    with board_over_tcp() as url:
        said = echostep("record", "--board", url, "--seconds", 5, "--out", tmp_path / "walk.mcap")
    size = CAPTURE.stat().st_size
    assert f"{size} bytes from the board" in said
    assert b"".join(c.data for c in open_recording(tmp_path / "walk.mcap").chunks()) == CAPTURE.read_bytes()
    assert f"board: {size} bytes" in echostep("info", tmp_path / "walk.mcap")
    assert "nothing was wrong with it" in echostep("repair", tmp_path / "walk.mcap", "-o", tmp_path / "repaired.mcap")
    assert '"Ping"' in echostep("decode", CAPTURE)


@pytest.mark.long
def test_a_walk_is_replayed_and_exported(tmp_path: Path, plan: Path) -> None:
    said = echostep(
        "replay", WALK, "--plan", plan, "--start", "2,7.5,0", "--guide", "start", "--headless", "--out", tmp_path
    )
    assert "estimates: " in said
    rows = list(csv.DictReader((tmp_path / "track.csv").read_text(encoding="utf-8").splitlines()))
    assert rows
    echostep("export", WALK, "--plan", plan, "--start", "2,7.5,0", "-o", tmp_path / "track.gpx")
    echostep("export", WALK, "--plan", plan, "--start", "2,7.5,0", "-o", tmp_path / "track2.csv")
    echostep("export", WALK, "--plan", plan, "--start", "2,7.5,0", "-o", tmp_path / "derived.mcap")


@pytest.mark.long
def test_plans_and_settings_are_read_as_utf_8(tmp_path: Path, plan: Path) -> None:
    assert "nothing wrong" in echostep("plan", "check", plan)
    assert "the rooms are: Büro ??" in echostep("replay", WALK, "--plan", plan, "--start", "x", "--headless", status=2)
    settings = tmp_path / "settings.toml"
    settings.write_text("# Einheit: Meßwert 出口\n", encoding="utf-8")
    said = echostep("replay", WALK, "--plan", plan, "--settings", settings, "--start", "x", "--headless", status=2)
    assert "the rooms are" in said  # the settings were read


@pytest.mark.long
def test_a_board_that_is_not_there_is_one_sentence(tmp_path: Path) -> None:
    said = echostep("live", "--board", "COM99", "--headless", "--out", tmp_path, status=2)
    assert "COM99" in said
    assert "python -m serial.tools.list_ports" in said
