# SPDX-License-Identifier: MIT
"""`echostep flash`: a fake avrdude and a board on a pseudo terminal that obeys the 1200 Bd touch, and everything that may be missing."""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import shutil
import subprocess
import termios
import threading
import time
from collections.abc import Callable, Iterator
from importlib.resources import files
from pathlib import Path

import pytest

from board_runs import ELF, ROOT
from command_line import echostep
from echostep.board import messages as m
from echostep.board.frames import encode
from echostep_app.commissioning.flash import check_digest, check_hex
from players import pseudo_terminal
from snapshots import expect, refusal
from waiting import PATIENCE_S, ran, until

SHIPPED = ROOT / "host/app/echostep_app/firmware/echostep.hex"
AVRDUDE = """#!/bin/sh
echo "$@" > {log}
bar() {{ printf '\\n%s | ' "$1" >&2; for n in 1 2 3 4 5; do printf '##########' >&2; sleep 0.02; done; printf ' | 100%% 0.10s\\n' >&2; }}
{body}
"""
GOOD = (
    'bar Writing; bar Reading; echo "avrdude: 12028 bytes of flash verified" >&2; echo "avrdude done.  Thank you." >&2'
)
BAD = 'bar Writing; bar Reading; echo "avrdude: verification error, first mismatch at byte 0x0100" >&2; exit 1'
MODEM_MANAGER = (
    'echo "Connecting to programmer: ." >&2; echo "avrdude: error: butterfly programmer uses avr_write_page() but does not provide" >&2; '
    'echo "         a cmd() method." >&2; echo "avrdude: butterfly_recv(): programmer is not responding" >&2; exit 1'
)
DEAF = 'echo "avrdude: butterfly_recv(): programmer is not responding" >&2; exit 1'


def flash(*arguments: object, path: str | None = None) -> subprocess.CompletedProcess[str]:
    return echostep("flash", *arguments, env=dict(os.environ) | ({} if path is None else {"PATH": path}))


def fake_avrdude(folder: Path, body: str) -> tuple[str, Path]:
    """A PATH on which avrdude is the fake, and the file with its arguments."""
    program, log = folder / "bin/avrdude", folder / "log"
    program.parent.mkdir()
    program.write_text(AVRDUDE.format(log=log, body=body))
    program.chmod(0o755)
    return f"{program.parent}:{os.environ['PATH']}", log


@contextlib.contextmanager
def board(link: Path, log: Path, obeys: bool = True) -> Iterator[None]:
    """A board at `link` that goes into its bootloader when touched, and comes back with the firmware once avrdude was there."""
    over = threading.Event()

    def wait(what: Callable[[], bool]) -> None:
        while not over.is_set() and not what():
            time.sleep(0.02)

    def play() -> None:
        with (
            pseudo_terminal() as (ours, first),
            pseudo_terminal() as (_, second),
            pseudo_terminal() as (running, third),
        ):
            link.symlink_to(first)
            wait(lambda: obeys and bool(termios.tcgetattr(ours)[4] == termios.B1200))
            link.unlink()
            over.wait(0.3)
            link.symlink_to(second)
            wait(log.exists)
            over.wait(0.4)
            link.unlink()
            over.wait(0.2)
            link.symlink_to(third)
            while not over.wait(0.2):
                with contextlib.suppress(BlockingIOError):
                    os.write(running, encode(m.Identity(0, m.SCHEMA_HASH, 1, 1, 0, 0), 0))
        link.unlink()

    thread = threading.Thread(target=play)
    thread.start()
    until(link.is_symlink)
    try:
        yield
    finally:
        over.set()
        thread.join(timeout=PATIENCE_S)


@pytest.mark.process
def test_a_board_is_touched_written_verified_and_answers(tmp_path: Path) -> None:
    path, log = fake_avrdude(tmp_path, GOOD)
    with board(tmp_path / "port", log):
        done = flash("--port", tmp_path / "port", path=path)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "firmware 1.1.0 answers" in done.stdout
    assert "100 %" in done.stdout
    arguments = log.read_text()
    assert "-c avr109" in arguments
    assert f"-P {tmp_path / 'port'}" in arguments
    assert str(SHIPPED) in arguments


@pytest.mark.process
def test_what_avrdude_says_is_passed_on(tmp_path: Path) -> None:
    said = {}
    for case, body in {"verification fails": BAD, "no answer": DEAF, "a line that goes on": MODEM_MANAGER}.items():
        (tmp_path / case).mkdir()
        path, log = fake_avrdude(tmp_path / case, body)
        with board(tmp_path / "port", log):
            said[case] = flash("--port", tmp_path / "port", path=path).stderr
    expect("flash", said, FOLDER=tmp_path)


@pytest.mark.long
def test_a_board_that_does_not_react_is_told_after_ten_seconds(tmp_path: Path) -> None:
    path, log = fake_avrdude(tmp_path, GOOD)
    with board(tmp_path / "port", log, obeys=False):
        done = flash("--port", tmp_path / "port", path=path)
    assert done.returncode == 2
    assert "did not enter its bootloader in 10 s" in done.stderr
    assert not log.exists()


def make_flash(port: object, path: str, *more: object) -> subprocess.CompletedProcess[str]:
    """`make flash` without make: the script that it runs, with these programs alone."""
    command = list(map(str, ["/bin/sh", ROOT / "tools/flash.sh", port, *more]))
    return ran(command, env={"PATH": path}, timeout=PATIENCE_S)


@pytest.mark.process
def test_make_flash_writes_without_an_environment(tmp_path: Path) -> None:
    path, log = fake_avrdude(tmp_path, GOOD)
    with board(tmp_path / "port", log):
        done = make_flash(tmp_path / "port", path, SHIPPED)
    assert done.returncode == 0, done.stderr
    assert "Next: echostep doctor" in done.stdout
    assert f"-P {tmp_path / 'port'} -b 57600 -D -U flash:w:{SHIPPED}:i" in log.read_text()
    assert "$(READY)" not in re.findall(r"^flash:.*", (ROOT / "Makefile").read_text(), flags=re.M)[0]


@pytest.mark.process
def test_make_flash_checks_port_and_avrdude_before_it_builds(tmp_path: Path) -> None:
    """On a PATH with the programs of a shell, and with a compiler that would leave a trace."""
    built = tmp_path / "built"
    for name in ("make", "avr-gcc"):
        (tmp_path / name).write_text(f"#!/bin/sh\ntouch {built}\n")
        (tmp_path / name).chmod(0o755)
    (tmp_path / "dirname").symlink_to("/usr/bin/dirname")
    with pseudo_terminal() as (_, port):
        for at, words in (
            ("", "say which port"),
            ("/dev/no-such-port", "there is no such port"),
            (__file__, "is no serial port"),
            (port, "avrdude is not installed"),
        ):
            done = make_flash(at, str(tmp_path))
            assert done.returncode == 2
            assert words in done.stderr.splitlines()[-1]
    assert not built.exists()


def test_no_board_and_no_avrdude_are_named(tmp_path: Path) -> None:
    path, _ = fake_avrdude(tmp_path, GOOD)
    (tmp_path / "file").touch()
    cases: dict[str, tuple[list[object], str]] = {
        "no avrdude": ([], str(tmp_path / "empty")),
        "no such port": (["--port", "/dev/no-such-port"], path),
        "no serial port": (["--port", tmp_path / "file"], path),
        "no such hex": (["--hex", "none.hex"], path),
    }
    said = {case: flash(*arguments, path=where) for case, (arguments, where) in cases.items()}
    expect("flash", said, FOLDER=tmp_path)


def test_a_damaged_hex_is_named(tmp_path: Path) -> None:
    damaged = {
        "nothing": "",
        "no hex": "hello",
        "no program": ":00000001FF\n",
        "no end": ":0400000001020304F2\n",
        "wrong sum": ":0400000001020304F3\n:00000001FF\n",
        "a damaged line": ":0400000001020304F2\n:zz\n",
        "over the bootloader": ":047000000102030482\n:00000001FF\n",
        "other letters": "é",
    }
    said = {}
    for case, text in damaged.items():
        (tmp_path / "x.hex").write_text(text)
        said[f"hex: {case}"] = refusal(lambda: check_hex(tmp_path / "x.hex"))
    expect("flash", said, FOLDER=tmp_path)


def _made_by(path: Path) -> str:
    """Compiler and linker of a hex file, as the build has written them below its digest."""
    return path.with_name(f"{path.name}.sha256").read_text().partition("\n")[2]


def test_the_shipped_firmware_belongs_to_this_host() -> None:
    text = (files("echostep_app") / "firmware/echostep.hex").read_text()
    assert 8_000 < check_hex(SHIPPED) < 28_672
    program = b"".join(bytes.fromhex(line[9:-2]) for line in text.split() if line[7:9] == "00")
    words = [int.from_bytes(program[k : k + 2], "little") for k in range(0, len(program) - 1, 2)]
    loaded = [(w >> 4 & 0xF0) | (w & 0x0F) if w >> 12 == 0xE else None for w in words]  # LDI Rd, K
    wanted = set(m.SCHEMA_HASH.to_bytes(4, "little"))
    assert any(wanted <= set(loaded[k : k + 8]) for k in range(len(loaded))), "of another schema: make firmware"
    built = ELF.with_suffix(".hex")
    if built.exists() and _made_by(built) == _made_by(SHIPPED):  # other bytes of others: test_twin.py runs the shipped
        assert built.read_text() == text, "the firmware has changed: make firmware"


def test_the_shipped_firmware_has_its_digest_beside_it(tmp_path: Path) -> None:
    assert check_digest(SHIPPED) == hashlib.sha256(SHIPPED.read_bytes()).hexdigest()
    assert re.fullmatch(r"# by avr-gcc .+, GNU ld .+\n", _made_by(SHIPPED))
    own = tmp_path / "own.hex"
    shutil.copy(SHIPPED, own)
    assert check_digest(own) == check_digest(SHIPPED)  # nothing beside it says otherwise


@pytest.mark.process
def test_firmware_with_another_digest_is_not_written(tmp_path: Path) -> None:
    """Altered, and still valid Intel HEX: by `echostep flash` and by `make flash`."""
    altered, (path, log) = tmp_path / "echostep.hex", fake_avrdude(tmp_path, GOOD)
    shutil.copy(SHIPPED.with_name("echostep.hex.sha256"), tmp_path)
    altered.write_text(SHIPPED.read_text().lower())
    assert check_hex(altered) == check_hex(SHIPPED)
    with pseudo_terminal() as (_, port):
        ours = flash("--port", port, "--hex", altered, path=path)
        makes = make_flash(port, path, altered)
    for done in (ours, makes):
        assert done.returncode == 2
        assert "its SHA-256 is" in done.stderr
    assert not log.exists()
