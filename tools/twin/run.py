# SPDX-License-Identifier: GPL-3.0-or-later
"""The twin in real time: a simulated walk in the demo building, the board and the MTx on two pseudo terminals (`make twin`).

In: the ELF and the twin; the MTx begins with its factory settings and accepts its configuration. Out: two ports for `echostep live`, and the
true path in out/twin/truth.csv. The walk begins when the board's port is opened, each time anew, and is repeated until Ctrl-C. With
`--beacons udp://127.0.0.1:9000` a simulated gateway sends the readings of beacons along the walk to that port. With `--still`
the wearer moves as `echostep calibrate` requests; boxes of the kit of 2026 lie as `calibrate accelerometers` requests. Owns both pseudo terminals.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import re
import signal
import subprocess
import sys
import threading
import time
import tty
from collections.abc import Callable, Iterator
from importlib.resources import as_file, files
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from echostep.plan import Plan, load_plan
from echostep.xsens import MtxReader
from echostep.xsens.reader import warm_up
from echostep_app.commands.actions.beacon_player import simulate_gateway
from echostep_app.simulation.devices.beacon_gateway import SPACING_M
from echostep_app.simulation.devices.board import Sent
from echostep_app.simulation.devices.foot_board import FootBoardPort
from echostep_app.simulation.kits import Kit
from echostep_app.simulation.scenario import DEMO_WAYPOINTS, Scenario, demo_scenario
from echostep_app.simulation.stimulus import EXTENDED_ROW, NO_SYNC, ROW
from echostep_studies.simulation.devices.mtx_setup import MtxDevice
from echostep_studies.simulation.devices.poses import LyingParts
from echostep_studies.simulation.devices.rehearsal import Act, Rehearsal
from places import OUT, TWIN

BLOCK_MS, IDLE_MS = 10, 50
FOOT_BOARD = 2  # seed of the one on the foot
LEFT = "the board's port was closed: its next opening begins the walk anew"
LATE_S = 0.5  # a delay behind real time that is reported


class PtyBoard:
    """The twin with its port on a pseudo terminal: rows in, the firmware's bytes to the program that has the port open."""

    def __init__(self, seed: int = 1) -> None:
        """`seed`: which of all boards it is."""
        command = [*TWIN, "--pty", "--seed", str(seed)]
        self._child = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        assert self._child.stdin
        assert self._child.stdout
        assert self._child.stderr
        self._in: IO[bytes] = self._child.stdin
        self._out: IO[bytes] = self._child.stdout
        self._log: IO[bytes] = self._child.stderr
        self.port = self._told_port()
        self.is_open = False
        self.t_s = 0.0  # board time

    def _told_port(self) -> str:
        """The name of the pseudo terminal, which the twin prints when it makes one."""
        match = re.match(rb"board port: (\S+)", self._log.readline())
        if not match:
            raise SystemExit("the twin made no port")
        return match[1].decode()

    def advance(self, rows: NDArray[Any]) -> Sent:
        """Run the firmware for one millisecond per row. The list is empty: the bytes go to the terminal."""
        body = rows.tobytes()
        kind = b"E" if rows.dtype == EXTENDED_ROW else b"R"
        self._in.write(kind + len(body).to_bytes(4, "little") + body)
        self._in.flush()
        while True:
            head = self._out.read(5)
            if len(head) < 5:
                raise SystemExit("the twin ended")
            record = self._out.read(int.from_bytes(head[1:], "little"))
            if head[:1] == b"T" and record[8:].startswith(b"port "):
                self.is_open = record[8:] == b"port opened"
            if head[:1] == b"A":
                self.t_s = int.from_bytes(record, "little") * 1e-9
                return []

    def send(self, sent: bytes) -> None:
        """Does nothing: the host writes to the port itself."""

    def fault(self, text: str) -> None:
        """Set a fault switch, `name=value`; after `usb=plug` the port has another name."""
        self._in.write(b"F" + len(text).to_bytes(4, "little") + text.encode())
        self._in.flush()
        if text == "usb=plug":
            self.port = self._told_port()

    def close(self) -> None:
        """Stop the twin."""
        self._child.kill()
        self._child.wait()
        for pipe in (self._in, self._out, self._log):
            with contextlib.suppress(OSError):
                pipe.close()


class Gateway:
    """The clock of the beacons' gateway beside a walk; once the walk is `left`, its thread ends."""

    def __init__(self, board: PtyBoard) -> None:
        self._board = board
        self.left = False

    def now_s(self) -> float:
        """Board time; raises SystemExit, which ends a thread silently, when the walk was left."""
        if self.left:
            raise SystemExit
        return self._board.t_s


class PtyMtx:
    """A simulated MTx on a pseudo terminal, which answers the host's requests."""

    def __init__(self) -> None:
        self._ends: tuple[int, ...] = ()  # ours and theirs; none: unplugged
        self.counter = self._counted = 0  # of the newest sample; of the one at its last start
        self.device = MtxDevice()
        self.plug()
        warm_up()

    def plug(self) -> None:
        """Make the pseudo terminal, perhaps with another name than before."""
        ours, theirs = self._ends = os.openpty()
        tty.setraw(theirs)
        os.set_blocking(ours, False)
        self.port = os.ttyname(theirs)

    def unplug(self) -> None:
        """Remove the pseudo terminal."""
        for end in self._ends:
            os.close(end)
        self._ends = ()

    def power_on(self) -> None:
        """The MTx had no power: it starts anew, with the settings that it was given [Xsens MT0101P], and counts its samples from 0."""
        self._counted = self.counter
        self._write(self.device.power_on(time.monotonic()))

    def answer_requests(self) -> None:
        """Read the host's requests and send the answers."""
        received = b""
        with contextlib.suppress(BlockingIOError):
            received = os.read(self._ends[0], 4096) if self._ends else b""
        self._write(self.device.feed(received, time.monotonic()))

    def measure(self, frame: bytes) -> None:
        """Send a measurement, given as a frame in the project's format, in the format that the device is set to."""
        for sample in MtxReader().feed(frame):
            self.counter = sample.counter
            self._write(self.device.measure(sample._replace(counter=(sample.counter - self._counted) & 0xFFFF)))

    def _write(self, sent: bytes) -> None:
        with contextlib.suppress(BlockingIOError):  # no program reads: the bytes are lost, as on a cable without a host
            if sent and self._ends:
                os.write(self._ends[0], sent)


def wait_for_opening(board: PtyBoard, mtx: PtyMtx, expected: Callable[[], bool] = lambda: True) -> None:
    """Run the board with empty rows, in real time, until a program opens its port, or is no longer `expected` to."""
    idle = np.zeros(IDLE_MS, ROW)
    idle["sync_us"] = NO_SYNC
    while not board.is_open and expected():
        board.advance(idle)
        mtx.answer_requests()
        time.sleep(IDLE_MS * 1e-3)


def play(scenario: Scenario, board: PtyBoard, mtx: PtyMtx) -> bool:
    """Play one walk in real time; returns whether it was played to its end: it is left when the program closes the board's port."""
    return all(board.is_open for _ in playing(scenario, board, mtx))


def playing(scenario: Scenario, board: PtyBoard, mtx: PtyMtx) -> Iterator[float]:
    """Play one walk in real time; gives the time of the walk (s) after each block."""
    frames = iter(zip(scenario.mtx.arrival_s.tolist(), scenario.mtx.frames, strict=True))
    waiting = next(frames, None)
    began = time.monotonic()
    for start in range(0, len(scenario.walk.t_s), BLOCK_MS):
        rows = scenario.sensors.rows(start, start + BLOCK_MS).copy()
        if not mtx.device.pulses:
            rows["sync_us"] = NO_SYNC
        board.advance(rows)
        mtx.answer_requests()
        now_s = (start + BLOCK_MS) * 1e-3
        while waiting is not None and waiting[0] <= now_s:
            mtx.measure(waiting[1])
            waiting = next(frames, None)
        ahead = began + now_s - time.monotonic()
        if ahead > 0:
            time.sleep(ahead)
        elif ahead < -LATE_S:
            print(f"the simulation is {-ahead:.1f} s behind real time", file=sys.stderr)
            began = time.monotonic() - now_s
        yield now_s


def play_2026(plan: Plan, seed: int, board: PtyBoard, foot_board: PtyBoard, truth: Path) -> bool:
    """Wait for an opening of the board's port, then play one walk with both boards of 2026 in real time; returns as `play` does."""
    scenario = Scenario(plan, DEMO_WAYPOINTS, seed, board, kit=Kit.OF_2026, foot_board=foot_board)
    foot = scenario.foot
    assert isinstance(foot, FootBoardPort)
    while not board.is_open:
        board.advance(scenario.sensors.rows(0, IDLE_MS))
        foot_board.advance(foot.sensors.rows(0, IDLE_MS))
        time.sleep(IDLE_MS * 1e-3)
    scenario.write_truth(truth, board.t_s)
    due_s = time.monotonic()
    for start in range(0, len(scenario.walk.t_s), BLOCK_MS):
        board.advance(scenario.sensors.rows(start, start + BLOCK_MS))
        foot_board.advance(foot.sensors.rows(start, start + BLOCK_MS))
        if not board.is_open:
            return False
        due_s = max(due_s + BLOCK_MS * 1e-3, time.monotonic() - LATE_S)
        time.sleep(max(0.0, due_s - time.monotonic()))
    return True


def run_2026(seed: int, out: Path, *, once: bool) -> int:
    """Play the two boards of 2026 until Ctrl-C."""
    boards = PtyBoard(), PtyBoard(FOOT_BOARD)
    with as_file(files("echostep") / "plans" / "demo.json") as path:
        plan = load_plan(path)
        out.mkdir(parents=True, exist_ok=True)
        print(f"board {boards[0].port}\nfoot  {boards[1].port}\n\nIn another terminal:\n"
              f"  .venv/bin/echostep live --plan {path} --board {boards[0].port} --foot {boards[1].port}\n\nCtrl-C ends.", flush=True)  # fmt: skip
    try:
        while True:
            ended = play_2026(plan, seed, *boards, out / "truth.csv")
            if ended and once:
                break
            if not ended:
                print(LEFT, flush=True)
    except KeyboardInterrupt:
        pass
    finally:
        for board in boards:
            board.close()
    return 0


def rehearse(rehearsal: Rehearsal, board: PtyBoard, mtx: PtyMtx) -> None:
    """Play the poses and movements of `echostep calibrate` in real time, the next one at each opening of the board's port, until Ctrl-C."""
    act, at_ms, was_open = Act.WALK, 0, False
    due_s = time.monotonic()
    while True:
        if board.is_open and not was_open:
            act, at_ms = Act((act + 1) % len(Act)), 0
            print(f"the wearer: {act.name.lower()}", flush=True)
        was_open = board.is_open
        rows = rehearsal.rows(act if was_open else Act.STAND, at_ms, BLOCK_MS)
        if not mtx.device.pulses:
            rows["sync_us"] = NO_SYNC
        board.advance(rows)
        mtx.answer_requests()
        at_ms += BLOCK_MS
        due_s = max(due_s + BLOCK_MS * 1e-3, time.monotonic() - LATE_S)
        time.sleep(max(0.0, due_s - time.monotonic()))


class LyingBoard:
    """A board of 2026 whose parts lie still in a pose."""

    def __init__(self, seed: int, *, foot: bool) -> None:
        self.board = PtyBoard(FOOT_BOARD if foot else 1)
        self.board.fault("kit=foot" if foot else "kit=2026")
        self.parts = LyingParts(np.random.default_rng([seed, foot]), "foot board" if foot else "belt board")
        self.pose = 0

    def advance(self) -> None:
        """Run the firmware for BLOCK_MS."""
        self.board.advance(self.parts.rows(self.pose, BLOCK_MS))


def run_poses(seed: int) -> int:
    """Lay the parts of both boards of 2026 on another side whenever a program has closed their port, until Ctrl-C."""
    boards = LyingBoard(seed, foot=False), LyingBoard(seed, foot=True)
    ports = [lying.board.port for lying in boards]
    print(f"board {ports[0]}\nfoot  {ports[1]}\n\nIn another terminal:\n  .venv/bin/echostep calibrate accelerometers "
          f"--board {ports[0]} --foot {ports[1]} --out out/twin/calibration.toml\n\nCtrl-C ends.", flush=True)  # fmt: skip
    due_s = time.monotonic()
    try:
        while True:
            for lying in boards:
                was_open = lying.board.is_open
                lying.advance()
                lying.pose += was_open and not lying.board.is_open
            due_s = max(due_s + BLOCK_MS * 1e-3, time.monotonic() - LATE_S)
            time.sleep(max(0.0, due_s - time.monotonic()))
    except KeyboardInterrupt:
        pass
    finally:
        for lying in boards:
            lying.board.close()
    return 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--once", action="store_true", help="end after one walk")
    parser.add_argument("--out", type=Path, default=OUT / "twin", metavar="DIR")
    parser.add_argument("--beacons", metavar="PORT", help="play a beacon gateway to this port, in step with the walk")
    parser.add_argument(
        "--kit", choices=[kit.value for kit in Kit], default=Kit.PAPERS.value, help="2026: a foot board too"
    )
    parser.add_argument("--still", action="store_true", help="a wearer who does what echostep calibrate asks")
    options = parser.parse_args()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.default_int_handler)
    if options.kit == Kit.OF_2026.value and options.still:
        return run_poses(options.seed)
    if options.kit == Kit.OF_2026.value:
        return run_2026(options.seed, options.out, once=options.once)
    with as_file(files("echostep") / "plans" / "demo.json") as path:
        plan = load_plan(path)
        board = PtyBoard()
        mtx = PtyMtx()
        options.out.mkdir(parents=True, exist_ok=True)
        more = f" --beacons {options.beacons} --guide Meeting" if options.beacons else ""
        command = f"live --plan {path} --board {board.port} --mtx {mtx.port}{more}"
        if options.still:
            command = f"calibrate --board {board.port} --out out/twin/calibration.toml"
        print(f"board {board.port}\nmtx   {mtx.port}\n\nIn another terminal:\n"
              f"  .venv/bin/echostep {command}\n\nCtrl-C ends.", flush=True)  # fmt: skip
    try:
        if options.still:
            rehearse(Rehearsal(plan, options.seed, board), board, mtx)
        while True:
            scenario, gateway = demo_scenario(plan, options.seed, board), None
            wait_for_opening(board, mtx)
            truth = options.out / "truth.csv"
            scenario.write_truth(truth, board.t_s)
            if options.beacons:
                gateway = Gateway(board)
                arguments = (path, truth, options.beacons, SPACING_M, 1.0, options.seed, gateway.now_s)
                threading.Thread(target=simulate_gateway, args=arguments, daemon=True).start()
            ended = play(scenario, board, mtx)
            if gateway:
                gateway.left = not ended
            if ended and options.once:
                break
            if not ended:
                print(LEFT, flush=True)
    except KeyboardInterrupt:
        pass
    finally:
        board.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
