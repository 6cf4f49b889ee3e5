# SPDX-License-Identifier: MIT
"""What is printed reaches its reader or is dropped with a reason; files are for their user alone, or shared."""

from __future__ import annotations

import contextlib
import errno
import io
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TextIO

import pytest

from command_line import echostep
from echostep.file_mode import claim, share_files
from echostep.ports.chunks import Chunk
from echostep_app.printing import people
from echostep_app.printing.console import console_for_people
from echostep_app.printing.lines import complain, say, shown
from echostep_app.printing.stream import QUEUE_BYTES, PeopleStream
from echostep_app.recording.recorder import Recorder
from recording.damages import record_walk
from waiting import ends, until
from walks import DEMO as PLAN

FULL = Path("/dev/full")  # refuses every byte: no space left [full(4)]


@contextlib.contextmanager
def pipe(encoding: str = "utf-8") -> Iterator[tuple[int, TextIO]]:
    """A pipe: our end to read, and its other end as a text stream."""
    ours, theirs = os.pipe()
    with os.fdopen(theirs, "w", encoding=encoding) as stream:
        yield ours, stream
    with contextlib.suppress(OSError):  # closed by the test
        os.close(ours)


def test_what_is_written_arrives() -> None:
    with pipe() as (ours, stream):
        printed = PeopleStream(stream, "standard output")
        printed.write("a cat\n")
        printed.flush()
        assert os.read(ours, 100) == b"a cat\n"
        printed.outlast()
        printed.write("a dog\n")
        assert os.read(ours, 100) == b"a dog\n"
        assert not printed.fault


def test_a_reader_that_goes_is_a_fault_and_no_exception() -> None:
    with pipe() as (ours, stream):
        printed = PeopleStream(stream, "standard output")
        os.close(ours)
        printed.write("a cat\n")
        printed.flush()
        printed.write("a dog\n")
        assert printed.is_gone
        assert printed.fault == "standard output: its reader has gone"


@pytest.mark.skipif(not FULL.exists(), reason="no /dev/full here")
def test_a_full_disk_is_told_with_its_reason() -> None:
    with FULL.open("w") as stream:
        printed = PeopleStream(stream, "standard output")
        printed.write("x")
        printed.flush()
        assert printed.fault == f"standard output: {os.strerror(errno.ENOSPC)}"
        assert printed.has_lost
        assert not printed.is_gone


@pytest.mark.parametrize("stream", [io.StringIO(), None])
def test_a_stream_that_is_closed_or_not_there_takes_nothing(stream: io.StringIO | None) -> None:
    printed = PeopleStream(stream, "standard output")
    if stream:
        stream.close()
    printed.write("a cat")
    printed.flush()
    assert printed.fault
    assert not printed.isatty()


def test_a_run_waits_for_no_reader_and_drops_what_is_too_much() -> None:
    """As a terminal that Ctrl-S has stopped, or a pager; in the middle of a drawing nothing is cut out: a text is written whole or not at all."""
    with pipe() as (ours, stream):
        printed = PeopleStream(stream, "standard output")
        printed.outlast()
        text = f"{'x' * 9_999}\n"
        assert ends(lambda: [printed.write(text) for _ in range(100)])
        os.set_blocking(ours, False)
        read = bytearray()

        def has_come() -> bool:
            with contextlib.suppress(BlockingIOError):
                read.extend(os.read(ours, 1 << 20))
            return len(read) > 20 * len(text)

        assert until(has_come)
        printed.drain()
        assert set(read.decode().split("\n")) <= {"x" * 9_999, ""} | {read.decode().split("\n")[-1]}
        assert len(read) < 100 * len(text)
        assert 100 * len(text) > QUEUE_BYTES
        assert not printed.fault


def test_letters_that_a_terminal_lacks_are_replaced() -> None:
    with pipe("ascii") as (ours, stream):
        printed = PeopleStream(stream, "standard output")
        printed.write("● here\n")
        printed.flush()
        assert os.read(ours, 100) == b"? here\n"


def test_a_fault_is_told_on_the_other_stream_once_and_kept_for_page_and_recording(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    errors = io.StringIO()
    ours, theirs = os.pipe()
    os.close(ours)
    with os.fdopen(theirs, "w") as stream:
        monkeypatch.setattr(sys, "stdout", stream)
        monkeypatch.setattr(sys, "stderr", errors)
        with people.to_people():
            people.outlast_output()
            news = people.FaultNews()
            assert not news.words()
            print("a cat", flush=True)
            assert until(errors.getvalue)  # the fault is kept before it is told
            print("a dog", flush=True)
            assert news.words() == "standard output: its reader has gone"
            assert not people.lost_result()
    assert errors.getvalue() == "echostep: standard output: its reader has gone; the run goes on without it\n"


def test_names_do_not_move_the_cursor(capsys: pytest.CaptureFixture[str]) -> None:
    """ESC and its one-letter forms, backspace, carriage return, overrides of the direction."""
    evil = "Hall\x1b[2J\x9b1A\r\x08\u202eB\ud800"
    assert shown(evil) == "Hall?[2J?1A???B?"
    say(evil)
    complain(evil)
    console_for_people().print(evil, markup=False)
    out, err = capsys.readouterr()
    assert out == "Hall?[2J?1A???B?\nHall?[2J?1A?B?\n"  # rich itself drops some
    assert err == "Hall?[2J?1A???B?\n"


def test_a_console_still_moves_its_own_cursor() -> None:
    file = io.StringIO()
    console = console_for_people(file=file, force_terminal=True, _environ={"TERM": "xterm"})
    console.show_cursor(show=False)
    console.print("[bold]wall[/bold]")
    assert "\x1b[?25l" in file.getvalue()
    assert "\x1b[1mwall" in file.getvalue()


@pytest.fixture(autouse=True)
def _usual_umask() -> Iterator[None]:
    before = os.umask(0o022)
    yield
    os.umask(before)
    share_files(wanted=False)


def mode(path: Path) -> int:
    return path.stat().st_mode & 0o777


def test_a_new_file_is_private_and_earlier_ones_keep_content_and_mode(tmp_path: Path) -> None:
    track = tmp_path / "track.csv"
    for text in ("first", "second"):
        track.write_text(text)
        track.chmod(0o644)
        assert mode(claim(track)) == 0o600
    assert [(tmp_path / f"track-000{k}.csv").read_text() for k in (1, 2)] == ["first", "second"]
    assert mode(tmp_path / "track-0001.csv") == 0o644


@pytest.mark.slow
@pytest.mark.parametrize(("option", "expected"), [([], 0o600), (["--share"], 0o644)])
def test_every_file_of_a_replay_and_of_an_export_has_the_mode(tmp_path: Path, option: list[str], expected: int) -> None:
    walk, out = tmp_path / "walk.mcap", tmp_path / "out"
    share_files(wanted=bool(option))
    record_walk(walk, 8.0)
    assert mode(walk) == expected
    echostep(*option, "replay", walk, "--plan", PLAN, "--headless", "--out", out, ends=0)
    echostep(*option, "export", walk, "--plan", PLAN, "-o", out / "track.parquet", ends=0)
    echostep(*option, "cut", walk, "--to", 4, "-o", out / "cut.mcap", ends=0)
    modes = {path.name: mode(path) for path in out.iterdir()}
    assert modes == dict.fromkeys(("track.csv", "track.png", "track.parquet", "cut.mcap"), expected)


def test_share_is_of_one_command(tmp_path: Path) -> None:
    assert echostep("--share", "info", tmp_path / "none.mcap").returncode == 2
    with Recorder(tmp_path / "shared.mcap", {}) as recorder:
        recorder.write(Chunk("board", 1, b"x"))
    assert mode(tmp_path / "shared.mcap") == 0o644
    assert echostep("info", tmp_path / "shared.mcap").returncode == 0
    assert mode(claim(tmp_path / "private.csv")) == 0o600
