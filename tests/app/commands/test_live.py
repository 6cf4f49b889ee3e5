# SPDX-License-Identifier: MIT
"""Live from two ports, recorded, replayed: the same estimates, bit for bit."""

from __future__ import annotations

import csv
import json
import math
import os
import re
import signal
import subprocess
import time
import tty
from collections import Counter
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path

import pytest

from board_runs import needs_twin
from command_line import PROGRAM, echostep, interrupt_after, sha_of
from echostep.errors import EchostepError
from echostep.plan import load_plan
from echostep.recording import open_recording
from echostep_app.ports.serial_ports import SerialPorts
from echostep_app.session.last_place import read_kept
from players import pseudo_terminal, walking_twin
from snapshots import expect
from waiting import PATIENCE_S, until
from walks import DEMO as PLAN


@pytest.mark.long
@needs_twin
@pytest.mark.parametrize("wears_mtx", [True, False])
def test_a_live_run_replays_to_identical_estimates(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, wears_mtx: bool
) -> None:
    """With foot and board from the plan's start, and with the board alone from where the last run ended."""
    (tmp_path / "live").mkdir()
    place = {"x_m": 2.0, "y_m": 7.5, "sd_m": 0.1, "level": 0, "air": None}
    kept = {"utc": datetime.now(UTC).isoformat(), "plan_sha256": load_plan(PLAN).digest, "board": "", "place": place}
    (tmp_path / "live/last.json").write_text(json.dumps(kept))
    with walking_twin(tmp_path) as (board, mtx):
        interrupt_after(10, monkeypatch)
        live = echostep(
            "live",
            "--plan",
            PLAN,
            "--board",
            board,
            *(("--mtx", mtx) if wears_mtx else ("--start", "last")),
            "--out",
            tmp_path / "live",
            "--headless",
            "--seconds",
            PATIENCE_S,
        )
    assert live.returncode == 0, live.stderr
    rows = list(csv.DictReader((tmp_path / "live/track.csv").read_text().splitlines()))
    assert len(rows) >= 10
    assert ("Start: where the last run ended, " in live.stdout) is not wears_mtx
    assert math.dist((float(rows[0]["x_m"]), float(rows[0]["y_m"])), (2.0, 7.5)) < 0.5
    assert read_kept(tmp_path / "live").place.air is None
    assert not wears_mtx or read_kept(tmp_path / "live").place.x_m != 2.0
    again = echostep("replay", tmp_path / "live/walk.mcap", "--plan", PLAN, "--out", tmp_path / "again", "--headless")
    assert again.returncode == 0, again.stderr
    assert sha_of(again.stdout) == sha_of(live.stdout)
    assert (tmp_path / "again/track.csv").read_bytes() == (tmp_path / "live/track.csv").read_bytes()


def records(path: Path) -> bool:
    """Whether bytes of a port are in a recording: its run is under way."""
    try:
        open_recording(path)
    except EchostepError:
        return False
    return True


TWO_PORTS = ("--board", "x", "--mtx", "y")
MISTAKES: dict[str, list[object]] = {
    "no such recording": ["replay", "none.mcap", "--plan", PLAN],
    "a file that is no recording": ["replay", __file__, "--plan", PLAN],
    "no such kind of port": ["live", "--plan", PLAN, "--board", "nonsense://x", "--mtx", "y"],
    "a start without heading": ["live", "--plan", PLAN, *TWO_PORTS, "--start", "1,2"],
    "a start of no number": ["live", "--plan", PLAN, *TWO_PORTS, "--start", "1,2,nan"],
    "no such settings": ["live", "--plan", PLAN, *TWO_PORTS, "--settings", "none.toml"],
    "record: no such port": ["record", "--board", "/dev/no-such-port", "--mtx", "y"],
    "no such capture": ["decode", "none.bin"],
    "a file that is no capture": ["decode", __file__],
    "no such board command": ["demo", "--headless", "--board-command", "/no/such/twin"],
    "a board command that ends": ["demo", "--headless", "--board-command", "/bin/true"],
    "a board command that is none": ["demo", "--headless", "--board-command", "/bin/echo hello"],
}
SETTINGS = [
    "[clud]\nsize = 3", "[cloud]\nsizee = 3", "[cloud]\nsize = 'many'", "[cloud]\nsize = 1.5", "[cloud]\nsize = -4", "[cloud]\nstart_sd_m = nan",
    "[cloud]\nsize = 1" + 400 * "0", "[echo]\nsd_m = 0", "[mtx]\nrate_hz = 0", "cloud = 3", "[cloud",
]  # fmt: skip


@pytest.mark.process
def test_mistakes_end_with_one_line(tmp_path: Path) -> None:
    out = ["--out", tmp_path / "out"]
    others = {"decode": [], "record": ["--out", tmp_path / "walk.mcap"]}
    said = {case: echostep(*words, *others.get(str(words[0]), out)) for case, words in MISTAKES.items()}
    settings = tmp_path / "settings.toml"
    for text in SETTINGS:
        settings.write_text(text)
        case = f"settings {text[:20]!r}"
        said[case] = echostep("live", "--plan", PLAN, *TWO_PORTS, "--settings", settings, *out)
    assert {(done.returncode, done.stderr.count("\n")) for done in said.values()} == {(2, 1)}
    printed = {case: re.sub("there are .*", "there are ...", done.stderr) for case, done in said.items()}
    expect("live, record, replay, decode, demo", printed, FILE=__file__, FOLDER=tmp_path)


@pytest.mark.long
@pytest.mark.process
def test_record_keeps_the_bytes_of_both_ports(tmp_path: Path) -> None:
    pairs = [os.openpty() for _ in range(2)]
    for _, theirs in pairs:
        tty.setraw(theirs)
    names = [os.ttyname(theirs) for _, theirs in pairs]
    path = tmp_path / "x.mcap"
    recorder = subprocess.Popen(
        [*PROGRAM, "record", "--board", names[0], "--mtx", names[1], "--out", path],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    sent = [b"", b""]

    def enough_is_recorded() -> bool:
        for k, (ours, _) in enumerate(pairs):
            part = bytes([k + 1, len(sent[k]) % 256]) * 20
            sent[k] += part
            os.write(ours, part)
        kept = Counter[str]()
        for chunk in open_recording(path).chunks() if records(path) else ():
            kept[chunk.port] += len(chunk.data)
        return min(kept["board"], kept["mtx"]) > 500

    assert until(enough_is_recorded)
    recorder.send_signal(signal.SIGINT)
    out, err = recorder.communicate(timeout=PATIENCE_S)
    for pair in pairs:
        for end in pair:
            os.close(end)
    assert recorder.returncode == 0, err
    chunks = list(open_recording(path).chunks())
    for k, port in enumerate(("board", "mtx")):
        kept = b"".join(c.data for c in chunks if c.port == port)
        assert len(kept) > 500
        assert kept in sent[k]
    assert all(b.t_arrival_ns >= a.t_arrival_ns for a, b in zip(chunks, chunks[1:], strict=False))
    assert "bytes from the board" in out


@pytest.mark.slow
def test_a_port_that_goes_away_is_opened_again(tmp_path: Path) -> None:
    link = tmp_path / "port"
    first, theirs = os.openpty()
    tty.setraw(theirs)
    name = Path(os.ttyname(theirs))
    link.symlink_to(name)
    ports = SerialPorts({"board": str(link)}, {"board": 115200})
    found = b""
    try:
        os.write(first, b"before")
        second, new = os.openpty()
        tty.setraw(new)
        deadline = time.monotonic() + PATIENCE_S
        for chunk in ports.chunks():
            found += chunk.data if chunk else b""
            if found == b"before" and link.is_symlink() and link.readlink() == name:
                link.unlink()
                link.symlink_to(os.ttyname(new))
                os.close(theirs)
                os.close(first)
            if "is back" in " ".join(ports.notices):
                os.write(second, b" after")
                ports.notices.clear()
            if found.endswith(b"after") or time.monotonic() > deadline:
                break
    finally:
        ports.close()
        os.close(second)
        os.close(new)
    assert found == b"before after"


def test_bytes_that_came_together_are_one_chunk() -> None:
    with pseudo_terminal() as (ours, name), closing(SerialPorts({"board": name}, {"board": 115200})) as ports:
        os.write(ours, b"0123456789")
        chunks = (chunk for chunk in ports.chunks() if chunk is not None)
        assert next(chunks).data == b"0123456789"
