# SPDX-License-Identifier: MIT
"""`echostep flash`: writes the firmware to a board through its Caterina bootloader.

In: a port and a hex file, or the port found on this computer and the firmware of this package. Out: a board that runs the firmware, or an error.
Owns the process of avrdude, which implements the bootloader's protocol (avr109).
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib.resources import as_file, files
from pathlib import Path
from queue import Empty, SimpleQueue
from threading import Thread
from typing import IO

import serial
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn

from echostep.errors import EchostepError
from echostep.ports.chunks import BOARD
from echostep_app.commissioning.probe import probe
from echostep_app.commissioning.serial_ports import BOARD_NAME, Role, access_findings, find, list_seen
from echostep_app.interruption import wait_for
from echostep_app.ports.access import PORT_FAULTS

TOUCH_BAUD = 1200  # opening the port at this rate and closing it starts the bootloader
BOOTLOADER_S = 10.0  # longest wait for its port; the bootloader runs for eight seconds
RESTART_S = 10.0  # longest wait for the port and the first message of the firmware
PROBE_S = 1.2
ACCESS_S = 2.0  # longest wait for udev to set the permissions of the port
AVRDUDE_S = 120.0
READER_S = 2.0  # for the last of avrdude's output; assumed
FLASH_MAX = 32768 - 4096  # bytes; the bootloader occupies the rest of the ATmega32U4
FULL_BAR = 50  # characters of avrdude's progress bar
MODEMS = "if ModemManager runs here, it talks to new ports: install the udev rules (echostep doctor --udev)"
PRESS = "press its reset button (Pro Micro: twice, quickly) and run this again within eight seconds"


def flash(port: str | None, hex_file: Path | None, console: Console) -> None:
    """Write the firmware and wait for its first message; raises EchostepError with the remedy."""
    avrdude = shutil.which("avrdude")
    if avrdude is None:
        raise EchostepError("avrdude is not installed: sudo apt install avrdude (macOS: brew install avrdude)")
    with _hex(hex_file) as path:
        size, digest = check_hex(path), check_digest(path)
        board_port = port or _find_board()
        for finding in access_findings("board", board_port):
            raise EchostepError(str(finding))
        console.print(f"{path.name}, {size} bytes, SHA-256 {digest}, to {board_port}", highlight=False)
        bootloader = enter_bootloader(board_port)
        console.print(f"bootloader at {bootloader}")
        write(avrdude, bootloader, path)
    console.print(_confirm(board_port))


@contextmanager
def _hex(hex_file: Path | None) -> Iterator[Path]:
    if hex_file is not None:
        yield hex_file
        return
    with as_file(files("echostep_app") / "firmware" / "echostep.hex") as shipped:
        yield shipped


def check_hex(path: Path) -> int:
    """Bytes of program in an Intel HEX file; raises EchostepError naming the file and the line."""
    try:
        lines = path.read_text(encoding="ascii").split()
    except (OSError, UnicodeDecodeError) as error:
        raise EchostepError(f"{path}: cannot read the firmware: {error}; build it: make firmware") from error
    size, ended = 0, False
    for number, line in enumerate(lines, 1):
        try:
            record = bytes.fromhex(line.removeprefix(":")) if line.startswith(":") else b""
        except ValueError:
            record = b""
        if len(record) < 5 or len(record) != record[0] + 5 or sum(record) % 256:
            raise EchostepError(f"{path}: line {number} is no record of Intel HEX; build it anew: make firmware")
        if record[3] == 0:
            size += record[0]
            if int.from_bytes(record[1:3], "big") + record[0] > FLASH_MAX:
                raise EchostepError(f"{path}: line {number} lies beyond {FLASH_MAX} bytes, in the bootloader")
        ended = ended or record[3] == 1
    if not ended or size == 0:
        raise EchostepError(f"{path}: {'ends too early' if not ended else 'holds no program'}; build it: make firmware")
    return size


def check_digest(path: Path) -> str:
    """SHA-256 of a file; raises EchostepError when it differs from the one that the build wrote for the file, if any."""
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    beside = path.with_name(f"{path.name}.sha256")
    if beside.exists() and (expected := beside.read_text(errors="replace").partition(" ")[0].strip()) != digest:
        raise EchostepError(
            f"{path}: its SHA-256 is {digest}, and {beside.name} says {expected[:64]}: build it anew: make firmware"
        )
    return digest


def _find_board() -> str:
    seen = list_seen()
    for role in (Role.BOOTLOADER, Role.BOARD, Role.SKETCH):
        if port := find(seen, role, BOARD_NAME):
            return port
    others = f"; the ports here are {', '.join(p.path for p in seen)}" if seen else ""
    raise EchostepError(f"no board is plugged in: plug it in, or name its port with --port{others}")


def enter_bootloader(port: str) -> str:
    """Start the board's bootloader unless it runs already; returns its port."""
    if any(seen.path == os.path.realpath(port) and seen.role is Role.BOOTLOADER for seen in list_seen()):
        return port
    before = {seen.path for seen in list_seen()}
    device = os.path.realpath(port)
    try:
        touched = serial.Serial(port, TOUCH_BAUD, timeout=0.1)
        with suppress(OSError):  # a port without modem lines
            touched.dtr = False
        touched.close()
    except PORT_FAULTS as error:
        raise EchostepError(f"{port}: cannot open the port: {error}") from error

    gone = False

    def bootloader_port() -> str | None:
        nonlocal gone
        seen = list_seen()
        gone = gone or not Path(port).exists() or os.path.realpath(port) != device
        fresh = next((s.path for s in seen if s.role is Role.BOOTLOADER or s.path not in before), None)
        return fresh or (port if gone and Path(port).exists() else None)

    bootloader = wait_for(bootloader_port, BOOTLOADER_S)
    if bootloader is None:
        raise EchostepError(f"{port}: the board did not enter its bootloader in {BOOTLOADER_S:.0f} s: {PRESS}")
    wait_for(lambda: bootloader if os.access(bootloader, os.R_OK | os.W_OK) else None, ACCESS_S)
    return bootloader


def write(avrdude: str, port: str, path: Path) -> None:
    """Let avrdude write and verify, with a progress bar; raises EchostepError with avrdude's error line."""
    command = [avrdude, "-p", "atmega32u4", "-c", "avr109", "-P", port, "-b", "57600", "-D", "-U", f"flash:w:{path}:i"]
    columns = (TextColumn("{task.description:10}"), BarColumn(), TextColumn("{task.percentage:>3.0f} %"))
    with Progress(*columns) as bars:
        tasks = {
            "Writing": bars.add_task("writing", total=FULL_BAR),
            "Reading": bars.add_task("verifying", total=FULL_BAR),
        }
        output = ""
        for output in _output(command):
            for phase, task in tasks.items():
                if marks := re.findall(rf"{phase} \|\s*(#+)", output):
                    bars.update(task, completed=len(marks[-1]))


def _output(command: list[str]) -> Iterator[str]:
    """The whole output of the program so far, each time it grows; raises EchostepError when the program fails."""
    child = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    assert child.stdout is not None
    output, deadline = b"", time.monotonic() + AVRDUDE_S
    portions: SimpleQueue[bytes] = SimpleQueue()
    reader = Thread(target=_read_all, args=(child.stdout, portions), daemon=True)  # Windows cannot wait for a pipe
    reader.start()
    try:
        while received := portions.get(timeout=max(0.0, deadline - time.monotonic())):
            output += received
            yield output.decode(errors="replace")
        if status := child.wait(timeout=5.0):
            raise EchostepError(
                f"avrdude failed (status {status}): {_error_line(output.decode(errors='replace'))}; {PRESS}; {MODEMS}"
            )
    except Empty as error:
        late = f"avrdude did not end in {AVRDUDE_S:.0f} s: unplug the board and plug it in again"
        raise EchostepError(late) from error
    finally:
        if child.poll() is None:
            child.kill()
            child.wait()
        reader.join(timeout=READER_S)
        child.stdout.close()


def _read_all(pipe: IO[bytes], portions: SimpleQueue[bytes]) -> None:
    """Portions from a pipe, up to its end: an empty portion."""
    while received := os.read(pipe.fileno(), 4096):
        portions.put(received)
    portions.put(b"")


def _error_line(output: str) -> str:
    """The first line of avrdude's output that names an error, with the lines that continue it, else the last line."""
    joined = re.sub(r"\n[ \t]+", " ", output.replace("\r\n", "\n"))
    lines = [x.strip() for x in joined.splitlines() if x.strip() and "Thank you" not in x and "#" not in x]
    telling = [line for line in lines if re.search("error|not responding|mismatch|cannot|can't|fail", line, re.I)]
    return (telling or lines or ["it printed nothing"])[0 if telling else -1].removeprefix("avrdude: ")


def _confirm(port: str) -> str:
    """Wait for the board's port, and for the first message of its firmware."""
    back = wait_for(lambda: port if Path(port).exists() else find(list_seen(), Role.BOARD, BOARD_NAME), RESTART_S)
    if back is None:
        raise EchostepError(
            f"written and verified, but the board did not come back in {RESTART_S:.0f} s: unplug it and plug it in again; "
            "one of 3.3 V and 8 MHz never does: use a board of 5 V and 16 MHz"
        )
    if said := wait_for(lambda: _answer(back), RESTART_S):
        return said
    raise EchostepError(
        f"written and verified, but {back} is silent: unplug the board and plug it in again, then: echostep doctor"
    )


def _answer(port: str) -> str | None:
    """The answer of the firmware at a port, in words; None while it is silent, or the bootloader's port is going away."""
    try:
        probed = probe({BOARD: port}, PROBE_S)
    except EchostepError:
        return None
    if probed.stale_firmware:
        return f"written and verified; {probed.stale_firmware}"
    if i := probed.reports.identity:
        return f"written and verified; firmware {i.version_major}.{i.version_minor}.{i.version_patch} answers at {port}"
    return None
