# SPDX-License-Identifier: GPL-3.0-or-later
"""The twin in real time: a simulated walk in the demo building, the board and the MTx on two pseudo terminals (`make twin`).

In: the ELF and the twin; the MTx begins with its factory settings and accepts its configuration. Out: two ports for `echostep live`, and the
true path in out/twin/truth.csv. The walk begins when the board's port is opened, from its start each time, and is repeated until Ctrl-C. With
`--beacons udp://127.0.0.1:9000` a simulated gateway sends the readings of beacons along the walk to that port. With `--still`
the wearer moves as `echostep calibrate` requests; boxes of the kit of 2026 lie as `calibrate accelerometers` requests. Owns both pseudo terminals.
"""

from __future__ import annotations

import argparse
import contextlib
import itertools
import os
import signal
import sys
import threading
import time
import tty
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from echostep.errors import EchostepError
from echostep.plan import load_plan
from echostep.xsens import MtxReader
from echostep.xsens.reader import warm_up
from echostep_app.commands.actions.beacon_player import simulate_gateway
from echostep_simulation.devices.beacon_gateway import SPACING_M
from echostep_simulation.devices.board import BoardProcess, Sent
from echostep_simulation.devices.foot_board import FootBoardPort
from echostep_simulation.kits import Kit
from echostep_simulation.scenario import DEMO_WAYPOINTS, Scenario, demo_scenario
from echostep_simulation.stimulus import NO_SYNC, ROW
from echostep_studies.simulation.devices.mtx_setup import MtxDevice
from echostep_studies.simulation.devices.rehearsal import Act, LyingParts, Rehearsal
from places import OUT, PLAN, TWIN

BLOCK_MS, IDLE_MS = 10, 50
FOOT_BOARD = 2  # seed of the one on the foot
LEFT = "the board's port was closed: its next opening begins the walk anew"
LATE_S = 0.5  # a delay behind real time that is reported
CALIBRATION = "out/twin/calibration.toml"


class PtyBoard(BoardProcess):
    """The twin with its port on a pseudo terminal: rows in, the firmware's bytes to the program that has the port open."""

    def __init__(self, seed: int = 1) -> None:
        """`seed`: which of all boards it is."""
        super().__init__([*TWIN, "--pty", "--seed", str(seed)])
        self.port, self.is_open = "", False
        self.t_s = 0.0  # board time
        self.advance(np.zeros(0, ROW))

    def advance(self, rows: NDArray[Any]) -> Sent:
        """Run the firmware for one millisecond per row. The list is empty: the bytes go to the terminal."""
        super().advance(rows)
        self.t_s = round(self.t_s + 1e-3 * len(rows), 3)
        for _, text in self.trace:
            if text.startswith("board port "):
                self.port = text.removeprefix("board port ")
            elif text.startswith("port "):
                self.is_open = text == "port opened"
        self.trace.clear()
        return []

    def send(self, sent: bytes) -> None:
        """Does nothing: the host writes to the port itself."""

    def fault(self, text: str) -> None:
        """Set a fault switch, `name=value`; after `usb=plug` the port has another name."""
        super().fault(text)
        self.advance(np.zeros(0, ROW))


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
        """The MTx had no power: it restarts with the settings that it was given [Xsens MT0101P], and counts its samples from 0."""
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


def in_real_time() -> Iterator[int]:
    """The milliseconds at which blocks of BLOCK_MS begin, each at its time; a simulation that is too late goes on from where it is."""
    due_s = time.monotonic()
    for begin_ms in itertools.count(0, BLOCK_MS):
        yield begin_ms
        due_s += BLOCK_MS * 1e-3
        late_s = time.monotonic() - due_s
        if late_s > LATE_S:
            print(f"the simulation is {late_s:.1f} s behind real time", file=sys.stderr)
            due_s += late_s
        time.sleep(max(0.0, -late_s))


def during(scenario: Scenario) -> Iterator[int]:
    """The same for as long as a walk takes."""
    return itertools.takewhile(lambda begin_ms: begin_ms < len(scenario.walk.t_s), in_real_time())


def wait_for_opening(board: PtyBoard, mtx: PtyMtx, expected: Callable[[], bool] = lambda: True) -> None:
    """Run the board with empty rows, in real time, until a program opens its port, or is no longer `expected` to."""
    idle = np.zeros(IDLE_MS, ROW)
    idle["sync_us"] = NO_SYNC
    while not board.is_open and expected():
        board.advance(idle)
        mtx.answer_requests()
        time.sleep(IDLE_MS * 1e-3)


def advance(board: PtyBoard, mtx: PtyMtx, rows: NDArray[Any]) -> None:
    """Run the board, whose SyncOut comes from the MTx."""
    if not mtx.device.pulses:
        rows["sync_us"] = NO_SYNC
    board.advance(rows)
    mtx.answer_requests()


def play(scenario: Scenario, board: PtyBoard, mtx: PtyMtx) -> bool:
    """Play one walk in real time; returns whether it was played to its end: it is left when the program closes the board's port."""
    return all(board.is_open for _ in playing(scenario, board, mtx))


def playing(scenario: Scenario, board: PtyBoard, mtx: PtyMtx) -> Iterator[float]:
    """Play one walk in real time; gives the time of the walk (s) after each block."""
    frames = iter(zip(scenario.mtx.arrival_s.tolist(), scenario.mtx.frames, strict=True))
    waiting = next(frames, None)
    for begin_ms in during(scenario):
        advance(board, mtx, scenario.sensors.rows(begin_ms, begin_ms + BLOCK_MS).copy())
        now_s = (begin_ms + BLOCK_MS) * 1e-3
        while waiting is not None and waiting[0] <= now_s:
            mtx.measure(waiting[1])
            waiting = next(frames, None)
        yield now_s


def announce(command: str, **ports: str) -> None:
    """Print the ports, and what to start in another terminal."""
    for name, port in ports.items():
        print(f"{name:5} {port}")
    print(f"\nIn another terminal:\n  .venv/bin/echostep {command}\n\nCtrl-C ends.", flush=True)


def walk_with_mtx(options: argparse.Namespace) -> None:
    """Play the walk with the parts of the papers, and a gateway if wanted; each opening of the board's port restarts it."""
    truth = options.out / "truth.csv"
    more = f" --beacons {options.beacons} --guide Meeting" if options.beacons else ""
    with contextlib.closing(PtyBoard()) as board:
        for name in filter(None, options.without.split(",")):
            board.fault(f"{'srf_' * (name in ('left', 'right'))}{name}=absent")
        mtx = PtyMtx()
        announce(f"live --plan {PLAN} --board {board.port} --mtx {mtx.port}{more}", board=board.port, mtx=mtx.port)
        while True:
            scenario, gateway = demo_scenario(load_plan(PLAN), options.seed, board), Gateway(board)
            wait_for_opening(board, mtx)
            scenario.write_truth(truth, board.t_s)
            if options.beacons:
                arguments = (PLAN, truth, options.beacons, SPACING_M, 1.0, options.seed, gateway.now_s)
                threading.Thread(target=simulate_gateway, args=arguments, daemon=True).start()
            gateway.left = not play(scenario, board, mtx)
            if gateway.left:
                print(LEFT, flush=True)


def walk_with_two_boards(options: argparse.Namespace) -> None:
    """Play the walk with both boards of 2026; each opening of the belt board's port restarts it."""
    with contextlib.closing(PtyBoard()) as board, contextlib.closing(PtyBoard(FOOT_BOARD)) as foot_board:
        announce(
            f"live --plan {PLAN} --board {board.port} --foot {foot_board.port}", board=board.port, foot=foot_board.port
        )
        while True:
            scenario = Scenario(
                load_plan(PLAN), DEMO_WAYPOINTS, options.seed, board, kit=Kit.OF_2026, foot_board=foot_board
            )
            foot = scenario.foot
            assert isinstance(foot, FootBoardPort)
            while not board.is_open:
                board.advance(scenario.sensors.rows(0, IDLE_MS))
                foot_board.advance(foot.sensors.rows(0, IDLE_MS))
                time.sleep(IDLE_MS * 1e-3)
            scenario.write_truth(options.out / "truth.csv", board.t_s)
            for begin_ms in itertools.takewhile(lambda _: board.is_open, during(scenario)):
                board.advance(scenario.sensors.rows(begin_ms, begin_ms + BLOCK_MS))
                foot_board.advance(foot.sensors.rows(begin_ms, begin_ms + BLOCK_MS))
            if not board.is_open:
                print(LEFT, flush=True)


def rehearse(options: argparse.Namespace) -> None:
    """Play the poses and movements of `echostep calibrate`, the next one at each opening of the board's port."""
    with contextlib.closing(PtyBoard()) as board:
        mtx, rehearsal = PtyMtx(), Rehearsal(load_plan(PLAN), options.seed, board)
        announce(f"calibrate --board {board.port} --out {CALIBRATION}", board=board.port, mtx=mtx.port)
        act, began_ms, was_open = Act.WALK, 0, False
        for now_ms in in_real_time():
            if board.is_open and not was_open:
                act, began_ms = Act((act + 1) % len(Act)), now_ms
                print(f"the wearer: {act.name.lower()}", flush=True)
            was_open = board.is_open
            advance(board, mtx, rehearsal.rows(act if was_open else Act.STAND, now_ms - began_ms, BLOCK_MS))


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


def turn_boxes(options: argparse.Namespace) -> None:
    """Lay the parts of both boards of 2026 on another side whenever a program has closed their port."""
    belt, foot = (LyingBoard(options.seed, foot=foot) for foot in (False, True))
    with contextlib.closing(belt.board), contextlib.closing(foot.board):
        ports = {"board": belt.board.port, "foot": foot.board.port}
        command = " ".join(f"--{name} {port}" for name, port in ports.items())
        announce(f"calibrate accelerometers {command} --out {CALIBRATION}", **ports)
        for _ in in_real_time():
            for lying in (belt, foot):
                was_open = lying.board.is_open
                lying.advance()
                lying.pose += was_open and not lying.board.is_open


def until_interrupted(work: Callable[[], None]) -> int:
    """Work until its end, Ctrl-C or SIGTERM."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.default_int_handler)
    try:
        with contextlib.suppress(KeyboardInterrupt):
            work()
    except EchostepError as error:
        raise SystemExit(str(error)) from error
    return 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=OUT / "twin", metavar="DIR")
    parser.add_argument("--beacons", metavar="PORT", help="play a beacon gateway to this port, in step with the walk")
    parser.add_argument("--kit", choices=[kit.value for kit in Kit], default=Kit.PAPERS.value, help="2026: two boards")
    parser.add_argument("--still", action="store_true", help="a wearer who does what echostep calibrate asks")
    parser.add_argument("--without", default="", metavar="PARTS", help="parts that are not wired yet, as left,thigh")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    plays = (walk_with_two_boards, turn_boxes) if options.kit == Kit.OF_2026.value else (walk_with_mtx, rehearse)
    return until_interrupted(lambda: plays[options.still](options))


if __name__ == "__main__":
    sys.exit(main())
